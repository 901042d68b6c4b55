#include "enhance/trained_kind.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "core/statistics.h"
#include "enhance/showing_gaussians.h"

namespace anchorsplat {

namespace {

constexpr int64_t kFewest = 500;  // ten in the shorter tail
constexpr double kShorter = 0.02, kLonger = 0.05;

// docs/results/recognised.md has the tails of fits: of middle axes 0.40 and more in classic ones, up to 0.37 in
// antialiased ones; of smallest axes 0.30 and more in both, up to 0.08 in those of Mip-Splatting, 0.15 to 0.31 in what
// the network makes.
constexpr double kAntialiasedTail = 0.375, kClassicTail = 0.4;
constexpr double kWidenedTail = 0.12, kThinTail = 0.35;
// A width that was added is in all axes: the smallest are nearly half as long as the middle ones then. Flat Gaussians,
// whose third axis other programs write as nearly nothing, also end at one size.
constexpr double kRound = 0.4, kRatherRound = 0.3;

double Tail(std::span<float> logarithms, double share) {
  const auto quantile = double{Quantile(logarithms, share)};
  double sum = 0;
  int64_t count = 0;
  for (const float x : logarithms) {
    if (x > quantile) continue;
    sum += quantile - double{x};
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

double MeanTail(std::span<float> logarithms) {
  return std::sqrt(Tail(logarithms, kShorter) * Tail(logarithms, kLonger));
}

}  // namespace

std::string_view NameOf(TrainedKind kind) {
  switch (kind) {
    case TrainedKind::kAntialiased:
      return "antialiased";
    case TrainedKind::kWidened:
      return "widened";
    case TrainedKind::kUnclear:
      return "unclear";
    default:
      return "classic";
  }
}

SizeTails FindSizeTails(const GaussianCloud& cloud) {
  SizeTails tails;
  Buffer<float> smallest, middle;
  for (const int64_t i : FindShowingGaussians(cloud).all) {
    const float* scales = cloud.log_scales.data() + 3 * i;
    std::array<float, 3> axes = {scales[0], scales[1], scales[2]};
    std::sort(axes.begin(), axes.end());
    if (!std::isfinite(axes[0])) continue;  // flat
    smallest.push_back(axes[0]);
    middle.push_back(axes[1]);
  }
  tails.gaussians = static_cast<int64_t>(middle.size());
  if (middle.empty()) return tails;
  tails.smallest = MeanTail(smallest);
  tails.middle = MeanTail(middle);
  tails.roundness = std::exp(double{Quantile(smallest, kLonger)} - double{Quantile(middle, kLonger)});
  return tails;
}

TrainedKind Judge(const SizeTails& tails) {
  if (tails.gaussians < kFewest) return TrainedKind::kClassic;
  if (tails.roundness > kRound && tails.smallest < kWidenedTail) return TrainedKind::kWidened;
  if (tails.roundness > kRatherRound && tails.smallest < kThinTail) return TrainedKind::kUnclear;
  if (tails.middle < kAntialiasedTail) return TrainedKind::kAntialiased;
  return tails.middle < kClassicTail ? TrainedKind::kUnclear : TrainedKind::kClassic;
}

TrainedKind FindTrainedKind(const GaussianCloud& cloud) { return Judge(FindSizeTails(cloud)); }

}  // namespace anchorsplat
