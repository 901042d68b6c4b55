#include "eval/capture.h"

#include <algorithm>
#include <string>
#include <system_error>
#include <utility>

#include "cameras/camera_io.h"
#include "cameras/photograph.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/text.h"
#include "eval/kept_fit.h"
#include "eval/object_state.h"
#include "fit/far_shell.h"
#include "fit/initial_cloud.h"
#include "fit/training_views.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// The camera of a view's picture in full size, as far as the small one shows it.
Camera AtFullSize(Camera camera) {
  const int factor = camera.photograph.downscale;
  const Pinhole& low = camera.intrinsics;
  camera.intrinsics = {low.width * factor, low.height * factor, low.fx * factor,
                       low.fy * factor,    low.cx * factor,     low.cy * factor};
  camera.photograph.downscale = 1;
  return camera;
}

Result<ViewPicture> FullPicture(const Camera& camera) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(ViewPicture picture, ReadPhotograph(camera));
  const Pinhole& size = camera.intrinsics;
  if (picture.image.width == size.width && picture.image.height == size.height) return picture;
  if (!picture.ignored.empty()) {
    Buffer<uint8_t> kept(static_cast<size_t>(int64_t{size.width} * size.height));
    for (int y = 0; y < size.height; ++y) {
      const uint8_t* row = picture.ignored.data() + int64_t{y} * picture.image.width;
      std::copy(row, row + size.width, kept.data() + int64_t{y} * size.width);
    }
    picture.ignored = std::move(kept);
  }
  picture.image = Crop(picture.image, {0, 0, size.width, size.height});
  return picture;
}

Result<FitTask> TaskOfFit(TrainingViews views, FitOptions options) {
  const bool points_tell = views.points.size() > 0;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const InitialPoints points,
                               InitialPointsOf(FitInit::kAuto, views, std::nullopt, options.seed));
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud initial, InitialCloud(points, views.scene_scale, StartOptions(options)));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const AddedShell shell,
                               AddFarShell(views, points, std::nullopt, points_tell, options, initial));
  return FitTask{std::move(views), std::move(initial), options};
}

}  // namespace

Result<std::vector<BenchmarkEntry>> ListCaptures(const fs::path& folder) {
  if (ReadCameras(folder).ok()) {
    return std::vector<BenchmarkEntry>{
        {.name = RealPath(folder).filename().string(), .folder = folder, .is_capture = true}};
  }
  std::vector<BenchmarkEntry> entries;
  std::error_code code;
  for (fs::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    const std::string name = it->path().filename().string();
    if (!IsFolder(it->path()) || name.starts_with(".")) continue;
    entries.push_back({.name = name, .folder = it->path(), .is_capture = !HasExampleLayout(it->path())});
  }
  if (entries.empty()) return Error{ErrorCode::kNotFound, Cat(folder.string(), ": no folders with captures")};
  std::ranges::sort(entries, {}, &BenchmarkEntry::name);
  return entries;
}

Result<BenchmarkObject> OpenCapture(const BenchmarkEntry& entry, const CaptureRecipe& recipe, uint64_t seed,
                                    const fs::path& fit_folder) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(TrainingViews views,
                               OpenProject(entry.folder, {.hold_out = recipe.hold_out, .downscale = recipe.downscale}));
  BenchmarkObject object;
  object.name = entry.name;
  object.background = views.background.value_or(object.background);
  object.low_project = entry.folder;
  object.hold_out = recipe.hold_out;
  object.downscale = recipe.downscale;
  object.camera_rule = CameraPixelRule::kAuto;

  // A fit sees its world from an origin on, an evaluation as it is.
  WorldOrigin back = views.origin;
  for (double& x : back) x = -x;
  std::vector<std::pair<Camera, bool>> all;  // and whether it is held out
  for (const Camera& camera : views.train) all.emplace_back(FromOrigin(camera, back), false);
  for (const Camera& camera : views.held_out) all.emplace_back(FromOrigin(camera, back), true);
  std::ranges::stable_sort(all, {}, [](const auto& view) -> const std::string& { return view.first.name; });
  for (const auto& [camera, held_out] : all) {
    if (held_out) object.held_out.push_back(object.views.size());
    if (!held_out) object.low_cameras.cameras.push_back(camera);
    object.low_intrinsics.push_back(camera.intrinsics);
    object.views.push_back(AtFullSize(camera));
  }
  object.low_cameras.background = object.background;
  object.picture = [cameras = object.views](size_t view) { return FullPicture(cameras.at(view)); };

  FitOptions options = FitOptionsFor(recipe.steps);
  options.seed = seed;
  options.objective.render.background = object.background;
  const std::string key = Cat(ToJsonText(options), " a ", recipe.downscale, "th, views ",
                              CamerasState(object.low_cameras.cameras), ", ", views.points.size(), " points");
  ANCHORSPLAT_ASSIGN_OR_RETURN(KeptFit fit, FitAndKeep(fit_folder, key, [&] {
                                 LogInfo(Cat(object.name, ": fitting ", WithThousands(recipe.steps), " steps to ",
                                             views.train.size(), " views at 1/", recipe.downscale, " of their size"));
                                 return TaskOfFit(std::move(views), options);
                               }));
  object.low = std::move(fit.cloud);
  object.splat = KeptSplat(fit_folder);
  return object;
}

}  // namespace anchorsplat
