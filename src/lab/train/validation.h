#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "network/torch/render_op.h"
#include "network/torch/trainable_network.h"
#include "train/perceptual_objective.h"
#include "train/train_config.h"
#include "train/train_request.h"
#include "train/training_object.h"

namespace anchorsplat {

// Measures a network on objects it is not trained on: held-out views at full size, renders clamped to 0–1, means over
// an object's views and then over objects, as protocol "heldout". Also measures the raw splat and the filter with
// default strength and true pixel sizes.
class Validation {
 public:
  // `perceptual` may be null.
  Validation(const ValidationConfig& config, std::vector<SceneEntry> entries, std::filesystem::path cache,
             std::shared_ptr<const PerceptualObjective> perceptual, torch::Device device);

  size_t objects() const { return entries_.size(); }

  // Measures the network in evaluation mode, then restores its mode. Errors: those of OpenTrainingObject, Prepare and
  // the rasterizer.
  Result<TrainQuality> Measure(TrainableNetwork& network);
  // Computed once.
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
