#include "train/training_data.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "core/file_system.h"
#include "core/log.h"
#include "core/random.h"
#include "core/text.h"
#include "dataset/dataset_split.h"
#include "dataset/object_name.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

bool HasSplits(const fs::path& dataset) { return Exists(dataset / kSplitsName); }

Status AppendScenes(const fs::path& dataset, const std::string& split, std::vector<SceneEntry>& scenes) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto found, ListScenes(dataset, {.split = split}));
  for (const SceneEntry& entry : found) {
    const auto scene = Scene::Open(entry);
    const Status whole = !scene.ok()                   ? Status(scene.error())
                         : !scene->LowSplatPath().ok() ? Status(scene->LowSplatPath().error())
                                                       : Status();
    if (whole.ok()) {
      scenes.push_back(entry);
    } else {
      LogWarning(Cat(entry.name, " skipped: ", whole.error().message));
    }
  }
  return {};
}

// A fit of each capture for every number of steps; those that are missing are made now, one after the other.
Status AppendCaptures(const fs::path& folder, const CapturesConfig& config, const fs::path& cache,
                      std::vector<TrainingCapture>& captures) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<CaptureFolder> found, FindCaptures(folder));
  for (const CaptureFolder& capture : found) {
    for (size_t fit = 0; fit < config.fit_steps.size(); ++fit) {
      const CaptureRecipe recipe = {
          .downscale = config.downscale, .hold_out = config.hold_out, .steps = config.fit_steps[fit], .seed = fit};
      captures.push_back({capture, recipe, cache / "fits" / Cat(capture.name, "-", fit)});
      const auto opened = OpenCapture(capture.name, capture.folder, recipe, captures.back().fit_folder);
      if (!opened.ok()) return Error{opened.error().code, Cat(capture.name, ": ", opened.error().message)};
    }
  }
  return {};
}

}  // namespace

Result<TrainingData> FindTrainingData(const TrainRequest& request, const CapturesConfig& captures,
                                      const fs::path& cache) {
  TrainingData data;
  for (const fs::path& dataset : request.validation) {
    // A data set without splits is used whole.
    ANCHORSPLAT_RETURN_IF_ERROR(AppendScenes(dataset, HasSplits(dataset) ? "validation" : "", data.validation));
  }
  for (const fs::path& dataset : request.datasets) {
    // Splits are respected: by default only the training objects are used.
    const std::string split = request.split.empty() && HasSplits(dataset) ? "train" : request.split;
    ANCHORSPLAT_RETURN_IF_ERROR(AppendScenes(dataset, split, data.training));
    if (request.validation.empty() && HasSplits(dataset)) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const Splits splits, ReadSplits(dataset));
      bool any = false;
      for (const auto& [name, which] : splits) any = any || which == "validation";
      if (any) ANCHORSPLAT_RETURN_IF_ERROR(AppendScenes(dataset, "validation", data.validation));
    }
  }
  std::set<std::string> held_out;
  for (const SceneEntry& entry : data.validation) held_out.insert(entry.name);
  const size_t before = data.training.size();
  std::erase_if(data.training, [&](const SceneEntry& entry) { return held_out.contains(entry.name); });
  if (data.training.size() != before) {
    LogWarning(Cat(before - data.training.size(), " objects are used for validation, so not for training"));
  }
  if (!request.captures.empty()) {
    ANCHORSPLAT_RETURN_IF_ERROR(AppendCaptures(request.captures, captures, cache, data.captures));
  }
  if (data.training.empty() && data.captures.empty()) {
    return Error{ErrorCode::kNotFound, "no objects to train on: the data sets contain none with a splat"};
  }
  nlohmann::json names = nlohmann::json::array();
  for (const SceneEntry& entry : data.training) names.push_back(entry.name);
  for (size_t i = 0; i < data.captures.size(); ++i) names.push_back(Cat("capture ", i + 1));
  data.names = names.dump();
  return data;
}

Status DrawUpscales(double least, double greatest, std::vector<SceneEntry>& scenes) {
  for (SceneEntry& entry : scenes) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(Scene scene, Scene::Open(entry));
    if (scene.low_views().empty()) continue;
    Random random(StableHash(entry.name + " upscale"));
    const double upscale = least * std::pow(greatest / least, random.Uniform(0, 1));
    entry.high_size = static_cast<int>(std::lround(upscale * scene.low_views().front().intrinsics.width));
    const Status resized = scene.ResizeHighViews(entry.high_size);
    if (!resized.ok()) return Error{resized.error().code, Cat("data.least_upscale: ", resized.error().message)};
  }
  return {};
}

}  // namespace anchorsplat
