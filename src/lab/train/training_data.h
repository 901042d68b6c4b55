#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"
#include "dataset/scene_reader.h"
#include "train/train_config.h"
#include "train/train_request.h"
#include "train/training_object.h"

namespace anchorsplat {

// Objects of a training, found but not read.
struct TrainingData {
  std::vector<SceneEntry> training;    // by data set, then name
  std::vector<SceneEntry> validation;  // disjoint from `training`, by folder and by name
  std::vector<TrainingCapture> captures;
  std::string names;  // JSON: names of `training`; captures are "capture 1", …, as their owners may want no other
};

// Leaves out objects without a splat, with a warning. Fits captures unless `cache` has their fits. Errors: those of
// ListScenes, FindCaptures and OpenCapture; kNotFound: nothing to train on.
Result<TrainingData> FindTrainingData(const TrainRequest& request, const CapturesConfig& captures,
                                      const std::filesystem::path& cache);

// Draws SceneEntry::high_size of every object from its name alone: `least` to `greatest` times the low views' size,
// log-uniformly. Errors: those of Scene::Open, for views that cannot be rendered on demand.
Status DrawUpscales(double least, double greatest, std::vector<SceneEntry>& scenes);

}  // namespace anchorsplat
