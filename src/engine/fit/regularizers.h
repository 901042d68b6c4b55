#pragma once

#include "core/gaussian_cloud.h"
#include "fit/far_units.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// Regularization terms of a fit's loss on Gaussians: they pull towards small and transparent ones, so that those the
// pictures do not need die and are relocated (Kheradmand et al. 2024). Names are gsplat's; its default strategy uses
// none, its preset "mcmc" both at 0.01.
struct Regularizers {
  double opacity_reg = 0;  // × mean opacity
  double scale_reg = 0;    // × mean axis length, in McmcStep::unit
};

// Adds their gradient. Skips non-finite rows. `far`: scales sizes.
void AddRegularizers(const Regularizers& regularizers, double unit, const FarUnits& far, const GaussianCloud& cloud,
                     CloudGradient& gradient);

}  // namespace anchorsplat
