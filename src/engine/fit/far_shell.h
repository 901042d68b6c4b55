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

// Gaussians for what pictures show beyond all points (sky, hills, the other side of a street): a fit that has none
// there builds the distance out of blots in front of the cameras.

inline constexpr int64_t kMostOnShell = int64_t{1} << 20;  // that may be asked for, on the whole sphere
inline constexpr double kShellDistance = 10;  // × the farther of cameras and points: parallax there is a few degrees
inline constexpr double kShellOpacity = 0.1;  // with σ = their distance the sphere hides 47 % of what is behind it
inline constexpr double kShellShare = 0.15;   // of the pictures: with less than that beyond the points there is none
inline constexpr double kShellPixels = 4;     // between neighbours, where nobody says how many
inline constexpr int64_t kShellDefaultMost = 50'000;

struct FarShellOptions {
  // On the whole sphere; those that no picture shows are left out. 0: none. Nothing: the pictures decide, and only
  // those are made that some picture shows where no point is.
  std::optional<int64_t> count = std::nullopt;
  // Of a start whose points are random or a splat's: they do not say where the pictures show something else.
  bool points_tell = true;
  std::array<float, 3> background = {0, 0, 0};  // of the fit, rgb 0–1
  int sh_degree = 3;
  int64_t max_gaussians = 0;  // of the fit: without a count the sphere has half of them at most; 0: no bound
};

struct FarShell {
  GaussianCloud cloud;    // may be empty
  FarUnits units;         // for the fit; none where the cloud is empty
  double radius = 0;      // world units, of the sphere around the cameras' mean
  int64_t on_sphere = 0;  // of which `cloud` are those to be seen
  double open_share = 0;  // of the pictures, where they show something and no point is; 0 where nobody looked
  std::string why;        // what was decided and why, to follow "far shell: "
};

// A sphere of isotropic Gaussians, kShellDistance × as far from the cameras' mean as the farther of the scene scale and
// 98 % of the points. Colours are medians over the pictures of what shows in their place, where possible of pictures
// that have no point in front of it. In a closed room the sphere stands outside of the walls, where it is not seen and
// goes.
//
// Pictures are looked at in cells, 16 along the longer side, or fewer so that four points fall into one on average. A
// cell is open when no point is in it and most of its pixels are neither masked nor transparent, and not all of one
// colour that is the background's or that of most open cells: objects on a plain background get no shell. At most 200
// pictures are looked at, evenly chosen. Points need not be finite. The same bits for any number of threads.
//
// Errors: those of PictureCache; kBadArgument: no views, a count below 0 or above kMostOnShell.
Result<FarShell> MakeFarShell(const TrainingViews& views, const InitialPoints& start, const FarShellOptions& options);

// The same for a fit with these options: appends the Gaussians to `initial`, whose points are `start`, and tells the
// options and people (LogInfo). The shell that comes back has an empty cloud; `gaussians` of it were appended.
struct AddedShell {
  FarShell shell;
  int64_t gaussians = 0;
};
Result<AddedShell> AddFarShell(const TrainingViews& views, const InitialPoints& start, std::optional<int64_t> count,
                               bool points_tell, FitOptions& options, GaussianCloud& initial);

// `count` places on the unit sphere, evenly spread: [N,3].
std::vector<std::array<double, 3>> FibonacciSphere(int64_t count);

}  // namespace anchorsplat
