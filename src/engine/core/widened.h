#pragma once

#include <algorithm>
#include <cmath>

namespace anchorsplat {

// ln √(exp(2·log_scale) + exp(log_variance)): log-scale of a Gaussian convolved with another. Neither overflows for
// huge scales nor loses tiny ones; −Inf is a scale of zero.
inline double WidenedLogScale(double log_scale, double log_variance) {
  const double high = std::max(2 * log_scale, log_variance), low = std::min(2 * log_scale, log_variance);
  return 0.5 * (high + std::log1p(std::exp(low - high)));
}

}  // namespace anchorsplat
