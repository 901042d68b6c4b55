#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "cameras/lensed_pinhole.h"
#include "core/camera.h"
#include "core/result.h"

namespace anchorsplat {

// One of COLMAP's camera models. Its parameters are the focal length (one or two), the principal point, then
// distortion.
struct ColmapCameraModel {
  int id;  // in cameras.bin
  const char* name;
  size_t focals;
  size_t params;
  LensModel lens;
  bool undone;  // whether its distortion is known here; else it must be zero, and the lens no fisheye
};
const ColmapCameraModel* FindColmapCameraModel(int id);  // nullptr: unknown
const ColmapCameraModel* FindColmapCameraModel(const std::string& name);

// By their COLMAP id.
using ColmapCameras = std::map<uint32_t, LensedPinhole>;

// A registered image as its file gives it.
struct ColmapImage {
  std::string name;                  // path below the project's image folder
  std::array<double, 4> quaternion;  // world-to-camera, wxyz
  std::array<double, 3> translation;
  uint32_t camera = 0;
};

// The two below give sentences without file and place, which their callers know. Errors: kBadFile.
Result<LensedPinhole> CameraFromColmap(const ColmapCameraModel& model, uint64_t width, uint64_t height,
                                       std::span<const double> params);
// `image` of the view is the name as the file has it.
Result<Camera> ViewFromColmap(const ColmapImage& image, const ColmapCameras& cameras);

// Whether the folder holds cameras.bin and images.bin, or the two as .txt.
bool IsColmapModel(const std::filesystem::path& folder);

// The sparse models of a project, the one with most pictures first, of equals the first of: those in `sparse` and
// `sparse` itself; the folder itself and those in it. Where there are none of these, those below `colmap`,
// `sparse_txt`, `dense` and `distorted`; else of these the ones with another number of pictures, behind all others.
struct FoundModel {
  std::filesystem::path folder;
  size_t pictures = 0;  // registered ones, by what the file says of itself
};
std::vector<FoundModel> FindColmapModels(const std::filesystem::path& project);

// A sparse model: binary where both kinds are there, as COLMAP itself prefers it. Pictures are looked for in `images`
// beside the model and up to two folders above it (PROJECT/sparse/0 → PROJECT/images), then below the project
// (cameras/picture_search.h); masks in `masks` beside `images`: a picture's name with .png behind it, as COLMAP has it,
// or in place of its extension. Order as in the file. Where a picture is missing, `image` is where it was looked for.
// Errors: kNotFound, kIo; kBadFile with byte or line.
Result<CameraSet> ReadColmapModel(const std::filesystem::path& folder);

// A point of a sparse model. Tracks and feature points are neither read nor written: known poses have none.
struct ColmapPoint {
  std::array<double, 3> position = {0, 0, 0};  // world, finite
  std::array<uint8_t, 3> color = {0, 0, 0};
};

// points3D.bin of a sparse model's folder, else its points3D.txt. A model may have no points: both missing is
// kNotFound, an empty file is not an error. Errors otherwise as above; a position that is not finite is kBadFile.
Result<std::vector<ColmapPoint>> ReadColmapPoints(const std::filesystem::path& folder);

// Parts of ReadColmapModel and ReadColmapPoints, a file per kind.
Result<ColmapCameras> ReadColmapCamerasText(const std::filesystem::path& path);
Result<std::vector<Camera>> ReadColmapImagesText(const std::filesystem::path& path, const ColmapCameras& cameras);
Result<ColmapCameras> ReadColmapCamerasBinary(const std::filesystem::path& path);
Result<std::vector<Camera>> ReadColmapImagesBinary(const std::filesystem::path& path, const ColmapCameras& cameras);
Result<size_t> CountColmapImagesText(const std::filesystem::path& path);
Result<size_t> CountColmapImagesBinary(const std::filesystem::path& path);
Result<std::vector<ColmapPoint>> ReadColmapPointsText(const std::filesystem::path& path);
Result<std::vector<ColmapPoint>> ReadColmapPointsBinary(const std::filesystem::path& path);

}  // namespace anchorsplat
