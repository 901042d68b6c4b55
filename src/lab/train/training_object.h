#pragma once

#include <cstddef>
#include <filesystem>
#include <list>
#include <memory>
#include <mutex>
#include <vector>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "dataset/capture.h"
#include "dataset/scene_reader.h"
#include "train/seen_gaussians.h"
#include "train/true_views.h"

namespace anchorsplat {

// A capture, and how it becomes a training object.
struct TrainingCapture {
  CaptureFolder capture;
  CaptureRecipe recipe;
  std::filesystem::path fit_folder;
};

// An object of a data set, ready for training or validation.
struct TrainingObject {
  std::string name;
  GaussianCloud cloud;             // the low-quality splat without non-finite rows
  Buffer<float> pixel_sizes;       // [N] p_LR: median over the low cameras that see a Gaussian, as for eval's filter
  double upscale = 4;              // u: high pixels per low pixel side
  double strength = 0;             // f of the filter
  std::vector<Camera> views;       // high resolution
  std::vector<Camera> low_views;   // that the splat was fitted to, same poses
  std::vector<size_t> training;    // views that training may use
  std::vector<size_t> validation;  // views that the splat was not fitted to
  std::shared_ptr<const TrueViews> truth;
  std::array<float, 3> background{};
  std::shared_ptr<void> prepared;  // a network's tables for the unaugmented cloud; set by whoever computes them
  // For training on parts: a network's survey, and visibility in training views; set likewise.
  std::shared_ptr<const void> survey;
  std::shared_ptr<const SeenGaussians> seen;
};

// Opens an object. `views_per_object`: number of fitted views to use for training, chosen by the object's name alone
// (so that trainings can share pictures); 0: all. Errors: those of Scene; kBadFile: a splat without finite Gaussians,
// no views, high views smaller than the low ones.
Result<std::shared_ptr<TrainingObject>> OpenTrainingObject(const SceneEntry& entry, int views_per_object,
                                                           const std::filesystem::path& cache);

// Opens a capture. The truth are its full-size photographs. Training uses the views that the fit was not trained on,
// because for the others a network may learn what the fit has memorised.
//
// Errors: those of OpenCapture and PixelSizesFromCameras; kBadFile: no view is held out.
Result<std::shared_ptr<TrainingObject>> OpenTrainingCapture(const TrainingCapture& entry);

// At most `most` of `values`, evenly spread; all if `most` is 0.
std::vector<size_t> EvenlySpread(const std::vector<size_t>& values, size_t most);

// Cache of the objects used last, by index. Thread-safe.
class ObjectStore {
 public:
  ObjectStore(std::vector<SceneEntry> entries, std::vector<TrainingCapture> captures, int views_per_object,
              std::filesystem::path cache, size_t capacity)
      : entries_(std::move(entries)),
        captures_(std::move(captures)),
        views_per_object_(views_per_object),
        cache_(std::move(cache)),
        capacity_(capacity) {}

  size_t size() const { return entries_.size() + captures_.size(); }
  Result<std::shared_ptr<TrainingObject>> Get(size_t index);

 private:
  const std::vector<SceneEntry> entries_;
  const std::vector<TrainingCapture> captures_;  // numbered after them
  const int views_per_object_;
  const std::filesystem::path cache_;
  const size_t capacity_;
  std::mutex mutex_;
  std::list<std::pair<size_t, std::shared_ptr<TrainingObject>>> used_;  // most recent first
};

}  // namespace anchorsplat
