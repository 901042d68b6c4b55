#pragma once

#include "core/gaussian_cloud.h"

namespace anchorsplat {

// A flat cloud seen along its thickness, from either side. Whether pictures showed both: what a thing seen from all
// around has on one side is hidden from the other, and as fine. Land seen from above has no other side: it is the same
// Gaussians from below, or a lower side that no picture showed, which is coarser. Neither unit nor orientation matters.
struct TwoSides {
  double shared = 1;   // of what both sides show, the share that is seen from either alike
  double coarser = 1;  // size of what the coarser side shows, √(middle × largest axis), over that of the other

  // Lands are at 0.06 to 0.22 and 1.48 to 1.64, or share 0.7 where nothing lies below, 0.3 where Gaussians lie in a
  // loose layer; doors, boards, instruments, screens, aircraft and an umbrella are at 0.02 to 0.22 and 1.00 to 1.34, by
  // MCMC at up to 0.45 (docs/results/pixel-size.md, two-sides).
  static constexpr double kShared = 0.25, kCoarser = 1.4;
  bool both_were_shown() const { return shared < kShared && coarser < kCoarser; }
};
// Of 512 places. Takes time of 512 × Gaussians.
TwoSides TwoSidesOf(const GaussianCloud& cloud);

}  // namespace anchorsplat
