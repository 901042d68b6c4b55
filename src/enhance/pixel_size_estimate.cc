#include "enhance/pixel_size_estimate.h"

#include <algorithm>
#include <cmath>

#include "enhance/pixel_size_coefficients.h"
#include "enhance/pixel_size_features.h"

namespace anchorsplat {

namespace {

// Features this many deviations from what the regression has seen count as that far: beyond, a straight line means
// nothing.
constexpr double kMostDeviations = 3;
constexpr double kMostOctaves = 1;  // per round
constexpr int kMostRounds = 12;
constexpr double kSettled = 0.005;  // ln
// The interval holds the true value for 95 % of splats like those of the regression.
constexpr double kInterval = 2;
// Root mean square of the features' deviations from which on a splat counts as unlike those of the regression (they
// have 1 on average), and how much wider the interval becomes for each one more.
constexpr double kFamiliar = 1.4, kWidening = 0.25;
// Outlines of antialiased fits are narrower than those of the classic ones of the regression: it says 0.44 to 0.86 of
// the truth for eight of them. Divided by this much it is too large by at most a tenth in all of them.
constexpr double kAntialiasedLook = 0.8;

struct Guess {
  double step = 0;         // ln(pixel size / d)
  double strangeness = 0;  // root mean square of the deviations
};

Guess Regress(const PixelSizeFeatures& features) {
  const PixelSizeCoefficients& c = kPixelSizeCoefficients;
  Guess guess{c.intercept, 0};
  for (size_t k = 0; k < features.size(); ++k) {
    const double z = (features[k] - c.mean[k]) / c.deviation[k];
    guess.step += c.weight[k] * std::clamp(z, -kMostDeviations, kMostDeviations);
    guess.strangeness += z * z;
  }
  guess.strangeness = std::sqrt(guess.strangeness / static_cast<double>(features.size()));
  return guess;
}

}  // namespace

Result<PixelSizeEstimate> EstimatePixelSize(const GaussianCloud& cloud) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(PixelSizeProbe probe, PixelSizeProbe::Make(cloud));
  double size = probe.start();
  Guess guess;
  for (int round = 0; round < kMostRounds; ++round) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const PixelSizeFeatures features, probe.At(size));
    guess = Regress(features);
    const double most = kMostOctaves * std::log(2.0);
    size *= std::exp(std::clamp(guess.step, -most, most));
    if (std::abs(guess.step) < kSettled) break;
  }
  const double spread = std::exp(kInterval * kPixelSizeCoefficients.error + std::abs(guess.step) +
                                 kWidening * std::max(0.0, guess.strangeness - kFamiliar));
  if (cloud.render_mode == RenderMode::kAntialiased) size /= kAntialiasedLook;
  return PixelSizeEstimate{size, size / spread, size * spread};
}

}  // namespace anchorsplat
