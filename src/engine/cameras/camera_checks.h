#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/result.h"

namespace anchorsplat {

// Checks shared by all camera readers. Messages are the end of a sentence; the reader prepends file and position.
//
// Requires a size of at least 1 and within the limits of core/image.h, positive finite focal lengths, and a finite
// principal point. Error: kBadFile.

// Sizes at least 1 and no more pixels than a picture may have, focal lengths positive and finite, principal point
// finite. kBadFile.
Status CheckIntrinsics(const Pinhole& intrinsics);

// Pose from camera-to-world in OpenCV axes. kBadFile: not a rotation, or a value is not finite.
Result<Pose> PoseFromCameraToWorld(const std::array<double, 9>& rotation, const std::array<double, 3>& center);

// Pose from world-to-camera. The quaternion (wxyz), of norm near 1, is normalised. Errors as above.
Result<Pose> PoseFromQuaternion(const std::array<double, 4>& quaternion, const std::array<double, 3>& translation);

// Collects quaternions whose norm is not 1, which are normalised, for one message per file.
class QuaternionNorms {
 public:
  void Add(const std::array<double, 4>& quaternion);
  void Report(const std::filesystem::path& file) const;

 private:
  size_t off_norm_ = 0;
  double farthest_ = 1;
};

// Camera name of an image path: "./train/r_0.png" → "train/r_0". '\\' becomes '/', and only image extensions are
// removed ("r_0.5" has none).
std::string ViewName(const std::string& image_path);

// The first existing file `folder/relative`, also tried with .png, .jpg and .jpeg; empty if there is none. For paths
// that this program wrote; FindPictures handles other programs' paths.
std::filesystem::path FindPicture(std::span<const std::filesystem::path> folders, const std::string& relative);

// Folders to search if a camera file in `folder` gives bare image names: its `images`, itself, and `images` beside it.
std::vector<std::filesystem::path> FoldersOfPictures(const std::filesystem::path& folder);

// The mask of an image: NAME.EXT.png (as in COLMAP) or NAME.png in a folder `masks` beside or within one of `folders`;
// empty if there is none.
std::filesystem::path FindMask(std::span<const std::filesystem::path> folders, const std::string& relative);

}  // namespace anchorsplat
