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

// Pinhole intrinsics in pixels; pixel (0,0) covers [0,1)², its centre is at 0.5.
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

// How the file of a view's picture becomes that picture, where it is more than decoding: turned as EXIF says, through
// the lens, averaged, masked (cameras/photograph.h).
struct Photograph {
  Lens lens;
  Pinhole intrinsics;          // of the file's picture, upright, behind the lens; width 0: the camera's own
  int orientation = 1;         // EXIF's, 1 to 8: how the file's rows and columns are turned before all else
  int downscale = 1;           // pixels of the picture per side that become one of the view
  std::filesystem::path mask;  // picture that is black where nothing is to be compared; may be empty
};

struct Camera {
  std::string name;             // image path without extension, as the camera file gives it ("lr/001")
  std::filesystem::path image;  // the view's picture where the camera file knows one; may be empty
  Pinhole intrinsics;           // of the view: what is rendered and compared
  Pose world_to_camera;
  Photograph photograph;

  std::array<double, 3> Center() const;                                  // −Rᵀt, world
  std::array<double, 3> ToCamera(const std::array<double, 3>& p) const;  // R·p + t
};

// Which program's conventions a set of cameras came with; they differ in whether the size is the one trained at.
enum class CameraSource { kUnknown, kTransforms, kInria, kColmap, kLlff };

struct CameraSet {
  CameraSource source = CameraSource::kUnknown;
  std::vector<Camera> cameras;
  std::optional<std::array<float, 3>> background;  // rgb 0–1, where the file says which one the views have
  std::filesystem::path points;                    // a PLY with points of the scene, where the file names one
  // Where the cameras were moved to another world than that of their file and its points: how.
  std::optional<Similarity> moved;
};

// The camera in a world that begins at `origin`: what a splat's means are in (core/world_origin.h).
Pose FromOrigin(const Pose& world_to_camera, const WorldOrigin& origin);
Camera FromOrigin(Camera camera, const WorldOrigin& origin);
CameraSet FromOrigin(CameraSet set, const WorldOrigin& origin);
// ChooseOrigin of the cameras' centres.
WorldOrigin ChooseOrigin(const std::vector<Camera>& cameras);

// The same view, up to scale, of a world that `move` has moved.
Pose Moved(const Pose& world_to_camera, const Similarity& move);

// The same view with `factor` times as many pixels per side (width and height rounded, at least 1); the rays through
// the image corners stay where they were, up to that rounding.
Pinhole Scaled(const Pinhole& intrinsics, double factor);

// The view that shows only `box` of the picture, which may reach beyond it.
Camera Crop(const Camera& camera, const PixelBox& box);

// Camera at `center` looking at `target`. `up` is the world's up; where it is parallel to the view direction, another
// axis is taken. kBadArgument when center and target coincide or anything is not finite.
Result<Pose> LookAt(const std::array<double, 3>& center, const std::array<double, 3>& target,
                    const std::array<double, 3>& up);

// From camera-to-world in OpenGL axes (x right, y up, z backward), row-major 4×4: NeRF's `transform_matrix`.
// kBadArgument when the upper 3×3 is not a rotation (up to uniform rounding, 1e-3) or something is not finite.
Result<Pose> PoseFromOpenGlCameraToWorld(const std::array<double, 16>& camera_to_world);
std::array<double, 16> OpenGlCameraToWorld(const Pose& pose);

// `count` poses on a Fibonacci sphere of `radius` around `target`, evenly spread, the same on every machine. Names are
// "000", "001", … All share `intrinsics`. kBadArgument: count < 1, radius not positive.
Result<CameraSet> OrbitCameras(int count, double radius, const std::array<double, 3>& target,
                               const Pinhole& intrinsics);

// Square pixels, centred principal point; `fov_x` is the horizontal field of view in radians.
Pinhole PinholeFromFov(int width, int height, double fov_x);

}  // namespace anchorsplat
