#include "cameras/camera_checks.h"

#include <algorithm>
#include <cmath>
#include <system_error>

#include "core/file_system.h"
#include "core/finite.h"
#include "core/log.h"
#include "core/rotation.h"
#include "core/text.h"
#include "images/image_io.h"
#include "images/picture_names.h"
#include "io/input_record.h"

namespace anchorsplat {

namespace {

Error Bad(std::string sentence) { return Error{ErrorCode::kBadFile, std::move(sentence)}; }

constexpr double kLeastNorm = 0.5;  // a norm farther from 1 is not a quaternion's

double NormOf(const std::array<double, 4>& q) {
  return std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
}

}  // namespace

Status CheckIntrinsics(const Pinhole& c) {
  if (c.width < 1 || c.height < 1) return Bad(Cat("size ", c.width, " x ", c.height, ", expected at least 1 x 1"));
  if (int64_t{c.width} * c.height > kMaxImagePixels) {
    return Bad(Cat("size ", c.width, " x ", c.height, ", more than ", WithThousands(kMaxImagePixels), " pixels"));
  }
  if (!(c.fx > 0) || !(c.fy > 0) || !std::isfinite(c.fx) || !std::isfinite(c.fy)) {
    return Bad(Cat("focal length ", c.fx, ", ", c.fy, ", expected positive numbers"));
  }
  if (!std::isfinite(c.cx) || !std::isfinite(c.cy)) {
    return Bad(Cat("principal point ", c.cx, ", ", c.cy, ", expected finite numbers"));
  }
  return {};
}

Result<Pose> PoseFromCameraToWorld(const std::array<double, 9>& r, const std::array<double, 3>& c) {
  auto pose = PoseFromOpenGlCameraToWorld(
      {r[0], -r[1], -r[2], c[0], r[3], -r[4], -r[5], c[1], r[6], -r[7], -r[8], c[2], 0, 0, 0, 1});
  if (!pose.ok()) return Bad(pose.error().message);
  return pose;
}

Result<Pose> PoseFromQuaternion(const std::array<double, 4>& q, const std::array<double, 3>& t) {
  const double norm = NormOf(q);
  if (!(norm > kLeastNorm && norm < 1 / kLeastNorm)) return Bad(Cat("quaternion has norm ", norm, ", expected 1"));
  if (!AllFinite(t)) return Bad("translation is not finite");
  return Pose{RotationFromQuaternion(q[0], q[1], q[2], q[3]), t};
}

void QuaternionNorms::Add(const std::array<double, 4>& quaternion) {
  constexpr double kTolerance = 1e-3;  // allows files with few digits
  const double norm = NormOf(quaternion);
  if (std::abs(norm - 1) <= kTolerance) return;
  ++off_norm_;
  if (std::abs(norm - 1) > std::abs(farthest_ - 1)) farthest_ = norm;
}

void QuaternionNorms::Report(const std::filesystem::path& file) const {
  if (off_norm_ == 0) return;
  LogWarning(Cat(file.string(), ": ", off_norm_, off_norm_ == 1 ? " quaternion is" : " quaternions are",
                 " not of norm 1 (worst: ", farthest_, "); normalised"));
}

std::string ViewName(const std::string& image_path) {
  std::string name = image_path.starts_with("./") ? image_path.substr(2) : image_path;
  std::ranges::replace(name, '\\', '/');
  if (!HasAnyPictureExtension(name)) return name;
  return name.substr(0, name.rfind('.'));
}

std::filesystem::path FindPicture(std::span<const std::filesystem::path> folders, const std::string& relative) {
  for (const auto& folder : folders) {
    for (const char* extension : {"", ".png", ".jpg", ".jpeg"}) {
      auto path = (folder / (relative + extension)).lexically_normal();
      if (!IsFile(path)) continue;
      RecordInput(path);  // images count as inputs, whoever opens them
      return path;
    }
  }
  return {};
}

std::vector<std::filesystem::path> FoldersOfPictures(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> folders;
  for (const char* images : {"images", ".", "../images"}) folders.push_back((folder / images).lexically_normal());
  return folders;
}

std::filesystem::path FindMask(std::span<const std::filesystem::path> folders, const std::string& relative) {
  for (const auto& folder : folders) {
    for (const auto& masks : {folder.parent_path() / "masks", folder / "masks"}) {
      if (!IsFolder(masks)) continue;
      for (const std::string& name : {relative + ".png", ViewName(relative) + ".png"}) {
        auto path = (masks / name).lexically_normal();
        if (!IsFile(path)) continue;
        RecordInput(path);
        return path;
      }
    }
  }
  return {};
}

}  // namespace anchorsplat
