#pragma once

#include <anchorsplat/error.h>
#include <anchorsplat/export.h>
#include <anchorsplat/run.h>
#include <anchorsplat/splat.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>

namespace anchorsplat {

// The strategy that adds and removes Gaussians (docs/fit.md#strategies).
enum class FitStrategy {
  kDefault,  // Kerbl et al. 2023
  kAbsgrad,  // the same with absolute gradients, for fine detail (Ye et al. 2024)
  kMcmc,     // a fixed budget of Gaussians that are relocated to where they are needed (Kheradmand et al. 2024)
};

// Where the initial Gaussians are.
enum class StartingPoints {
  kAuto,     // kProject if the project has points, else kView
  kProject,  // the project's points
  kView,     // random points where many cameras look
  kRandom,   // random points in a cube, as in gsplat
};

// Settings of a standard 3DGS optimisation; see `anchorsplat fit --help` and docs/fit.md. Schedules scale with `steps`.
struct FitSettings {
  int64_t steps = 15000;
  int sh_degree = 3;
  FitStrategy strategy = FitStrategy::kDefault;
  bool mip_filter = false;  // Mip-Splatting's 3-D smoothing filter; the result is for Rasterization::kMip
  Rasterization rasterization = Rasterization::kClassic;  // of the fit and of the result; kMip with mip_filter
  bool exposure = false;  // fits gain and bias per view and channel, for photographs of varying brightness and tint
  // Above 1, a pixel is the average over its area instead of the ray through its centre: for a splat to be seen this
  // many times closer. Up to 16; not with mip_filter.
  double area_pixels = 1;
  int64_t max_gaussians = 0;                               // growth stops there; 0: no limit, or a million with kMcmc
  int hold_out = 8;                                        // holds out every Nth view, by name; 0: none
  int downscale = 1;                                       // averages N × N pixels of the pictures into one
  StartingPoints starting_points = StartingPoints::kAuto;  // without `start`
  // Subsamples the points to this number, or the number of random ones. Unset: all points, or 100,000 random ones.
  std::optional<int64_t> initial_points = std::nullopt;
  // kRandom: half the side of the cube, in scene scales (1.1 × the largest distance of a camera from their centre);
  // 0.001 to 1000. Unset: 3, as in gsplat. INRIA's trainer uses 0.3 around a single object.
  std::optional<double> initial_extent = std::nullopt;
  // Number of Gaussians on a sphere far beyond cameras and points, for what is seen there; 0: none. Unset: some, if
  // much of the pictures has no points of the project.
  std::optional<int64_t> far_shell = std::nullopt;
  std::optional<std::array<float, 3>> background = std::nullopt;  // unset: the project's, else black
  std::filesystem::path checkpoint = {};                          // for the state of a stopped fit; empty: not saved
  bool resume = false;                                            // resume from it if it exists
  uint64_t seed = 0;
};

// Similarity of renders and pictures: means over views.
struct FitQuality {
  int64_t views = 0;
  double psnr = 0;  // dB
  double ssim = 0;
};

struct FitOutcome {
  Splat splat;
  int64_t steps = 0;     // in total
  bool stopped = false;  // by RunSettings::stop: the splat is unfinished and quality is not measured
  int64_t gaussians_in = 0;
  FitQuality train, held_out;
  double seconds = 0;  // of the steps
};

// Fits a splat to the pictures of a project: a COLMAP project, a folder with a transforms.json, or a NeRF-synthetic
// scene. Starts from the project's points or, without any, from random points that many cameras see; with `start`, from
// another splat's centres and colours.
//
// Failures: kNotFound; kIo; kBadFile; kBadArgument: settings out of range or contradictory, a start without finite
// Gaussians, StartingPoints::kProject for a project without points.
ANCHORSPLAT_PUBLIC Expected<FitOutcome> FitProject(const std::filesystem::path& project,
                                                   const FitSettings& settings = {}, const RunSettings& run = {});
ANCHORSPLAT_PUBLIC Expected<FitOutcome> FitProject(const std::filesystem::path& project, const SplatView& start,
                                                   const FitSettings& settings = {}, const RunSettings& run = {});

}  // namespace anchorsplat
