#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace anchorsplat {

// Where K copies of a Gaussian begin, so that together they look like it.
//
// No K equal Gaussians multiply to exactly the transmittance of one: 1 − Π(1 − o'·g) is flatter on top than o·g. These
// come closest in the least-squares sense (fitted to opacities from 0.1 to 0.998 and K from 2 to 20; docs/network.md):
// at the same place with all scales shortened by
//     s₀² = 1 − 0.23·(1 − 1/K)·o − 0.05·o²
// and with opacity
//     o' = 1 − (1 − ô)^(1/K),   ô = o − 0.13·(1 − K^(−4/3))·o³,
// and, `spread` apart along the two longest axes, shortened there to s² = s₀² − spread²·v with o' growing by s₀/s per
// axis. v is the pattern's variance along the axis. K = 1 is the Gaussian itself.
class CopyStart {
 public:
  CopyStart(int64_t copies, double spread);

  // Places of the copies along the two longest axes, in standard deviations of the Gaussian: mean 0, along an axis
  // variance spread² or, for K = 1 and on the second axis for K = 2, zero.
  const std::array<double, 2>& offset(int64_t k) const { return offsets_[static_cast<size_t>(k)]; }

  struct Shape {
    double opacity_logit;               // of every copy; −Inf stays
    std::array<double, 3> log_shorter;  // added to the log-scales, longest axis first
  };
  Shape ShapeOf(double opacity_logit) const;

 private:
  std::vector<std::array<double, 2>> offsets_;
  std::array<double, 2> variance_{};
};

}  // namespace anchorsplat
