#include "eval/capture.h"

#include <utility>

#include "core/file_system.h"

namespace anchorsplat {

Result<std::vector<BenchmarkEntry>> ListCaptures(const std::filesystem::path& folder) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<CaptureFolder> captures, FindCaptures(folder));
  std::vector<BenchmarkEntry> entries;
  for (const CaptureFolder& capture : captures) {
    const bool has_splat = HasExampleLayout(capture.folder) && RealPath(capture.folder) != RealPath(folder);
    entries.push_back({.name = capture.name, .folder = capture.folder, .is_capture = !has_splat});
  }
  return entries;
}

Result<BenchmarkObject> OpenCapturedObject(const BenchmarkEntry& entry, const CaptureRecipe& recipe,
                                           const std::filesystem::path& fit_folder) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(Capture capture, OpenCapture(entry.name, entry.folder, recipe, fit_folder));
  BenchmarkObject object;
  object.name = entry.name;
  object.background = capture.background;
  object.low_project = entry.folder;
  object.hold_out = recipe.hold_out;
  object.downscale = recipe.downscale;
  object.camera_rule = CameraPixelRule::kAuto;
  object.low_cameras.cameras = capture.FittedViews();
  object.held_out = std::move(capture.held_out);
  object.low_cameras.background = object.background;
  for (const Camera& camera : capture.low_views) object.low_intrinsics.push_back(camera.intrinsics);
  object.picture = [cameras = capture.views](size_t view) { return FullPicture(cameras.at(view)); };
  object.views = std::move(capture.views);
  object.low = std::move(capture.cloud);
  object.splat = std::move(capture.splat);
  return object;
}

}  // namespace anchorsplat
