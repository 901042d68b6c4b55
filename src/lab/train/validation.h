#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "model/shared/torch/render_op.h"
#include "model/shared/torch/trainable_network.h"
#include "train/perceptual_objective.h"
#include "train/train_config.h"
#include "train/train_request.h"
#include "train/training_object.h"

namespace anchorsplat {

// How well a network does on objects it is not trained on: held-out views at full size, renders clamped to 0–1, means
// over the views of an object and then over objects, as the evaluation's protocol "heldout". Beside it the raw splat
// and the filter with its default strength and the true pixel sizes.
class Validation {
 public:
  // `perceptual` may be null.
  Validation(const ValidationConfig& config, std::vector<SceneEntry> entries, std::filesystem::path cache,
             std::shared_ptr<const PerceptualObjective> perceptual, torch::Device device);

  size_t objects() const { return entries_.size(); }

  // Of the network as it is, which is put into evaluation mode and back. Errors: those of OpenTrainingObject, Prepare
  // and the rasterizer.
  Result<TrainQuality> Measure(TrainableNetwork& network);
  // Measured once.
  Result<TrainQuality> Raw();
  Result<TrainQuality> Filter();

 private:
  struct Object;
  Result<std::vector<TrainQuality>> MeasureClouds(const std::function<Result<GaussianTensors>(Object&)>& cloud_of);
  Result<Object*> Open(size_t index);

  ValidationConfig config_;
  std::vector<SceneEntry> entries_;
  std::filesystem::path cache_;
  std::shared_ptr<const PerceptualObjective> perceptual_;
  torch::Device device_;
  RenderOp render_;
  std::vector<std::shared_ptr<Object>> open_;
  std::optional<TrainQuality> raw_, filter_;
};

}  // namespace anchorsplat
