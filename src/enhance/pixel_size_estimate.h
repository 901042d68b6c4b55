#pragma once

#include <optional>

#include "core/gaussian_cloud.h"
#include "core/render_mode.h"
#include "core/result.h"
#include "enhance/pixel_size_features.h"

namespace anchorsplat {

// An estimate of p_LR, the world size of a training pixel, from the cloud alone: pixels of the size are looked for with
// which the cloud's outlines are as soft as those of fits are with theirs (pixel_size_features.h), by a regression on
// fits whose pixel size is known (docs/method.md says how good it is). The true value lies between `low` and `high` for
// about 95 % of splats like those; they are further apart where outlines are unlike theirs. Where the cloud's render
// mode is antialiased it is made up for.
struct PixelSizeEstimate {
  double size = 0;  // world units
  double low = 0;
  double high = 0;
  // 0: outlines and sizes are like those of standard fits, from surface points by Kerbl et al.'s densification; 1: they
  // are unlike those, as of MCMC, random points, photographs.
  double unlike_standard = 0;
  // How unlike its outlines are to those of the fits that the regression has seen: root mean square of their features'
  // deviations, 1 on average of many kinds, 0.5 of standard fits.
  double strangeness = 0;
  // What the regression of many kinds says over what that of standard fits does, where the first is smaller and only
  // the second would be believed but for that; 1 elsewhere.
  double disagreement = 1;
  // What `size` was lowered by, as its Gaussians are larger than such outlines leave them: those of fits to pictures
  // that are soft themselves, out of focus or enlarged. 1: not at all.
  double softness = 1;
  double showing = 1;           // PixelSizeProbe::showing()
  bool of_antialiased = false;  // by the regression of these
  // Share of its outlines that are cuts and do not count: PixelSizeProbe::CutOutlines().
  double cut_outlines = 0;
  // The same of those that Gaussians make which are much coarser than the others: PixelSizeProbe::CoarseOutlines().
  double coarse_outlines = 0;
};

// Scales with the cloud. Takes up to a second, for large clouds too, as only a part of them is looked at.
// kBadArgument: fewer than 16 usable Gaussians with visible opacity and finite scales: nothing to estimate from.
Result<PixelSizeEstimate> EstimatePixelSize(const GaussianCloud& cloud);

// The same with a probe of the cloud.
Result<PixelSizeEstimate> EstimatePixelSize(PixelSizeProbe& probe, std::optional<RenderMode> mode);

}  // namespace anchorsplat
