#include "cameras/transforms_json.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "cameras/camera_checks.h"
#include "core/text.h"
#include "images/image_io.h"

namespace anchorsplat {

namespace {

// A frame's own value, else the file's.
std::optional<JsonValue> FindEither(const JsonValue& frame, const JsonValue& root, const char* key) {
  auto found = frame.Find(key);
  return found ? found : root.Find(key);
}

// Focal length in pixels along one axis of `size` pixels, given directly or as a field of view. A frame's field of view
// wins over the file's focal length: the nearer statement is the more specific one.
Result<std::optional<double>> FindFocal(const JsonValue& frame, const JsonValue& root, const char* focal_key,
                                        const char* angle_key, int size) {
  for (const JsonValue* level : {&frame, &root}) {
    if (const auto focal = level->Find(focal_key)) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const double value, focal->Number());
      return std::optional(value);
    }
    if (const auto angle = level->Find(angle_key)) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const double value, angle->Number());
      if (!(value > 0 && value < std::numbers::pi)) {
        return angle->Complain(Cat("field of view ", value, ", expected radians between 0 and pi"));
      }
      return std::optional(0.5 * size / std::tan(0.5 * value));
    }
  }
  return std::optional<double>();
}

// Only straight lenses: a renderer that ignored the distortion would compare every pixel with its neighbour.
Status RefuseDistortion(const JsonValue& frame, const JsonValue& root) {
  std::string model = "OPENCV";
  if (const auto value = FindEither(frame, root, "camera_model")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(model, value->Text());
    bool straight = false;
    for (const char* known : {"PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "FULL_OPENCV"}) {
      straight = straight || model == known;
    }
    if (!straight) return value->Complain(Cat("camera model ", Printable(model), " is not a pinhole camera"));
  }
  if (const auto value = FindEither(frame, root, "is_fisheye"); value && value->raw() == true) {
    return value->Complain("a fisheye lens is not a pinhole camera");
  }
  const auto refuse = [&model](const JsonValue& value, double number) {
    return value.Complain(Cat("lens distortion ", number, " (camera model ", model,
                              ") is not supported; undistort the images first, e.g. colmap image_undistorter"));
  };
  // nerfstudio's list of all of them.
  if (const auto list = FindEither(frame, root, "distortion_params"); list && !list->raw().is_null()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> numbers, list->Elements());
    for (const JsonValue& value : numbers) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const double number, value.Number());
      if (number != 0) return refuse(value, number);
    }
  }
  for (const char* key : {"k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"}) {
    const auto value = FindEither(frame, root, key);
    if (!value) continue;
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double number, value->Number());
    if (number != 0) return refuse(*value, number);
  }
  return {};
}

Result<Pinhole> ReadIntrinsics(const JsonValue& frame, const JsonValue& root, const std::filesystem::path& picture) {
  Pinhole c;
  const auto width = FindEither(frame, root, "w"), height = FindEither(frame, root, "h");
  if (width && height) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(c.width, width->WholeNumber(1, kMaxImageSide));
    ANCHORSPLAT_ASSIGN_OR_RETURN(c.height, height->WholeNumber(1, kMaxImageSide));
  } else {
    if (picture.empty()) return frame.Complain("neither \"w\" and \"h\" nor a picture to take the size from");
    ANCHORSPLAT_ASSIGN_OR_RETURN(const ImageSize size, ReadImageSize(picture));
    c.width = size.width;
    c.height = size.height;
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto fx, FindFocal(frame, root, "fl_x", "camera_angle_x", c.width));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto fy, FindFocal(frame, root, "fl_y", "camera_angle_y", c.height));
  if (!fx && !fy) return frame.Complain("no focal length: expected \"fl_x\" or \"camera_angle_x\"");
  c.fx = fx ? *fx : *fy;
  c.fy = fy ? *fy : *fx;
  c.cx = 0.5 * c.width;
  c.cy = 0.5 * c.height;
  if (const auto cx = FindEither(frame, root, "cx")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(c.cx, cx->Number());
  }
  if (const auto cy = FindEither(frame, root, "cy")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(c.cy, cy->Number());
  }
  if (const Status status = CheckIntrinsics(c); !status.ok()) return frame.Complain(status.error().message);
  return c;
}

Result<Pose> ReadPose(const JsonValue& matrix) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> rows, matrix.Elements());
  if (rows.size() != 4 && rows.size() != 3) {
    return matrix.Complain(Cat("expected 4 rows of 4 numbers, found ", rows.size(), " rows"));
  }
  std::array<double, 16> m = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
  for (size_t r = 0; r < rows.size(); ++r) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> row, rows[r].Numbers(4));
    std::copy(row.begin(), row.end(), m.begin() + static_cast<ptrdiff_t>(4 * r));
  }
  if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1) return matrix.Complain("last row is not 0 0 0 1");
  auto pose = PoseFromOpenGlCameraToWorld(m);
  if (!pose.ok()) return matrix.Complain(pose.error().message);
  return pose;
}

Result<Camera> ReadFrame(const JsonValue& frame, const JsonValue& root, const std::filesystem::path& folder) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue file_path, frame.Get("file_path"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string path, file_path.Text());
  if (ViewName(path).empty() || path.find('\0') != std::string::npos) {
    return file_path.Complain("expected the path of a picture");
  }
  Camera camera;
  camera.name = ViewName(path);
  camera.image = FindPicture({&folder, 1}, path);
  ANCHORSPLAT_RETURN_IF_ERROR(RefuseDistortion(frame, root));
  ANCHORSPLAT_ASSIGN_OR_RETURN(camera.intrinsics, ReadIntrinsics(frame, root, camera.image));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue matrix, frame.Get("transform_matrix"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(camera.world_to_camera, ReadPose(matrix));
  return camera;
}

}  // namespace

Result<CameraSet> CamerasFromTransforms(const JsonValue& root, const std::filesystem::path& folder) {
  CameraSet set;
  set.source = CameraSource::kTransforms;
  if (const auto background = root.Find("background")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> rgb, background->Numbers(3));
    for (const double x : rgb) {
      if (!(x >= 0 && x <= 1)) return background->Complain(Cat("expected three numbers from 0 to 1, found ", x));
    }
    set.background = {static_cast<float>(rgb[0]), static_cast<float>(rgb[1]), static_cast<float>(rgb[2])};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue frames, root.Get("frames"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> elements, frames.Elements());
  if (elements.empty()) return frames.Complain("expected at least one frame");
  for (const JsonValue& frame : elements) {
    auto camera = ReadFrame(frame, root, folder);
    if (!camera.ok()) return frame.Named(camera.error(), "file_path");
    set.cameras.push_back(*std::move(camera));
  }
  return set;
}

}  // namespace anchorsplat
