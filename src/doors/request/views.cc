#include "request/views.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cameras/camera_axes.h"
#include "cameras/camera_io.h"
#include "compare/view_source.h"
#include "core/framing.h"
#include "core/log.h"
#include "core/splat_comments.h"
#include "core/statistics.h"
#include "core/text.h"
#include "core/world_up.h"
#include "formats/cloud_io.h"
#include "render/shown_range.h"
#include "request/choice.h"
#include "request/mode_option.h"
#include "request/parse.h"

namespace anchorsplat {

namespace {

constexpr int kOrbitSize = 1024;

// Up of an orbit: from the option, else the cameras, else the splat, else the usual axis.
Result<std::array<double, 3>> ChooseUp(const ViewFlags& flags, const CloudView& cloud, const CameraSet& cameras) {
  if (!flags.up.empty()) return ParseDirection("--up", flags.up);
  if (const auto up = WorldUp(cameras.cameras)) return *up;
  return UpOf({cloud.comments.begin(), cloud.comments.end()}).value_or(kUsualUp);
}

// `cameras` may be empty; an orbit takes up and background from them.
Result<CameraSet> OrbitViews(const ViewFlags& flags, const CloudView& cloud, const CameraSet& cameras) {
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
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto up, ChooseUp(flags, cloud, cameras));
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet orbit,
                               UprightOrbit(std::max(1, flags.orbit), radius, framing.target, up, intrinsics));
  orbit.background = cameras.background;
  return orbit;
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
      return Error{ErrorCode::kBadArgument, Cat("--size ", text, " has another aspect ratio than camera ", camera.name,
                                                " (", k.width, "x", k.height, "); keep its ratio of width to height")};
    }
    const double fy = k.fy * size.height / k.height, cy = k.cy * size.height / k.height;
    k = {size.width, size.height, k.fx * factor, fy, k.cx * factor, cy};
  }
  return {};
}

}  // namespace

void ViewFlags::AddTo(CLI::App& verb) {
  auto* cameras_option =
      verb.add_option("--cameras", cameras,
                      "transforms.json, cameras.json, a COLMAP folder, or cameras of Metashape, OpenSfM or Bundler")
          ->type_name("PATH")
          ->check(NotEmpty());
  auto* orbit_option =
      verb.add_option(
              "--orbit", orbit,
              "N views on a sphere around the splat; --cameras then only give the up direction and the background")
          ->check(CLI::Range(1, 100000));
  auto* radius_option =
      verb.add_option("--radius", radius, "Orbit: distance in world units (default: the splat fills the picture)")
          ->check(Positive());
  auto* target_option =
      verb.add_option("--target", target, "Orbit: point to look at, X,Y,Z (default: the centre of the splat)")
          ->type_name("X,Y,Z");
  auto* fov_option = verb.add_option("--fov", fov, "Orbit: horizontal field of view, degrees")
                         ->check(CLI::Range(1.0, 170.0))
                         ->capture_default_str();
  auto* up_option = verb.add_option("--up", up,
                                    "Orbit: up direction, X,Y,Z or an axis as in --up=-z (default: from the cameras "
                                    "or the splat's comment, else -y)")
                        ->type_name("DIRECTION")
                        ->check(NotEmpty());
  verb.parse_complete_callback([=] {
    if (!*cameras_option || *orbit_option) return;
    for (const CLI::Option* option : {radius_option, target_option, fov_option, up_option}) {
      if (*option) throw CLI::ExcludesError(option->get_name(), cameras_option->get_name());
    }
  });
  verb.add_option("--view", view, "Only the view with this name")->type_name("NAME");
  verb.add_option("--size", size, "WxH in pixels (default: as the cameras; orbit: 1024x1024)")->type_name("WxH");
  verb.add_option("--background", background, "R,G,B from 0 to 1 (default: from the camera file, else black)")
      ->type_name("R,G,B");
  verb.add_option("--near", near_plane,
                  "Near plane, world units (default: 0.01, or 1/1000 of the distance to the splat if that is less)");
  verb.add_option("--far", far_plane, "Far plane, world units (default: none)");
  AddModeOption(verb, mode, "Rasterization (default: the file's tag, else classic)");
  verb.add_option("--profile", profile, "Cut-off of a Gaussian: 3 sigma as in gsplat 1.0-1.4, or by opacity as in 1.5")
      ->check(OneOf({"gsplat14", "gsplat15"}))
      ->capture_default_str();
}

void WarnOfUnusable(const std::string& path, const GaussianCloud& cloud) {
  const int64_t unusable = CountUnusable(cloud);
  if (unusable == 0) return;
  LogWarning(Cat(path, ": ", WithThousands(unusable), " of ", WithThousands(cloud.size()),
                 " Gaussians are not drawn: ", kWhyUnusable));
}

Result<GaussianCloud> ReadToShow(const std::string& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud cloud, ReadCloud(path));
  WarnOfUnusable(path, cloud);
  return cloud;
}

Result<CameraSet> MakeViews(const ViewFlags& flags, const CloudView& cloud, const CameraSet* given) {
  CameraSet cameras;
  if (given != nullptr) {
    cameras = *given;
  } else if (!flags.cameras.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(cameras, ReadCameras(flags.cameras));
  }
  if (flags.orbit == 0 && cloud.size() > 0) {
    const std::string wrong = WrongAxes(cameras, cloud.means);
    if (!wrong.empty()) LogWarning(Cat(flags.cameras.empty() ? "" : flags.cameras + ": ", wrong));
  }
  if (flags.cameras.empty() || flags.orbit > 0) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(cameras, OrbitViews(flags, cloud, cameras));
    return KeepView(std::move(cameras), flags.view);
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(cameras, KeepView(std::move(cameras), flags.view));
  if (!flags.size.empty()) {
    ANCHORSPLAT_RETURN_IF_ERROR(Resize(cameras, flags.size));
  }
  return cameras;
}

Result<RenderOptions> MakeRenderOptions(const ViewFlags& flags, const CloudView& cloud, const CameraSet& cameras) {
  RenderOptions options = DisplayOptions(cloud);
  const auto beyond = [](const std::optional<double>& plane) { return plane && !(*plane > 0 && *plane <= kNoFar); };
  if (beyond(flags.near_plane) || beyond(flags.far_plane)) {
    return Error{ErrorCode::kBadArgument, "--near and --far must be above 0 (world units)"};
  }
  if (flags.near_plane) {
    options.near_plane = static_cast<float>(*flags.near_plane);
    options.subject.reset();  // the option overrides it
  }
  if (flags.far_plane) options.far_plane = static_cast<float>(*flags.far_plane);
  if (flags.near_plane && !(options.far_plane > options.near_plane)) {
    return Error{ErrorCode::kBadArgument,
                 Cat("--near ", options.near_plane, " must be less than --far ", options.far_plane)};
  }
  options.mode = flags.mode.value_or(options.mode);
  options.profile = flags.profile == "gsplat15" ? RasterProfile::kGsplat15 : RasterProfile::kGsplat14;
  options.background = cameras.background.value_or(options.background);
  if (!flags.background.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(options.background, ParseColor("--background", flags.background));
  }
  return options;
}

Image WithAlpha(const RenderOutput& render) {
  Image out(render.color.width, render.color.height, 4);
  for (int c = 0; c < 3; ++c) {
    for (int64_t i = 0; i < out.plane(); ++i) {
      const float alpha = render.alpha.pixels[static_cast<size_t>(i)];
      out.channel(c)[i] = alpha > 0 ? render.color.channel(c)[i] / alpha : 0;
    }
  }
  std::copy_n(render.alpha.pixels.data(), out.plane(), out.channel(3));
  return out;
}

}  // namespace anchorsplat
