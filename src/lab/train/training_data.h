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
  std::vector<SceneEntry> training;    // in order of data sets and names
  std::vector<SceneEntry> validation;  // none of them in `training`, by folder or by name
  std::vector<TrainingCapture> captures;
  std::string names;  // JSON: those of `training`, and "capture 1", … of captures, whose owners may want no other
};

// Objects without a splat are left out with a warning. Errors: those of ListScenes, FindCaptures and OpenCapture;
// kNotFound: nothing to train on. Captures are fitted here where `cache` has no fit of theirs.
Result<TrainingData> FindTrainingData(const TrainRequest& request, const CapturesConfig& captures,
                                      const std::filesystem::path& cache);

// Draws SceneEntry::high_size of every object from its name alone: `least` to `greatest` times the low views' size,
// log-uniformly. Errors: those of Scene::Open, for views that cannot be rendered on demand.
Status DrawUpscales(double least, double greatest, std::vector<SceneEntry>& scenes);

}  // namespace anchorsplat
