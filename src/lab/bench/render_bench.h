#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bench/machine_limits.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

struct RenderBenchOptions {
  int poses = 8;            // on an orbit around the origin
  double radius = 1.7;      // world units
  double fov_degrees = 45;  // horizontal; square pictures
  int repeats = 5;          // over all poses, after a warm-up; the fastest counts
  int split = 20;           // splitting factor in the third load
  uint64_t seed = 1;        // of the split
};

// One load: the mean over all poses in the fastest warm repeat.
struct RenderBenchRow {
  std::string scene;
  int64_t gaussians = 0;
  int width = 0;  // pixels per side
  double ms = 0;  // per picture: all stages, including what lies between
  double project_ms = 0, spherical_harmonics_ms = 0, sort_ms = 0, bin_ms = 0, blend_ms = 0;
  int64_t visible = 0, pairs = 0, evaluations = 0;  // see RenderStatistics
  // Multiplications and multiply-adds of blending per second, relative to the machine's limit. Short lists and
  // comparisons keep it well below 1.
  double blend_of_fma_limit = 0;
  // Bytes that projection and colours must move per second, relative to memory speed. May exceed 1 for clouds that fit
  // into caches.
  double project_of_memory_limit = 0;
};

struct RenderBenchReport {
  MachineLimits limits;
  std::vector<RenderBenchRow> rows;
};

// Renders `cloud` at 256² and 1024², and split `options.split`-fold at 1024².
// Errors (kBadArgument): an invalid or empty cloud; options that are not positive.
Result<RenderBenchReport> BenchRender(const GaussianCloud& cloud, const std::string& scene,
                                      const RenderBenchOptions& options = {});

// Splits every Gaussian into `factor` ones of the same shape, opacity and colour, sampled from it (μ + R·S·n, n normal)
// and smaller by ∛factor, so that volumes add up. The same on every machine.
GaussianCloud SplitGaussians(const GaussianCloud& cloud, int factor, uint64_t seed);

}  // namespace anchorsplat
