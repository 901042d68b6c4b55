#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"
#include "dataset/scene_reader.h"
#include "train/train_request.h"

namespace anchorsplat {

// The objects of a training, found but not read.
struct TrainingData {
  std::vector<SceneEntry> training;    // in order of data sets and names
  std::vector<SceneEntry> validation;  // none of them in `training`, by folder or by name
  std::string names;                   // JSON: those of `training`
};

// Objects without a splat are left out with a warning. Errors: those of ListScenes; kNotFound: nothing to train on.
Result<TrainingData> FindTrainingData(const TrainRequest& request);

// Draws SceneEntry::high_size of every object, by its name alone: `least` to `greatest` times the low views' pixels,
// evenly in the logarithm. Errors: those of Scene::Open, which has to be able to make such views.
Status DrawUpscales(double least, double greatest, std::vector<SceneEntry>& scenes);

}  // namespace anchorsplat
