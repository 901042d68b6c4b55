#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace anchorsplat {

// Initial shape of a Gaussian's K copies, which together approximate it.
//
// K equal Gaussians cannot reproduce one exactly: 1 − Π(1 − o'·g) has a flatter top than o·g. These formulas are a
// least-squares fit over opacities 0.1 to 0.998 and K from 2 to 20 (docs/network.md). Copies at the same place have all
// scales multiplied by s₀ and opacity o':
//     s₀² = 1 − 0.23·(1 − 1/K)·o − 0.05·o²
//     o' = 1 − (1 − ô)^(1/K),   ô = o − 0.13·(1 − K^(−4/3))·o³.
// Copies spread along the two longest axes have scales multiplied by s there, s² = s₀² − spread²·v, and o' multiplied
// by s₀/s per axis; v is the pattern's variance along the axis. K = 1 leaves the Gaussian unchanged.
class CopyStart {
 public:
  CopyStart(int64_t copies, double spread);

  // Position of copy k along the two longest axes, in standard deviations. Over the copies, mean 0 and variance spread²
  // per axis; variance 0 for K = 1, and on the second axis for K = 2.
  const std::array<double, 2>& offset(int64_t k) const { return offsets_[static_cast<size_t>(k)]; }

  struct Shape {
    double opacity_logit;               // of every copy; −Inf stays −Inf
    std::array<double, 3> log_shorter;  // added to the log-scales, longest axis first
  };
  Shape ShapeOf(double opacity_logit) const;

 private:
  std::vector<std::array<double, 2>> offsets_;
  std::array<double, 2> variance_{};
};

}  // namespace anchorsplat
