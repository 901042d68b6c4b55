#pragma once

#include <anchorsplat/error.h>
#include <anchorsplat/export.h>
#include <anchorsplat/picture.h>
#include <anchorsplat/run.h>
#include <anchorsplat/splat.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace anchorsplat {

// A camera without distortion in OpenCV axes (x right, y down, z forward): p_camera = rotation·p_world + translation.
// Pixel (0,0) covers [0,1)²; its centre is at 0.5.
struct PinholeCamera {
  std::string name = {};  // of the view
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;                         // pixels
  std::array<double, 9> rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // world to camera, row-major
  std::array<double, 3> translation = {0, 0, 0};                 // world units
};

// `count` cameras of width × height pixels on a sphere around the splat, which fills their pictures. Upright if the
// splat's comments say where up is. `fov`: horizontal field of view, degrees. kBadArgument: count or size below 1, fov
// not between 0 and 180.
ANCHORSPLAT_PUBLIC Expected<std::vector<PinholeCamera>> OrbitAround(const SplatView& splat, int count, int width,
                                                                    int height, double fov = 45);

// Reads cameras, in order, from a transforms.json, an INRIA cameras.json, a poses_bounds.npy, a COLMAP model, a file of
// Metashape, OpenSfM or Bundler, or a folder with one of these. A camera with a lens becomes the pinhole of its
// undistorted pictures (docs/fit.md). Failures: kNotFound, kIo, kBadFile; kBadArgument: a folder with several.
ANCHORSPLAT_PUBLIC Expected<std::vector<PinholeCamera>> ReadCameraFile(const std::filesystem::path& path);

struct RenderSettings {
  std::array<float, 3> background = {0, 0, 0};
  std::optional<Rasterization> rasterization = std::nullopt;  // unset: the splat's own, else classic
  // World units along z. Unset: 0.01, or a thousandth of the distance to the splat if that is less; no far plane.
  std::optional<float> near_plane = std::nullopt, far_plane = std::nullopt;
  int sh_degree = 3;  // highest degree used
  bool depth = false;
};

struct Rendering {
  Picture color;        // [3,H,W] including background, not clamped above 1
  Picture alpha;        // [1,H,W] coverage
  Picture depth;        // [1,H,W] expected camera z, 0 where nothing is; empty unless requested
  int64_t visible = 0;  // Gaussians not culled
};

// Renders the splat with the 3DGS rasterizer, one picture per camera; the same bits for any number of threads.
// Gaussians with non-finite values are not drawn. If a picture shows nothing, a message of the run says why.
// Failures: kBadArgument: CheckShape, a camera without pixels or with non-finite values, settings out of range; kIo:
// not enough memory; kStopped.
ANCHORSPLAT_PUBLIC Expected<std::vector<Rendering>> RenderViews(const SplatView& splat,
                                                                std::span<const PinholeCamera> cameras,
                                                                const RenderSettings& settings = {},
                                                                const RunSettings& run = {});
ANCHORSPLAT_PUBLIC Expected<Rendering> Render(const SplatView& splat, const PinholeCamera& camera,
                                              const RenderSettings& settings = {}, const RunSettings& run = {});

}  // namespace anchorsplat
