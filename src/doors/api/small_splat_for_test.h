#pragma once

#include <anchorsplat/splat.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>
#include <span>

namespace anchorsplat {

// Coloured Gaussians in a ball of radius 0.5, the same on every machine.
inline Splat SmallSplat(int64_t count, int sh_degree, uint32_t seed) {
  Splat splat = *Splat::OfSize(count, sh_degree);
  std::minstd_rand random(seed);
  const auto uniform = [&random](double low, double high) {
    return static_cast<float>(low + (high - low) * (random() % 65536) / 65536.0);
  };
  for (float& x : splat.means()) x = uniform(-0.3, 0.3);
  for (float& x : splat.log_scales()) x = uniform(-3.2, -2.2);
  for (float& x : splat.quats()) x = uniform(-1, 1);
  for (float& x : splat.opacity_logits()) x = uniform(0, 3);
  for (float& x : splat.sh()) x = uniform(-0.5, 0.9);
  return splat;
}

inline bool SameBits(std::span<const float> a, std::span<const float> b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size_bytes()) == 0);
}

inline bool SameBits(const SplatView& a, const SplatView& b) {
  return a.sh_degree == b.sh_degree && SameBits(a.means, b.means) && SameBits(a.log_scales, b.log_scales) &&
         SameBits(a.quats, b.quats) && SameBits(a.opacity_logits, b.opacity_logits) && SameBits(a.sh, b.sh);
}

}  // namespace anchorsplat
