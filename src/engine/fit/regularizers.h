#pragma once

#include "core/gaussian_cloud.h"
#include "fit/far_units.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// Terms of a fit's loss that look at the Gaussians and not at pictures: they pull everything towards small and
// transparent, so that what the pictures do not need is found and moves (Kheradmand et al. 2024). Names are those of
// gsplat's trainer, whose default strategy has none and whose preset "mcmc" has both at 0.01.
struct Regularizers {
  double opacity_reg = 0;  // × mean of opacities
  double scale_reg = 0;    // × mean of all axes' sizes, in units of McmcStep::unit
};

// What they add to the gradient of a cloud. Rows that are not finite get nothing. Sizes are in `far`
// units.
void AddRegularizers(const Regularizers& regularizers, double unit, const FarUnits& far, const GaussianCloud& cloud,
                     CloudGradient& gradient);

}  // namespace anchorsplat
