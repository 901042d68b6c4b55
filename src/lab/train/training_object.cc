#include "train/training_object.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/random.h"
#include "core/text.h"
#include "dataset/object_name.h"
#include "enhance/filter.h"
#include "enhance/pixel_size.h"

namespace anchorsplat {

namespace {

// `count` of the values, chosen by the name alone, ascending.
std::vector<size_t> Drawn(std::vector<size_t> values, size_t count, const std::string& name) {
  if (count == 0 || count >= values.size()) return values;
  Random random(StableHash(name));
  for (size_t i = 0; i < count; ++i) {
    std::swap(values[i], values[i + static_cast<size_t>(random.Below(static_cast<int64_t>(values.size() - i)))]);
  }
  values.resize(count);
  std::sort(values.begin(), values.end());
  return values;
}

// The splat without rows that are not finite, and what follows from it and its cameras.
Status TakeSplat(const GaussianCloud& all, std::vector<Camera> fitted, CameraPixelRule rule, TrainingObject& object) {
  std::vector<int64_t> rows;
  for (int64_t i = 0; i < all.size(); ++i) {
    if (IsFinite(all, i)) rows.push_back(i);
  }
  if (rows.empty()) {
    return Error{ErrorCode::kBadFile, Cat(object.name, ": its splat has no Gaussian with finite values")};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(object.cloud, Subset(all, rows));
  object.strength = DefaultFilterStrength(object.upscale, object.cloud.render_mode);
  CameraSet low;
  low.cameras = std::move(fitted);
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraPixelSizes sizes, PixelSizesFromCameras(object.cloud, low, rule));
  object.pixel_sizes = std::move(sizes.sizes);
  return {};
}

}  // namespace

std::vector<size_t> EvenlySpread(const std::vector<size_t>& values, size_t most) {
  if (most == 0 || most >= values.size()) return values;
  std::vector<size_t> chosen;
  for (size_t i = 0; i < most; ++i) chosen.push_back(values[(2 * i + 1) * values.size() / (2 * most)]);
  return chosen;
}

Result<std::shared_ptr<TrainingObject>> OpenTrainingCapture(const TrainingCapture& entry) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(Capture capture,
                               OpenCapture(entry.capture.name, entry.capture.folder, entry.recipe, entry.fit_folder));
  if (capture.held_out.empty()) {
    return Error{ErrorCode::kBadFile, Cat(entry.capture.folder.string(),
                                          ": no view is held out, so there is no ground truth to ", "train on")};
  }
  auto object = std::make_shared<TrainingObject>();
  object->name = capture.name;
  object->background = capture.background;
  object->upscale = entry.recipe.downscale;
  ANCHORSPLAT_RETURN_IF_ERROR(TakeSplat(capture.cloud, capture.FittedViews(), CameraPixelRule::kAuto, *object));
  object->low_views = std::move(capture.low_views);
  object->training = object->validation = std::move(capture.held_out);
  object->truth = std::make_shared<TrueViews>(
      capture.views, [views = capture.views](size_t view) { return FullPicture(views.at(view)); });
  object->views = std::move(capture.views);
  return object;
}

Result<std::shared_ptr<TrainingObject>> OpenTrainingObject(const SceneEntry& entry, int views_per_object,
                                                           const std::filesystem::path& cache) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Scene scene, Scene::Open(entry));
  const auto bad = [&](const std::string& sentence) {
    return Error{ErrorCode::kBadFile, Cat(entry.folder.string(), ": ", sentence)};
  };
  if (scene.high_views().empty()) return bad("has no views");
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud all, scene.LowSplat());
  auto object = std::make_shared<TrainingObject>();
  object->name = scene.name();
  object->background = scene.background();
  object->views = scene.high_views();
  object->low_views = scene.low_views();
  object->upscale = static_cast<double>(scene.high_views()[0].intrinsics.width) /
                    static_cast<double>(scene.low_views()[0].intrinsics.width);
  if (!(object->upscale >= 1)) return bad("its high-resolution views are smaller than its low-resolution ones");
  ANCHORSPLAT_RETURN_IF_ERROR(TakeSplat(all, scene.low_views(), CameraPixelRule::kMedian, *object));

  object->validation = scene.held_out();
  std::vector<size_t> fitted(object->views.size());
  std::iota(fitted.begin(), fitted.end(), size_t{0});
  std::erase_if(fitted, [&](size_t view) {
    return std::find(object->validation.begin(), object->validation.end(), view) != object->validation.end();
  });
  if (fitted.empty()) return bad("all its views are held out, so none is left to train on");
  object->training = Drawn(std::move(fitted), static_cast<size_t>(views_per_object), object->name);
  if (object->validation.empty()) object->validation = object->training;
  object->truth = std::make_shared<TrueViews>(entry, scene, cache);
  return object;
}

Result<std::shared_ptr<TrainingObject>> ObjectStore::Get(size_t index) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (auto it = used_.begin(); it != used_.end(); ++it) {
      if (it->first != index) continue;
      used_.splice(used_.begin(), used_, it);
      return used_.front().second;
    }
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(auto object, index < entries_.size()
                                                ? OpenTrainingObject(entries_[index], views_per_object_, cache_)
                                                : OpenTrainingCapture(captures_.at(index - entries_.size())));
  const std::lock_guard<std::mutex> lock(mutex_);
  used_.emplace_front(index, object);
  if (used_.size() > capacity_) used_.pop_back();
  return object;
}

}  // namespace anchorsplat
