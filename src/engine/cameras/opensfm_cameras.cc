#include "cameras/opensfm_cameras.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "cameras/camera_checks.h"
#include "cameras/lensed_pinhole.h"
#include "cameras/picture_search.h"
#include "core/finite.h"
#include "core/log.h"
#include "core/rotation.h"
#include "core/text.h"
#include "images/image_io.h"

namespace anchorsplat {

namespace {

// A coefficient; 0 if absent.
Result<double> Coefficient(const JsonValue& camera, const char* name) {
  const auto value = camera.Find(name);
  if (!value || value->raw().is_null()) return 0.0;
  return value->Number();
}

// OpenSfM's opensfm/io.py and geometry/camera_projections_functions.h: radial models are OpenCV's with fewer
// coefficients, "fisheye" is OpenCV's with two.
Result<LensedPinhole> ShotCamera(const JsonValue& camera) {
  std::string type = "perspective";
  if (const auto given = camera.Find("projection_type")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(type, given->Text());
  }
  const bool one_focal = type == "perspective" || type == "fisheye";
  Lens lens{.model = type.starts_with("fisheye") ? LensModel::kFisheye : LensModel::kRadial};
  size_t radial = 2;
  if (type == "simple_radial") {
    radial = 1;
  } else if (type == "brown") {
    radial = 3;
  } else if (type == "fisheye_opencv") {
    radial = 4;
  } else if (!one_focal && type != "radial") {
    return camera.Complain(
        Cat("projection_type ", Printable(type), " is not supported; undistort the images first (opensfm undistort)"));
  }
  constexpr std::array<const char*, 4> kRadial = {"k1", "k2", "k3", "k4"};
  for (size_t i = 0; i < radial; ++i) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(lens.radial[i], Coefficient(camera, kRadial[i]));
  }
  if (type == "brown") {
    ANCHORSPLAT_ASSIGN_OR_RETURN(lens.tangential[0], Coefficient(camera, "p1"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(lens.tangential[1], Coefficient(camera, "p2"));
  }
  Pinhole c;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue width, camera.Get("width"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue height, camera.Get("height"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(c.width, width.WholeNumber(1, kMaxImageSide));
  ANCHORSPLAT_ASSIGN_OR_RETURN(c.height, height.WholeNumber(1, kMaxImageSide));
  const double side = std::max(c.width, c.height);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue fx, camera.Get(one_focal ? "focal" : "focal_x"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue fy, camera.Get(one_focal ? "focal" : "focal_y"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(c.fx, fx.Number());
  ANCHORSPLAT_ASSIGN_OR_RETURN(c.fy, fy.Number());
  if (!one_focal) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(c.cx, Coefficient(camera, "c_x"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(c.cy, Coefficient(camera, "c_y"));
  }
  c = {c.width, c.height, side * c.fx, side * c.fy, 0.5 * c.width + side * c.cx, 0.5 * c.height + side * c.cy};
  auto through = ThroughLens(lens, c);
  if (!through.ok()) return camera.Complain(through.error().message);
  return through;
}

Result<Pose> ShotPose(const JsonValue& shot) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue rotation, shot.Get("rotation"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> r, rotation.Numbers(3));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue translation, shot.Get("translation"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> t, translation.Numbers(3));
  const double angle = std::hypot(r[0], r[1], r[2]);
  if (!std::isfinite(angle)) return rotation.Complain("is not finite");
  const double s = angle > 1e-9 ? std::sin(0.5 * angle) / angle : 0.5;
  return Pose{RotationFromQuaternion(std::cos(0.5 * angle), s * r[0], s * r[1], s * r[2]), {t[0], t[1], t[2]}};
}

size_t ShotsOf(const JsonValue& reconstruction) {
  const auto shots = reconstruction.Find("shots");
  return shots && shots->raw().is_object() ? shots->raw().size() : 0;
}

void SayOfOthers(const std::vector<JsonValue>& all, size_t taken) {
  std::string others;
  size_t left_out = 0;
  for (size_t i = 0; i < all.size(); ++i) {
    if (i == taken || ShotsOf(all[i]) == 0) continue;
    left_out += ShotsOf(all[i]);
    others += Cat(others.empty() ? "" : ", ", ShotsOf(all[i]), " of number ", i);
  }
  if (left_out == 0) return;
  LogWarning(all[taken]
                 .Complain(Cat("using the largest of ", all.size(), " reconstructions, with ", ShotsOf(all[taken]),
                               " shots; skipped ", left_out, " shots (", others,
                               "), whose position relative to it is unknown"))
                 .message);
}

// Location of the world's origin on Earth.
void SayOfReference(const JsonValue& reconstruction) {
  const auto reference = reconstruction.Find("reference_lla");
  if (!reference) return;
  const auto latitude = reference->Find("latitude"), longitude = reference->Find("longitude");
  if (!latitude || !longitude || !latitude->raw().is_number() || !longitude->raw().is_number()) return;
  LogInfo(reference
              ->Complain(Cat("world coordinates are metres east, north and up from latitude ",
                             latitude->raw().get<double>(), ", longitude ", longitude->raw().get<double>()))
              .message);
}

}  // namespace

bool IsOpenSfm(const JsonValue& root) {
  return root.raw().is_array() && !root.raw().empty() && root.Element(0).has("shots");
}

Result<CameraSet> CamerasFromOpenSfm(const JsonValue& root, const std::filesystem::path& folder) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> all, root.Elements());
  const auto largest = std::ranges::max_element(all, {}, ShotsOf);
  const JsonValue& taken = *largest;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue shots, taken.Get("shots"));
  if (ShotsOf(taken) == 0) return shots.Complain("expected an object with at least one shot");
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue cameras, taken.Get("cameras"));
  SayOfOthers(all, static_cast<size_t>(largest - all.begin()));
  SayOfReference(taken);
  std::map<std::string, LensedPinhole> known;
  CameraSet set;
  for (const auto& [name, unused] : shots.raw().items()) {
    if (ViewName(name).empty() || name.find('\0') != std::string::npos) {
      return shots.Complain("contains a shot without a picture name");
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue shot, shots.Get(name.c_str()));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue of, shot.Get("camera"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string camera_name, of.Text());
    if (!known.contains(camera_name)) {
      const auto camera =
          camera_name.find('\0') == std::string::npos ? cameras.Find(camera_name.c_str()) : std::nullopt;
      if (!camera) return of.Complain(Cat("camera \"", Printable(camera_name), "\" is not in the list of cameras"));
      ANCHORSPLAT_ASSIGN_OR_RETURN(known[camera_name], ShotCamera(*camera));
    }
    const LensedPinhole& lensed = known[camera_name];
    ANCHORSPLAT_ASSIGN_OR_RETURN(Pose pose, ShotPose(shot));
    set.cameras.push_back({ViewName(name), name, lensed.undistorted, std::move(pose), lensed.photograph});
  }
  FindPicturesOf({.folders = FoldersOfPictures(folder), .project = folder}, set.cameras);
  return set;
}

}  // namespace anchorsplat
