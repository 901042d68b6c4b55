#include "dataset/capture.h"

#include <algorithm>
#include <optional>
#include <system_error>
#include <utility>

#include "cameras/camera_io.h"
#include "cameras/photograph.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/text.h"
#include "dataset/file_state.h"
#include "dataset/kept_fit.h"
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

Result<std::vector<CaptureFolder>> FindCaptures(const fs::path& folder) {
  if (ReadCameras(folder).ok()) return std::vector<CaptureFolder>{{RealPath(folder).filename().string(), folder}};
  std::vector<CaptureFolder> captures;
  std::error_code code;
  for (fs::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    const std::string name = it->path().filename().string();
    if (IsFolder(it->path()) && !name.starts_with(".")) captures.push_back({name, it->path()});
  }
  if (captures.empty()) return Error{ErrorCode::kNotFound, Cat(folder.string(), ": no folders with captures")};
  std::ranges::sort(captures, {}, &CaptureFolder::name);
  return captures;
}

std::vector<Camera> Capture::FittedViews() const {
  std::vector<Camera> fitted;
  for (size_t i = 0; i < low_views.size(); ++i) {
    if (!std::ranges::binary_search(held_out, i)) fitted.push_back(low_views[i]);
  }
  return fitted;
}

Result<ViewPicture> FullPicture(const Camera& view) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(ViewPicture picture, ReadPhotograph(view));
  const Pinhole& size = view.intrinsics;
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

Result<Capture> OpenCapture(const std::string& name, const fs::path& project, const CaptureRecipe& recipe,
                            const fs::path& fit_folder) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(TrainingViews views,
                               OpenProject(project, {.hold_out = recipe.hold_out, .downscale = recipe.downscale}));
  Capture capture;
  capture.name = name;
  capture.background = views.background.value_or(capture.background);
  // A fit sees its world from an origin on, everybody else as it is.
  WorldOrigin back = views.origin;
  for (double& x : back) x = -x;
  std::vector<std::pair<Camera, bool>> all;  // and whether it is held out
  for (const Camera& camera : views.train) all.emplace_back(RelativeToOrigin(camera, back), false);
  for (const Camera& camera : views.held_out) all.emplace_back(RelativeToOrigin(camera, back), true);
  std::ranges::stable_sort(all, {}, [](const auto& view) -> const std::string& { return view.first.name; });
  for (const auto& [camera, held_out] : all) {
    if (held_out) capture.held_out.push_back(capture.views.size());
    capture.views.push_back(AtFullSize(camera));
    capture.low_views.push_back(camera);
  }

  FitOptions options = FitOptionsFor(recipe.steps);
  options.seed = recipe.seed;
  options.objective.render.background = capture.background;
  const std::string key = Cat(ToJsonText(options), " a ", recipe.downscale, "th, views ",
                              CamerasState(capture.FittedViews()), ", ", views.points.size(), " points");
  ANCHORSPLAT_ASSIGN_OR_RETURN(KeptFit fit, FitAndKeep(fit_folder, key, [&] {
                                 LogInfo(Cat(name, ": fitting ", WithThousands(recipe.steps), " steps to ",
                                             views.train.size(), " views at 1/", recipe.downscale, " of their size"));
                                 return TaskOfFit(std::move(views), options);
                               }));
  capture.cloud = std::move(fit.cloud);
  capture.splat = KeptSplat(fit_folder);
  return capture;
}

}  // namespace anchorsplat
