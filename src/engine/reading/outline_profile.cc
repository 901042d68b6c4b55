#include "reading/outline_profile.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/parallel.h"

namespace anchorsplat {

namespace {
constexpr int kProfileRowsPerTask = 32;
constexpr float kLeastGradient = 1e-4f;  // per pixel; flatter crossings are noise on a plateau
constexpr int kStretch = 16;             // px
constexpr float kLeftOutShare = 0.2f;    // of alpha

// Quick test for stretches of a row, with the pixels to the right and `below`: false if they have no level and no band.
// Most of a picture is empty or opaque.
bool MayShow(const float* at, int below) {
  float low = at[0], high = at[0];
  for (int x = 0; x <= kStretch; ++x) {
    low = std::min(low, std::min(at[x], at[below + x]));
    high = std::max(high, std::max(at[x], at[below + x]));
  }
  return high >= kOutlineBands.front() && low < kOutlineBands.back();
}
static_assert(kOutlineBands.front() < kOutlineLevels.front() && kOutlineBands.back() > kOutlineLevels.back());
}  // namespace

void OutlineProfile::AddRows(const Image& alpha, double pixel, const LeftOut& left_out, int first, int last,
                             Sums& sums) {
  const int width = alpha.width;
  for (int y = first; y < last; ++y) {
    const float* const row = alpha.pixels.data() + int64_t{y} * width;
    for (int x = 0; x < width; ++x) {
      const float* const at = row + x;
      if (x % kStretch == 0 && x + kStretch < width && !MayShow(at, y + 1 < alpha.height ? width : 0)) {
        x += kStretch - 1;
        continue;
      }
      const auto index = at - alpha.pixels.data();
      const float of_cut = left_out.cut == nullptr ? 0 : left_out.cut[index];
      const float of_both = of_cut + (left_out.coarse == nullptr ? 0 : left_out.coarse[index]);
      const bool counts = !(of_both > kLeftOutShare * *at);
      int64_t& crossings = counts ? sums.crossings : of_cut > kLeftOutShare * *at ? sums.cut : sums.coarse;
      for (size_t b = 0; b + 1 < kOutlineBands.size() && counts; ++b) {
        if (*at >= kOutlineBands[b] && *at < kOutlineBands[b + 1]) ++sums.pixels[b];
      }
      if (x < 1 || y < 1 || x + 2 >= width || y + 2 >= alpha.height) continue;
      const auto [low, high] = std::minmax({at[0], at[1], at[width]});
      if (high < kOutlineLevels.front() || low >= kOutlineLevels.back() || low == high) continue;
      for (size_t level = 0; level < kOutlineLevels.size(); ++level) {
        const float value = kOutlineLevels[level];
        for (const auto& [along, across] : {std::pair(1, width), std::pair(width, 1)}) {
          const float begin = at[0], end = at[along];
          if ((begin < value) == (end < value)) continue;
          if (value == 0.5f) ++crossings;
          if (!counts) continue;
          const float t = (value - begin) / (end - begin);
          const float rise = 0.5f * ((1 - t) * (end - at[-along]) + t * (at[2 * along] - begin));
          const float aside =
              0.5f * ((1 - t) * (at[across] - at[-across]) + t * (at[along + across] - at[along - across]));
          const float gradient = std::max(kLeastGradient, std::sqrt(rise * rise + aside * aside));
          const double bin = (std::log(pixel / double{gradient}) - kFirst) / kStep;
          sums.widths[level][static_cast<size_t>(std::clamp(bin, 0.0, double{kBins - 1}))] +=
              std::fabs(double{rise}) / double{gradient};
        }
      }
    }
  }
}

void OutlineProfile::Add(const Image& alpha, double pixel, const float* cut, const float* coarse) {
  std::vector<Sums> parts(static_cast<size_t>((alpha.height + kProfileRowsPerTask - 1) / kProfileRowsPerTask));
  ParallelFor(0, alpha.height, kProfileRowsPerTask, [&](int64_t first, int64_t last) {
    AddRows(alpha, pixel, {cut, coarse}, static_cast<int>(first), static_cast<int>(last),
            parts[static_cast<size_t>(first / kProfileRowsPerTask)]);
  });
  for (const Sums& part : parts) {
    for (size_t level = 0; level < widths_.size(); ++level) {
      for (size_t k = 0; k < kBins; ++k) widths_[level][k] += part.widths[level][k];
    }
    for (size_t b = 0; b < areas_.size(); ++b) areas_[b] += static_cast<double>(part.pixels[b]) * pixel * pixel;
    length_ += static_cast<double>(part.crossings) * pixel;
    cut_ += static_cast<double>(part.cut) * pixel;
    coarse_ += static_cast<double>(part.coarse) * pixel;
  }
  last_pixel_ = pixel;
}

std::array<double, kOutlineValues> OutlineProfile::Values() const {
  std::array<double, kOutlineValues> out{};
  size_t next = 0;
  for (const auto& weights : widths_) {
    double total = 0;
    for (const double weight : weights) total += weight;
    for (const double quantile : kOutlineQuantiles) {
      double below = 0;
      size_t bin = 0;
      while (bin + 1 < kBins && below + weights[bin] < quantile * total) below += weights[bin++];
      const double inside = weights[bin] > 0 ? (quantile * total - below) / weights[bin] : 0.5;
      out[next++] = total > 0 ? kFirst + kStep * (static_cast<double>(bin) + inside) : 0;
    }
  }
  const double length = length_ + last_pixel_;
  for (size_t b = 0; b < areas_.size(); ++b) {
    const double area = areas_[b] + last_pixel_ * last_pixel_;
    out[next++] = std::log(area / (length * double{kOutlineBands[b + 1] - kOutlineBands[b]}));
  }
  return out;
}

}  // namespace anchorsplat
