#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

struct FitBenchOptions {
  std::vector<int> widths = {256, 1024};  // pixels per side
  int poses = 8;                          // on an orbit around the origin
  double radius = 1.7;                    // world units
  double fov_degrees = 45;                // horizontal; square pictures
  int repeats = 10;                       // over all poses, after a warm-up; the fastest counts per pose
  int split = 1;      // > 1: a dense cloud; splits every Gaussian into this many smaller and fainter ones
  uint64_t seed = 1;  // of the target's disturbance and of split positions
};

// One iteration of a fit: render, loss, gradient, Adam step and densification's sums. Means over the poses.
struct FitBenchRow {
  std::string scene;
  int64_t gaussians = 0;
  int width = 0;
  double ms = 0;  // all stages, including what lies between
  double project_ms = 0, spherical_harmonics_ms = 0, sort_ms = 0, bin_ms = 0, blend_ms = 0;
  double loss_ms = 0;
  double blend_backward_ms = 0, project_backward_ms = 0;
  double adam_ms = 0, densify_ms = 0;
  int64_t visible = 0, pairs = 0, evaluations = 0;  // see RenderStatistics
};

// Times iterations on `cloud` towards pictures of the same cloud with slightly disturbed means and colours, so that
// gradients are as dense as during a fit. Learning rates are 0: all work is done, but every iteration is the same.
//
// Errors (kBadArgument): an invalid or empty cloud; options that are not positive.
Result<std::vector<FitBenchRow>> BenchFit(const GaussianCloud& cloud, const std::string& scene,
                                          const FitBenchOptions& options = {});

}  // namespace anchorsplat
