#include "core/similarity.h"

#include <cstddef>

namespace anchorsplat {

std::array<double, 3> Similarity::Apply(const std::array<double, 3>& p) const {
  const auto& r = rotation;
  return {scale * (r[0] * p[0] + r[1] * p[1] + r[2] * p[2]) + translation[0],
          scale * (r[3] * p[0] + r[4] * p[1] + r[5] * p[2]) + translation[1],
          scale * (r[6] * p[0] + r[7] * p[1] + r[8] * p[2]) + translation[2]};
}

Similarity Inverse(const Similarity& s) {
  const auto& r = s.rotation;
  Similarity inverse{{r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]}, {0, 0, 0}, 1 / s.scale};
  const std::array<double, 3> back = inverse.Apply(s.translation);
  inverse.translation = {-back[0], -back[1], -back[2]};
  return inverse;
}

Similarity Compose(const Similarity& outer, const Similarity& inner) {
  Similarity both{{}, outer.Apply(inner.translation), outer.scale * inner.scale};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      for (size_t k = 0; k < 3; ++k) both.rotation[3 * i + j] += outer.rotation[3 * i + k] * inner.rotation[3 * k + j];
    }
  }
  return both;
}

}  // namespace anchorsplat
