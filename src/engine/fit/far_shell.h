#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "fit/far_units.h"
#include "fit/fit_options.h"
#include "fit/initial_points.h"
#include "fit/training_views.h"

namespace anchorsplat {

// A shell of Gaussians for what pictures show beyond all points (sky, hills, the far side of a street). Without it a
// fit builds the distance out of blots in front of the cameras.

inline constexpr int64_t kMostOnShell = int64_t{1} << 20;  // maximum count, on the whole sphere
inline constexpr double kShellDistance = 10;  // × the farther of cameras and points: parallax there is a few degrees
inline constexpr double kShellOpacity = 0.1;  // with σ = spacing, the sphere hides 47 % of what is behind it
inline constexpr double kShellShare = 0.15;  // makes no shell if less of the pictures shows something beyond the points
inline constexpr double kShellPixels = 4;    // default spacing in pictures
inline constexpr int64_t kShellDefaultMost = 50'000;

struct FarShellOptions {
  // Count on the whole sphere, of which those in no picture are left out. 0: no shell. Unset: the pictures decide, and
  // only those in view where no point is are made.
  std::optional<int64_t> count = std::nullopt;
  // False for random points or a splat's, which do not say where pictures show something else.
  bool points_tell = true;
  std::array<float, 3> background = {0, 0, 0};  // of the fit, rgb 0–1
  int sh_degree = 3;
  int64_t max_gaussians = 0;  // of the fit; without `count` the shell takes at most half of it; 0: no limit
};

struct FarShell {
  GaussianCloud cloud;    // may be empty
  FarUnits units;         // for the fit; none if the cloud is empty
  double radius = 0;      // of the sphere around the cameras' mean, world units
  int64_t on_sphere = 0;  // number on the whole sphere; `cloud` has the visible ones
  double open_share = 0;  // share of the pictures that shows something where no point is; 0 if not measured
  std::string why;        // decision and reason, to follow "far shell: "
};

// Makes a sphere of isotropic Gaussians around the cameras' mean, at kShellDistance × the farther of the scene scale
// and 98 % of the points. Colours are medians over the pictures, preferably those without a point in front. In a closed
// room the sphere lies outside the walls, where it is not seen and gets pruned.
//
// To decide, pictures are divided into cells, 16 along the longer side, or fewer so that they hold four points on
// average. A cell is open if it has no point and most of its pixels are neither masked nor transparent, and not all of
// one colour that is the background's or that of most open cells: objects on a plain background get no shell. Uses at
// most 200 evenly chosen pictures. Points need not be finite. The same bits for any number of threads.
//
// Errors: those of PictureCache; kBadArgument: no views; count below 0 or above kMostOnShell.
Result<FarShell> MakeFarShell(const TrainingViews& views, const InitialPoints& start, const FarShellOptions& options);

// Makes a shell for a fit: appends its Gaussians to `initial`, made from the points `start`; sets `options`; logs it.
// The returned shell's cloud is empty; `gaussians` were appended.
struct AddedShell {
  FarShell shell;
  int64_t gaussians = 0;
};
Result<AddedShell> AddFarShell(const TrainingViews& views, const InitialPoints& start, std::optional<int64_t> count,
                               bool points_tell, FitOptions& options, GaussianCloud& initial);

// `count` points evenly spread on the unit sphere.
std::vector<std::array<double, 3>> FibonacciSphere(int64_t count);

}  // namespace anchorsplat
