#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "fit/cloud_optimizer.h"
#include "fit/densification.h"

namespace anchorsplat {

// Everything that changes during a fit.
struct FitState {
  int64_t step = 0;  // steps done
  GaussianCloud cloud;
  CloudOptimizer optimizer;
  Densification densification;  // empty if the strategy accumulates nothing
  Buffer<float> mip_filter;     // [N] MipFilterSizes, world units; empty without that filter
  // [V,6] for refinements that align views: each view's motion from its camera (MotionBetween in fit/view_pose.h).
  // Empty:
  // cameras are fixed.
  Buffer<float> motions;
  Buffer<float> exposures;  // [V,6] for fits that remove exposure: measured gain and bias per channel
  // Files that an interruption leaves besides its checkpoint (AbsoluteName): resuming may replace them.
  std::vector<std::string> left;
};

}  // namespace anchorsplat
