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

// Which Gaussians come and go (docs/fit.md#strategies).
enum class FitStrategy {
  kDefault,  // Kerbl et al. 2023
  kAbsgrad,  // the same by absolute gradients, for fine detail (Ye et al. 2024)
  kMcmc,     // a number of Gaussians that move to where they are needed (Kheradmand et al. 2024)
};

// Where the first Gaussians stand.
enum class StartingPoints {
  kAuto,     // kProject where the project has some, else kView
  kProject,  // the project's points
  kView,     // random points where many cameras look
  kRandom,   // random points in a cube, as gsplat's
};

// The standard 3DGS optimisation; `anchorsplat fit --help` and docs/fit.md say more. Schedules follow `steps`.
struct FitSettings {
  int64_t steps = 15000;
  int sh_degree = 3;
  FitStrategy strategy = FitStrategy::kDefault;
  bool mip_filter = false;  // Mip-Splatting's 3-D smoothing filter; the splat is for Rasterization::kMip
  Rasterization rasterization = Rasterization::kClassic;  // of the fit, and so of the splat; kMip with mip_filter
  bool exposure = false;  // a gain and a bias per channel for each view: photographs that differ in brightness and tint
  // Above 1 a pixel is the mean over its area and not what the ray through its centre meets: for a splat that will be
  // seen as many times closer. Up to 16; not with mip_filter.
  double area_pixels = 1;
  int64_t max_gaussians = 0;                               // growth stops there; 0: no bound, or a million with kMcmc
  int hold_out = 8;                                        // every Nth view, by name, is not trained on; 0: all are
  int downscale = 1;                                       // N × N pixels of the pictures become one
  StartingPoints starting_points = StartingPoints::kAuto;  // without a splat to begin at
  std::optional<int64_t> initial_points =
      std::nullopt;  // thinned to as many, or random ones; 100,000 where there are none
  // Of kRandom: half a side of the cube, in scene scales (1.1 × the largest distance of a camera from their middle);
  // 0.001 to 1000. 3 as gsplat's where nothing is said; INRIA's trainer has 0.3 around one object.
  std::optional<double> initial_extent = std::nullopt;
  // Gaussians on a sphere far beyond cameras and points, for what is seen there; 0: none. Some where the project's
  // points leave much of the pictures open, when nothing is said.
  std::optional<int64_t> far_shell = std::nullopt;
  std::optional<std::array<float, 3>> background =
      std::nullopt;                       // what the project says otherwise, black where it says nothing
  std::filesystem::path checkpoint = {};  // state of a stopped fit; empty: none is written
  bool resume = false;                    // go on from it where it is there
  uint64_t seed = 0;
};

// How alike renders and pictures are: means over views.
struct FitQuality {
  int64_t views = 0;
  double psnr = 0;  // dB
  double ssim = 0;
};

struct FitOutcome {
  Splat splat;
  int64_t steps = 0;     // done in all
  bool stopped = false;  // by RunSettings::stop; then the splat is what there was and the qualities are not measured
  int64_t gaussians_in = 0;
  FitQuality train, held_out;
  double seconds = 0;  // of the steps
};

// Fits a splat to the pictures of a project: a COLMAP project, a folder with a transforms.json, a NeRF-synthetic
// scene. Begins at the project's points or, where it has none, at random ones that many cameras see; or, with `start`,
// at the centres and colours of another splat.
//
// Failures: kNotFound; kIo; kBadFile; kBadArgument: settings out of range or at odds, a start without finite
// Gaussians, StartingPoints::kProject where the project has none.
ANCHORSPLAT_PUBLIC Expected<FitOutcome> FitProject(const std::filesystem::path& project,
                                                   const FitSettings& settings = {}, const RunSettings& run = {});
ANCHORSPLAT_PUBLIC Expected<FitOutcome> FitProject(const std::filesystem::path& project, const SplatView& start,
                                                   const FitSettings& settings = {}, const RunSettings& run = {});

}  // namespace anchorsplat
