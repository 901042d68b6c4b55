#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "fit/cloud_optimizer.h"
#include "fit/densification.h"

namespace anchorsplat {

// All that changes during a fit.
struct FitState {
  int64_t step = 0;  // steps done
  GaussianCloud cloud;
  CloudOptimizer optimizer;
  Densification densification;  // of nothing where the strategy gathers nothing
  Buffer<float> mip_filter;     // [N] world units, MipFilterSizes; empty where the fit has no such filter
  // [V,6] of refinements that align their views: how far each has moved from where its camera says (MotionBetween in
  // fit/view_pose.h). Empty: they stay.
  Buffer<float> motions;
  Buffer<float> exposures;  // [V,6] of fits that take them out: gain and bias per channel, as they are measured
  // Files that an interruption leaves besides its checkpoint, by their AbsoluteName: what goes on may replace them.
  std::vector<std::string> left;
};

}  // namespace anchorsplat
