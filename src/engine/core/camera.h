#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/lens.h"
#include "core/result.h"
#include "core/similarity.h"
#include "core/world_origin.h"

namespace anchorsplat {

// Pinhole intrinsics in pixels. Pixel (0,0) covers [0,1)²; its centre is at (0.5, 0.5).
struct Pinhole {
  int width = 0;
  int height = 0;
  double fx = 0;
  double fy = 0;
  double cx = 0;
  double cy = 0;

  friend bool operator==(const Pinhole&, const Pinhole&) = default;
};

// Rigid world-to-camera transform in OpenCV axes (x right, y down, z forward): p_camera = R·p_world + t.
struct Pose {
  std::array<double, 9> rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // row-major
  std::array<double, 3> translation = {0, 0, 0};
};

// How an image file becomes the picture of a view, beyond decoding: rotated by EXIF, undistorted, masked, downscaled
// (cameras/photograph.h).
struct Photograph {
  Lens lens;
  Pinhole intrinsics;          // of the image file, upright, before undistortion; width 0: the camera's own
  int orientation = 1;         // EXIF orientation, 1 to 8, applied first
  int downscale = 1;           // image pixels per side that are averaged into one view pixel
  std::filesystem::path mask;  // image whose black pixels are excluded from comparison; may be empty
};

struct Camera {
  std::string name;             // image path without extension, as in the camera file ("lr/001")
  std::filesystem::path image;  // the view's image file; empty if the camera file names none
  Pinhole intrinsics;           // of the view that is rendered and compared
  Pose world_to_camera;
  Photograph photograph;

  std::array<double, 3> Center() const;                                  // −Rᵀt, world
  std::array<double, 3> ToCamera(const std::array<double, 3>& p) const;  // R·p + t
};

// Format of the file that cameras were read from. Formats differ in whether the image size is the training size.
enum class CameraSource { kUnknown, kTransforms, kInria, kColmap, kLlff };

struct CameraSet {
  CameraSource source = CameraSource::kUnknown;
  std::vector<Camera> cameras;
  std::optional<std::array<float, 3>> background;  // rgb 0–1, if the camera file gives one
  std::filesystem::path points;                    // PLY of scene points, if the camera file names one
  // How the cameras were moved away from the world of their file and of `points`, if they were.
  std::optional<Similarity> moved;
};

// The camera in coordinates relative to `origin`, those of a splat's means (core/world_origin.h).
Pose RelativeToOrigin(const Pose& world_to_camera, const WorldOrigin& origin);
Camera RelativeToOrigin(Camera camera, const WorldOrigin& origin);
CameraSet RelativeToOrigin(CameraSet set, const WorldOrigin& origin);
// ChooseOrigin (core/world_origin.h) of the camera centres.
WorldOrigin ChooseOrigin(const std::vector<Camera>& cameras);

// The pose that sees a world transformed by `move` as `world_to_camera` sees the original, up to scale.
Pose Moved(const Pose& world_to_camera, const Similarity& move);

// Resizes the view by `factor`: width and height are rounded, at least 1; the rays through the image corners stay the
// same up to that rounding.
Pinhole Scaled(const Pinhole& intrinsics, double factor);

// Crops the view to `box`, which may reach beyond the picture.
Camera Crop(const Camera& camera, const PixelBox& box);

// Pose of a camera at `center` that faces `target`. `up` is the world's up direction; another axis replaces it if it is
// parallel to the view direction. kBadArgument: center and target coincide, or a value is not finite.
Result<Pose> LookAt(const std::array<double, 3>& center, const std::array<double, 3>& target,
                    const std::array<double, 3>& up);

// Pose from a row-major 4×4 camera-to-world matrix in OpenGL axes (x right, y up, z backward): NeRF's
// `transform_matrix`. kBadArgument: the upper 3×3 is not a rotation (tolerance 1e-3), or a value is not finite.
Result<Pose> PoseFromOpenGlCameraToWorld(const std::array<double, 16>& camera_to_world);
std::array<double, 16> OpenGlCameraToWorld(const Pose& pose);

// `count` cameras evenly spread on a Fibonacci sphere of `radius` around `target`, the same on every machine, named
// "000", "001", … with the same `intrinsics`. kBadArgument: count < 1 or radius not positive.
Result<CameraSet> OrbitCameras(int count, double radius, const std::array<double, 3>& target,
                               const Pinhole& intrinsics);

// Pinhole with square pixels, a centred principal point and a horizontal field of view of `fov_x` radians.
Pinhole PinholeFromFov(int width, int height, double fov_x);

}  // namespace anchorsplat
