#include "cameras/transforms_json.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "cameras/camera_checks.h"
#include "cameras/picture_search.h"
#include "cameras/undistortion.h"
#include "core/file_system.h"
#include "core/text.h"
#include "images/image_io.h"

namespace anchorsplat {

namespace {

// The frame's value, else the file's.
std::optional<JsonValue> FindEither(const JsonValue& frame, const JsonValue& root, const char* key) {
  auto found = frame.Find(key);
  return found ? found : root.Find(key);
}

// Focal length in pixels along an axis of `size` pixels, given directly or as a field of view. A frame's field of view
// takes precedence over the file's focal length, as it is more specific.
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

// The frame's number, else the file's, else 0.
Result<double> NumberOrZero(const JsonValue& frame, const JsonValue& root, const char* key) {
  const auto value = FindEither(frame, root, key);
  if (!value || value->raw().is_null()) return 0.0;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const double number, value->Number());
  if (!std::isfinite(number)) return value->Complain(Cat("lens distortion ", number, ", expected a finite number"));
  return number;
}

// The lens by `camera_model` (default OPENCV): nerfstudio's k1 … k4, p1, p2, or its list `distortion_params` of the
// same six, which takes precedence as in nerfstudio; and FULL_OPENCV's k5, k6, with which k4 … k6 are the denominator.
Result<Lens> ReadLens(const JsonValue& frame, const JsonValue& root) {
  Lens lens{.model = LensModel::kRadial};
  bool full = false;
  if (const auto value = FindEither(frame, root, "camera_model")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string model, value->Text());
    full = model == "FULL_OPENCV";
    bool known = full;
    for (const char* name : {"PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "PERSPECTIVE"}) {
      known = known || model == name;
    }
    if (model == "OPENCV_FISHEYE" || model == "FISHEYE" || model == "SIMPLE_RADIAL_FISHEYE" ||
        model == "RADIAL_FISHEYE") {
      lens.model = LensModel::kFisheye;
    } else if (!known) {
      return value->Complain(Cat("camera model ", Printable(model), " is not supported; undistort the images first"));
    }
  }
  if (const auto value = FindEither(frame, root, "is_fisheye"); value && value->raw() == true) {
    lens.model = LensModel::kFisheye;
  }
  std::array<double, 8> k{};  // k1 … k6, p1, p2
  constexpr std::array<const char*, 8> kNames = {"k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"};
  for (size_t i = 0; i < kNames.size(); ++i) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(k[i], NumberOrZero(frame, root, kNames[i]));
  }
  if (const auto list = FindEither(frame, root, "distortion_params"); list && !list->raw().is_null()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> values, list->Elements());
    if (values.size() > 6) return list->Complain(Cat("expected k1, k2, k3, k4, p1, p2, found ", values.size()));
    k = {};
    for (size_t i = 0; i < values.size(); ++i) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const double number, values[i].Number());
      if (!std::isfinite(number)) return values[i].Complain("lens distortion is not finite");
      k[i < 4 ? i : i + 2] = number;
    }
  }
  full = full || k[4] != 0 || k[5] != 0;
  lens.radial = {k[0], k[1], k[2], full ? 0 : k[3]};
  if (full) lens.denominator = {k[3], k[4], k[5]};
  lens.tangential = {k[6], k[7]};
  if (lens.model == LensModel::kFisheye) {
    if (full || k[6] != 0 || k[7] != 0) {
      return frame.Complain("has a fisheye lens with k5, k6, p1 or p2; only k1 to k4 are supported");
    }
  }
  return lens.IsIdentity() ? Lens{} : lens;
}

Result<Pinhole> ReadIntrinsics(const JsonValue& frame, const JsonValue& root, const FoundPicture& picture) {
  Pinhole c;
  const auto width = FindEither(frame, root, "w"), height = FindEither(frame, root, "h");
  if (width && height) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(c.width, width->WholeNumber(1, kMaxImageSide));
    ANCHORSPLAT_ASSIGN_OR_RETURN(c.height, height->WholeNumber(1, kMaxImageSide));
  } else {
    if (!IsFile(picture.file)) {
      if (!picture.ambiguity.empty()) return frame.Complain(picture.ambiguity);
      return frame.Complain(Cat("no image size: expected \"w\" and \"h\", or the picture (looked for at ",
                                Printable(picture.file.string()), ")"));
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const ImageSize size, ReadImageSize(picture.file));
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

// Whether the matrices are in OpenCV axes (x right, y down, z forward). Our extension, for users whose files are so.
Result<bool> IsInOpenCvAxes(const JsonValue& root) {
  const auto value = root.Find("camera_axes");
  if (!value || value->raw().is_null()) return false;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string axes, value->Text());
  if (axes != "opencv" && axes != "opengl") {
    return value->Complain(Cat("expected \"opengl\" or \"opencv\", found \"", Printable(axes), "\""));
  }
  return axes == "opencv";
}

Result<Pose> ReadPose(const JsonValue& matrix, bool opencv_axes) {
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
  if (opencv_axes) {
    for (const size_t k : {1, 2, 5, 6, 9, 10}) m[k] = -m[k];
  }
  auto pose = PoseFromOpenGlCameraToWorld(m);
  if (!pose.ok()) return matrix.Complain(pose.error().message);
  return pose;
}

// Path of an image or mask; empty if absent and optional.
Result<std::string> PathIn(const JsonValue& frame, const char* key, bool required) {
  const auto value = frame.Find(key);
  if (!required && (!value || value->raw().is_null())) return std::string();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue given, frame.Get(key));
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::string path, given.Text());
  if (ViewName(path).empty() || path.find('\0') != std::string::npos) {
    return given.Complain(required ? "expected the path of a picture" : "expected the path of a mask");
  }
  return path;
}

Result<std::vector<std::string>> PathsOf(std::span<const JsonValue> frames, const char* key, bool required) {
  std::vector<std::string> paths;
  for (const JsonValue& frame : frames) {
    auto path = PathIn(frame, key, required);
    if (!path.ok()) return frame.Named(path.error(), "file_path");
    paths.push_back(*std::move(path));
  }
  return paths;
}

// Images of the frames, and masks by `mask_path`, else from the folder `masks`.
Result<std::vector<FoundPicture>> FindPicturesOfFrames(std::span<const JsonValue> frames,
                                                       const std::filesystem::path& folder, bool complete) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<std::string> names, PathsOf(frames, "file_path", true));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<std::string> masks, PathsOf(frames, "mask_path", false));
  PicturePlaces places{.folders = {folder}, .project = folder, .complete = complete};
  std::vector<FoundPicture> found = FindPictures(places, names);
  if (std::ranges::all_of(masks, &std::string::empty)) return found;
  places.complete = false;
  places.masks = true;
  const std::vector<FoundPicture> found_masks = FindPictures(places, masks);
  for (size_t i = 0; i < frames.size(); ++i) {
    if (masks[i].empty()) continue;
    found[i].mask = IsFile(found_masks[i].file) ? found_masks[i].file : std::filesystem::path();
    // Without its mask, masked pixels would be taken as correct.
    if (found[i].ambiguity.empty()) found[i].ambiguity = found_masks[i].ambiguity;
    if (found[i].mask.empty() && found[i].ambiguity.empty() && IsFolder(folder)) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue value, frames[i].Get("mask_path"));
      return frames[i].Named(value.Complain(Cat("mask ", Printable(masks[i]), " not found in ", folder.string())),
                             "file_path");
    }
  }
  return found;
}

// Cached, as frames mostly share a lens and its undistorted pinhole is slow to find.
class UndistortedPinholes {
 public:
  Result<Pinhole> Of(const Lens& lens, const Pinhole& distorted, const JsonValue& frame) {
    if (last_ && last_->lens == lens && last_->distorted == distorted) return last_->undistorted;
    auto undistorted = UndistortedPinhole(lens, distorted);
    if (!undistorted.ok()) return frame.Complain(undistorted.error().message);
    last_ = {lens, distorted, *undistorted};
    return *undistorted;
  }

 private:
  struct Known {
    Lens lens;
    Pinhole distorted, undistorted;
  };
  std::optional<Known> last_;
};

Result<Camera> ReadFrame(const JsonValue& frame, const JsonValue& root, FoundPicture picture, bool opencv_axes,
                         UndistortedPinholes& undistorted) {
  Camera camera;
  ANCHORSPLAT_ASSIGN_OR_RETURN(camera.intrinsics, ReadIntrinsics(frame, root, picture));
  camera.name = std::move(picture.name);
  camera.image = std::move(picture.file);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Lens lens, ReadLens(frame, root));
  if (!lens.IsIdentity()) {
    camera.photograph.lens = lens;
    camera.photograph.intrinsics = camera.intrinsics;
    ANCHORSPLAT_ASSIGN_OR_RETURN(camera.intrinsics, undistorted.Of(lens, camera.intrinsics, frame));
  }
  camera.photograph.mask = std::move(picture.mask);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue matrix, frame.Get("transform_matrix"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(camera.world_to_camera, ReadPose(matrix, opencv_axes));
  return camera;
}

}  // namespace

Result<CameraSet> CamerasFromTransforms(const JsonValue& root, const std::filesystem::path& folder, bool complete) {
  CameraSet set;
  set.source = CameraSource::kTransforms;
  if (const auto background = root.Find("background")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> rgb, background->Numbers(3));
    for (const double x : rgb) {
      if (!(x >= 0 && x <= 1)) return background->Complain(Cat("expected three numbers from 0 to 1, found ", x));
    }
    set.background = {static_cast<float>(rgb[0]), static_cast<float>(rgb[1]), static_cast<float>(rgb[2])};
  }
  if (const auto points = root.Find("ply_file_path"); points && !points->raw().is_null()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string path, points->Text());
    if (path.find('\0') != std::string::npos) return points->Complain("expected the path of a PLY");
    if (!path.empty()) set.points = (folder / path).lexically_normal();
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue frames, root.Get("frames"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> elements, frames.Elements());
  if (elements.empty()) return frames.Complain("expected at least one frame");
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<FoundPicture> pictures, FindPicturesOfFrames(elements, folder, complete));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const bool opencv_axes, IsInOpenCvAxes(root));
  UndistortedPinholes undistorted;
  for (size_t i = 0; i < elements.size(); ++i) {
    auto camera = ReadFrame(elements[i], root, std::move(pictures[i]), opencv_axes, undistorted);
    if (!camera.ok()) return elements[i].Named(camera.error(), "file_path");
    set.cameras.push_back(*std::move(camera));
  }
  return set;
}

}  // namespace anchorsplat
