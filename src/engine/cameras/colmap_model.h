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

// A COLMAP camera model. Parameters: one or two focal lengths, the principal point, then distortion.
struct ColmapCameraModel {
  int id;  // in cameras.bin
  const char* name;
  size_t focals;
  size_t params;
  LensModel lens;
  bool supports_distortion;  // whether distortion is supported; else it must be zero and the model not a fisheye
};
const ColmapCameraModel* FindColmapCameraModel(int id);  // nullptr: unknown
const ColmapCameraModel* FindColmapCameraModel(const std::string& name);

// By COLMAP camera id.
using ColmapCameras = std::map<uint32_t, LensedPinhole>;

// A registered image, as in the file.
struct ColmapImage {
  std::string name;                  // relative to the project's image folder
  std::array<double, 4> quaternion;  // world-to-camera, wxyz
  std::array<double, 3> translation;
  uint32_t camera = 0;
};

// Messages of these two omit file and position, which the callers add. Errors: kBadFile.
Result<LensedPinhole> CameraFromColmap(const ColmapCameraModel& model, uint64_t width, uint64_t height,
                                       std::span<const double> params);
// Camera::image is the name in the file.
Result<Camera> ViewFromColmap(const ColmapImage& image, const ColmapCameras& cameras);

// Whether the folder holds cameras.bin and images.bin, or the two as .txt.
bool IsColmapModel(const std::filesystem::path& folder);

// Finds the sparse models of a project, most images first (ties keep the order below). Candidates are models in
// `sparse` and `sparse` itself, the folder itself and models in it. Without any of these: those below `colmap`,
// `sparse_txt`, `dense` and `distorted`; otherwise these come last, and only those with a different number of images.
struct FoundModel {
  std::filesystem::path folder;
  size_t pictures = 0;  // registered images, from the file's count
};
std::vector<FoundModel> FindColmapModels(const std::filesystem::path& project);

// Reads a sparse model, binary if both forms exist, as COLMAP does. Images are searched in `images` beside the model
// and up to two folders above (PROJECT/sparse/0 → PROJECT/images), then below the project (cameras/picture_search.h).
// Masks are in `masks` beside `images`, named like the image with .png appended (as in COLMAP) or instead of its
// extension. Order as in the file. A missing image leaves the path tried in `image`. Errors: kNotFound, kIo; kBadFile
// with byte or line.
Result<CameraSet> ReadColmapModel(const std::filesystem::path& folder);

// A point of a sparse model. Tracks and feature points are neither read nor written: known poses have none.
struct ColmapPoint {
  std::array<double, 3> position = {0, 0, 0};  // world, finite
  std::array<uint8_t, 3> color = {0, 0, 0};
};

// Reads points3D.bin of a sparse model, else points3D.txt. An empty file is valid, as models may have no points; if
// both are missing: kNotFound. Other errors as above; kBadFile: a position that is not finite.
Result<std::vector<ColmapPoint>> ReadColmapPoints(const std::filesystem::path& folder);

// Parts of ReadColmapModel and ReadColmapPoints, one per file.
Result<ColmapCameras> ReadColmapCamerasText(const std::filesystem::path& path);
Result<std::vector<Camera>> ReadColmapImagesText(const std::filesystem::path& path, const ColmapCameras& cameras);
Result<ColmapCameras> ReadColmapCamerasBinary(const std::filesystem::path& path);
Result<std::vector<Camera>> ReadColmapImagesBinary(const std::filesystem::path& path, const ColmapCameras& cameras);
Result<size_t> CountColmapImagesText(const std::filesystem::path& path);
Result<size_t> CountColmapImagesBinary(const std::filesystem::path& path);
Result<std::vector<ColmapPoint>> ReadColmapPointsText(const std::filesystem::path& path);
Result<std::vector<ColmapPoint>> ReadColmapPointsBinary(const std::filesystem::path& path);

}  // namespace anchorsplat
