#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/result.h"

namespace anchorsplat {

// Checks that all camera readers share. Their messages are the end of a sentence: the reader puts file and place
// before.

// Sizes at least 1 and no more pixels than a picture may have, focal lengths positive and finite, principal point
// finite. kBadFile.
Status CheckIntrinsics(const Pinhole& intrinsics);

// From camera-to-world in OpenCV axes. kBadFile when it is not a rotation or something is not finite.
Result<Pose> PoseFromCameraToWorld(const std::array<double, 9>& rotation, const std::array<double, 3>& center);

// From world-to-camera. kBadFile as above; the quaternion (wxyz) is normalised, and has a norm near 1.
Result<Pose> PoseFromQuaternion(const std::array<double, 4>& quaternion, const std::array<double, 3>& translation);

// One message for a file whose quaternions are not of norm 1, as they should be: they are taken as if they were.
class QuaternionNorms {
 public:
  void Add(const std::array<double, 4>& quaternion);
  void Tell(const std::filesystem::path& file) const;

 private:
  size_t others_ = 0;
  double farthest_ = 1;
};

// "./train/r_0.png" → "train/r_0": the camera's name. Only extensions of pictures go, as "r_0.5" has none; '\\' is '/'.
std::string ViewName(const std::string& image_path);

// The first of `folder/relative` that is a file, where .png, .jpg and .jpeg are tried when there is none as such; empty
// if there is none at all. For what this program has written; other programs' paths are for FindPictures.
std::filesystem::path FindPicture(std::span<const std::filesystem::path> folders, const std::string& relative);

// Where a file in `folder` that names its pictures alone has them: `images` in it, itself, `images` beside it.
std::vector<std::filesystem::path> FoldersOfPictures(const std::filesystem::path& folder);

// The mask of a picture: `masks` beside the folder that pictures are looked for in, or within it, holds NAME.EXT.png as
// COLMAP has it, or NAME.png; empty if there is none.
std::filesystem::path FindMask(std::span<const std::filesystem::path> folders, const std::string& relative);

}  // namespace anchorsplat
