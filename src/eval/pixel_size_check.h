#pragma once

#include <string>
#include <vector>

#include "core/result.h"
#include "enhance/pixel_size_estimate.h"
#include "enhance/pixel_size_features.h"
#include "enhance/pixel_size_guard.h"
#include "enhance/pixel_sizes_of_things.h"
#include "eval/benchmark.h"

namespace anchorsplat {

// The estimate of an object's pixel size beside the true one, and what the estimate is made from.
struct PixelSizeCheck {
  std::string object;
  RenderMode mode = RenderMode::kClassic;  // its tag's
  double truth = 0;                        // median over the Gaussians (eval/filter_sweep.h), world units
  double start = 0;                        // what the search begins with
  PixelSizeEstimate estimate;
  double seconds = 0;  // of the estimate
  PixelSizeEvidence evidence;
  std::vector<ThingPixelSize> things;  // that lie apart, empty where it is of one piece
  struct Sample {
    double size = 0;
    std::vector<double> features;  // of every Look, then SizeFeatures
  };
  std::vector<Sample> samples;  // at truth · 2^(k/4), |k| ≤ 5, in order; empty unless asked for
  double best_strength = 0;     // of the filter, on a few held-out views; measured with the samples
};

Result<PixelSizeCheck> CheckPixelSize(const BenchmarkObject& object, bool with_samples);

}  // namespace anchorsplat
