#include "cli/views.h"

#include <cmath>
#include <numbers>

#include "cli/choice.h"
#include "cli/parse.h"
#include "core/framing.h"
#include "core/text.h"
#include "eval/view_source.h"
#include "formats/camera_io.h"

namespace anchorsplat {

namespace {

constexpr int kOrbitSize = 1024;

Result<CameraSet> OrbitViews(const ViewFlags& flags, const GaussianCloud& cloud) {
  SizeOption size{kOrbitSize, kOrbitSize};
  if (!flags.size.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(size, ParseSize("--size", flags.size));
  }
  const Pinhole intrinsics = PinholeFromFov(size.width, size.height, flags.fov * std::numbers::pi / 180);
  Framing framing = FrameCloud(cloud);
  if (!flags.target.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(framing.target, ParsePoint("--target", flags.target));
  }
  const double radius = flags.radius > 0 ? flags.radius : FramingDistance(framing, intrinsics);
  return OrbitCameras(std::max(1, flags.orbit), radius, framing.target, intrinsics);
}

Result<CameraSet> KeepView(CameraSet cameras, const std::string& view) {
  if (view.empty()) return cameras;
  std::vector<std::string> names;
  for (const Camera& camera : cameras.cameras) names.push_back(camera.name);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t kept, FindView(names, view));
  cameras.cameras = {cameras.cameras[kept]};
  return cameras;
}

Status Resize(CameraSet& cameras, const std::string& text) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SizeOption size, ParseSize("--size", text));
  for (Camera& camera : cameras.cameras) {
    Pinhole& k = camera.intrinsics;
    const double factor = static_cast<double>(size.width) / k.width;
    if (std::abs(k.height * factor - size.height) >= 1) {
      return Error{ErrorCode::kBadArgument, Cat("--size ", text, " has another shape than camera ", camera.name, " (",
                                                k.width, "x", k.height, "): keep the ratio of width to height")};
    }
    const double fy = k.fy * size.height / k.height, cy = k.cy * size.height / k.height;
    k = {size.width, size.height, k.fx * factor, fy, k.cx * factor, cy};
  }
  return {};
}

}  // namespace

void ViewFlags::AddTo(CLI::App& verb) {
  auto* cameras_option =
      verb.add_option("--cameras", cameras, "transforms.json, cameras.json or a COLMAP folder with the views")
          ->check(NotEmpty());
  verb.add_option("--orbit", orbit, "Views on a sphere around the splat instead")
      ->check(CLI::Range(1, 100000))
      ->excludes(cameras_option);
  verb.add_option("--radius", radius, "Orbit: distance, world units (default: what frames the splat)")
      ->check(Positive())
      ->excludes(cameras_option);
  verb.add_option("--target", target, "Orbit: X,Y,Z to look at (default: the splat's middle)")
      ->excludes(cameras_option);
  verb.add_option("--fov", fov, "Orbit: horizontal field of view, degrees")
      ->check(CLI::Range(1.0, 170.0))
      ->capture_default_str()
      ->excludes(cameras_option);
  verb.add_option("--view", view, "Only the view of this name");
  verb.add_option("--size", size, "WxH in pixels (default: the cameras' own; 1024x1024 for an orbit)");
  verb.add_option("--background", background, "R,G,B from 0 to 1 (default: what the camera file says, else black)");
  verb.add_option("--mode", mode, "Rasterization (default: the file's tag, else classic)")
      ->check(CLI::IsMember({"classic", "antialiased"}));
  verb.add_option("--profile", profile, "Extent of a Gaussian: 3 sigma as gsplat 1.0-1.4, or opacity-aware as 1.5")
      ->check(CLI::IsMember({"gsplat14", "gsplat15"}))
      ->capture_default_str();
}

Result<CameraSet> MakeViews(const ViewFlags& flags, const GaussianCloud& cloud) {
  if (flags.cameras.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet cameras, OrbitViews(flags, cloud));
    return KeepView(std::move(cameras), flags.view);
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet cameras, ReadCameras(flags.cameras));
  if (!flags.size.empty()) {
    ANCHORSPLAT_RETURN_IF_ERROR(Resize(cameras, flags.size));
  }
  return KeepView(std::move(cameras), flags.view);
}

Result<RenderOptions> MakeRenderOptions(const ViewFlags& flags, const GaussianCloud& cloud, const CameraSet& cameras) {
  RenderOptions options;
  options.mode = cloud.render_mode.value_or(RenderMode::kClassic);
  if (!flags.mode.empty()) options.mode = flags.mode == "classic" ? RenderMode::kClassic : RenderMode::kAntialiased;
  options.profile = flags.profile == "gsplat15" ? RasterProfile::kGsplat15 : RasterProfile::kGsplat14;
  options.background = cameras.background.value_or(options.background);
  if (!flags.background.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(options.background, ParseColor("--background", flags.background));
  }
  return options;
}

}  // namespace anchorsplat
