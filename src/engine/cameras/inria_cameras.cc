#include "cameras/inria_cameras.h"

#include <algorithm>
#include <string>
#include <vector>

#include "cameras/camera_checks.h"
#include "cameras/picture_search.h"
#include "images/image_io.h"

namespace anchorsplat {

namespace {

// Camera::image is the name in the file.
Result<Camera> ReadCamera(const JsonValue& entry) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue img_name, entry.Get("img_name"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string name, img_name.Text());
  Camera camera;
  camera.name = ViewName(name);
  if (camera.name.empty() || name.find('\0') != std::string::npos) return img_name.Complain("expected an image's name");
  camera.image = name;

  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue width, entry.Get("width"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue height, entry.Get("height"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue fx, entry.Get("fx"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue fy, entry.Get("fy"));
  Pinhole& c = camera.intrinsics;
  ANCHORSPLAT_ASSIGN_OR_RETURN(c.width, width.WholeNumber(1, kMaxImageSide));
  ANCHORSPLAT_ASSIGN_OR_RETURN(c.height, height.WholeNumber(1, kMaxImageSide));
  ANCHORSPLAT_ASSIGN_OR_RETURN(c.fx, fx.Number());
  ANCHORSPLAT_ASSIGN_OR_RETURN(c.fy, fy.Number());
  c.cx = 0.5 * c.width;
  c.cy = 0.5 * c.height;
  if (const Status status = CheckIntrinsics(c); !status.ok()) return entry.Complain(status.error().message);

  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue position, entry.Get("position"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> p, position.Numbers(3));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue rotation, entry.Get("rotation"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> rows, rotation.Elements());
  if (rows.size() != 3) return rotation.Complain("expected 3 rows of 3 numbers");
  std::array<double, 9> r{};
  for (size_t i = 0; i < 3; ++i) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> row, rows[i].Numbers(3));
    std::copy(row.begin(), row.end(), r.begin() + static_cast<ptrdiff_t>(3 * i));
  }
  auto pose = PoseFromCameraToWorld(r, {p[0], p[1], p[2]});
  if (!pose.ok()) return rotation.Complain(pose.error().message);
  camera.world_to_camera = *std::move(pose);
  return camera;
}

}  // namespace

Result<CameraSet> CamerasFromInria(const JsonValue& root, const std::filesystem::path& folder) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> entries, root.Elements());
  if (entries.empty()) return root.Complain("expected at least one camera");
  CameraSet set;
  set.source = CameraSource::kInria;
  for (const JsonValue& entry : entries) {
    auto camera = ReadCamera(entry);
    if (!camera.ok()) return entry.Named(camera.error(), "img_name");
    set.cameras.push_back(*std::move(camera));
  }
  FindPicturesOf({.folders = {folder, folder / "images"}, .project = folder, .complete = true}, set.cameras);
  return set;
}

}  // namespace anchorsplat
