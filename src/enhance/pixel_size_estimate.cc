#include "enhance/pixel_size_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

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
// At least that much on either side (ln) for compensated splats: of a kind that nobody has seen their estimate is off
// by 24 % in the median (docs/results/pixel-size.md).
constexpr double kLeastHalfOfCompensated = 0.5;
// Strangeness up to which the regression of standard fits is believed, and from which on that of many kinds is alone.
constexpr double kStandard = 0.6, kOther = 0.9;
// The same of the Gaussians' sizes in units of the standard regression's estimate, by the deviations of fits of many
// kinds with their true pixels: 1 on average, and much more where the estimate is several times too large.
constexpr double kPlausible = 1.5, kImplausible = 2.2;
// PixelSizeProbe::showing() up to which strangeness counts, and from which on not at all.
constexpr double kFewShow = kStandardShowing, kMostShow = 0.75;
// Where outlines are stranger than these, what the two regressions say is compared although most Gaussians show: close
// pictures, whose edges cut through the object, leave outlines that the standard one takes for pixels two to five times
// too large. The other one then says 0.83 of that and less (ten splats, down to 0.39); of 76 fits like standard ones
// nine with such outlines do, four of them less than 0.75.
constexpr double kFamiliarOutlines = 0.6, kOddOutlines = 0.75;
constexpr double kAgreeing = 0.85, kDisagreeing = 0.7;
// The regression of many kinds may come to rest at two sizes, the smaller of them 0.3 to 0.5 of the truth: MCMC of few
// steps, whose noise has left it with Gaussians of all sizes. Where it ends so far below the standard one (ln), it is
// begun there, too, and the larger size is taken if the smaller one is strange and it is hardly stranger itself. Of 600
// splats that is so in six, all for the better; of those whose standard estimate is three times too large and more,
// the smaller size is at 0.7 to 1.1 (but grass, 1.3), or the larger one 1.6 times as strange, or 25 times as large.
constexpr double kFarBelow = 0.4, kOfSmaller = 1.25, kStrangeRest = 1.25, kHardlyStranger = 1.2;
constexpr double kHalfOfTwo = 0.6;  // of the interval then, at least; ln
// Outlines of fits to soft pictures say pixels that are 1.6 to 2.2 times too large. From the first on (ln) that counts,
// from the second on all of it.
constexpr double kHardlySoft = 0.3, kSoft = 0.5, kMostSoft = 1;
// No correction of what both say is larger; ln.
constexpr double kMostCorrection = 0.5;
// How much of a correction upwards is left: pixels that are too large blur.
constexpr double kUpwards = 0.5;

struct Guess {
  double step = 0;  // ln(pixel size / d)
  double strangeness = 0;
};

// Root mean square of the deviations.
double Strangeness(std::span<const double> features, std::span<const double> mean, std::span<const double> deviation) {
  double sum = 0;
  for (size_t k = 0; k < features.size(); ++k) {
    const double z = (features[k] - mean[k]) / deviation[k];
    sum += z * z;
  }
  return std::sqrt(sum / static_cast<double>(features.size()));
}

template <size_t kFeatures>
Guess Regress(const PixelSizeCoefficients<kFeatures>& c, const std::array<double, kFeatures>& features) {
  Guess guess{c.intercept, Strangeness(features, c.mean, c.deviation)};
  for (size_t k = 0; k < kFeatures; ++k) {
    const double z = (features[k] - c.mean[k]) / c.deviation[k];
    guess.step += c.weight[k] * std::clamp(z, -kMostDeviations, kMostDeviations);
  }
  return guess;
}

// Where a regression ends.
struct Settled {
  double log_size = 0;
  double half = 0;  // of the interval, ln
  double strangeness = 0;
};

// `features_at` (size) → Result<std::array>.
template <size_t kFeatures, typename FeaturesAt>
Result<Settled> Settle(const PixelSizeCoefficients<kFeatures>& coefficients, double size, FeaturesAt&& features_at) {
  Guess guess;
  for (int round = 0; round < kMostRounds; ++round) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto features, features_at(size));
    guess = Regress(coefficients, features);
    const double most = kMostOctaves * std::log(2.0);
    size *= std::exp(std::clamp(guess.step, -most, most));
    if (std::abs(guess.step) < kSettled) break;
  }
  const double half =
      kInterval * coefficients.error + std::abs(guess.step) + kWidening * std::max(0.0, guess.strangeness - kFamiliar);
  return Settled{std::log(size), half, guess.strangeness};
}

// What the looks show, then sizes without the number of Gaussians.
template <size_t kLookCount>
Result<std::array<double, kLookCount * kPixelSizeFeatures + kSizeFeatures - 1>> FeaturesOf(
    const std::array<Look, kLookCount>& looks, PixelSizeProbe& probe, double size) {
  std::array<double, kLookCount * kPixelSizeFeatures + kSizeFeatures - 1> features;
  auto out = features.begin();
  for (const Look look : looks) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const PixelSizeFeatures of_look, probe.At(size, look));
    out = std::ranges::copy(of_look, out).out;
  }
  const SizeFeatures sizes = probe.SizesAt(size);
  std::copy_n(sizes.begin(), kSizeFeatures - 1, out);
  return features;
}

double StrangenessOfSizes(const PixelSizeProbe& probe, double size) {
  const SizeFeatures sizes = probe.SizesAt(size);
  constexpr size_t kFirst = 2 * kPixelSizeFeatures, kCount = kKindsPixelSizeFeatures - kFirst;
  return Strangeness(std::span(sizes).first(kCount), std::span(kKindsPixelSize.mean).subspan(kFirst),
                     std::span(kKindsPixelSize.deviation).subspan(kFirst));
}

// ln(true pixel size / size), as far as fits of many kinds tell what the regressions leave. Between two known kinds it
// is smooth; far from all of them the landmarks say nothing, and the straight part is cut off.
Result<double> Correction(const PixelSizeCorrection& c, PixelSizeProbe& probe, double size) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(auto z, FeaturesOf(std::array{Look::kAlpha}, probe, size));
  double sum = c.intercept;
  for (size_t k = 0; k < z.size(); ++k) {
    z[k] = std::clamp((z[k] - c.mean[k]) / c.deviation[k], -kMostDeviations, kMostDeviations);
    sum += c.weight[k] * z[k];
  }
  for (size_t l = 0; l < kCorrectionLandmarks; ++l) {
    double squares = 0;
    for (size_t k = 0; k < z.size(); ++k) squares += std::pow(z[k] - double{c.landmark[l][k]}, 2);
    sum += c.height[l] * std::exp(-0.5 * squares / static_cast<double>(z.size()));
  }
  return std::clamp(sum, -kMostCorrection, kMostCorrection);
}

double Share(double strangeness, double none, double all) {
  return std::clamp((strangeness - none) / (all - none), 0.0, 1.0);
}

// What to multiply `size` by.
Result<double> Softness(PixelSizeProbe& probe, double size) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(auto features, FeaturesOf(std::array{Look::kAlpha}, probe, size));
  // Smallest axes that are next to nothing, as those of 2DGS, say nothing.
  for (size_t k = kPixelSizeFeatures; k < kPixelSizeFeatures + kSizeQuantiles; ++k) {
    const double mean = kSoftPixelSize.mean[k];
    if (features[k] < mean - kMostDeviations * kSoftPixelSize.deviation[k]) features[k] = mean;
  }
  const double step = std::max(Regress(kSoftPixelSize, features).step, -kMostSoft);
  return std::exp(Share(-step, kHardlySoft, kSoft) * std::min(0.0, step));
}

// Where the regression of many kinds ends, from below; `standard`: where that of standard fits does.
Result<Settled> SettleKinds(PixelSizeProbe& probe, const Settled& standard) {
  const auto from = [&](double start) {
    return Settle(kKindsPixelSize, start, [&](double size) {
      return FeaturesOf(std::array{Look::kAlpha, Look::kAntialiased}, probe, size);
    });
  };
  ANCHORSPLAT_ASSIGN_OR_RETURN(Settled kinds, from(probe.start()));
  if (kinds.strangeness < kStrangeRest || kinds.log_size > standard.log_size - kFarBelow) return kinds;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Settled larger, from(std::exp(standard.log_size)));
  const double apart = larger.log_size - kinds.log_size;
  if (apart < 0 || apart > kOfSmaller || larger.strangeness > kHardlyStranger * kinds.strangeness) return kinds;
  return Settled{larger.log_size, std::max(larger.half, kHalfOfTwo), larger.strangeness};
}

PixelSizeEstimate EstimateOf(const Settled& settled, const PixelSizeProbe& probe, Look look) {
  const double size = std::exp(settled.log_size), spread = std::exp(settled.half);
  return PixelSizeEstimate{.size = size,
                           .low = size / spread,
                           .high = size * spread,
                           .strangeness = settled.strangeness,
                           .showing = probe.showing(),
                           .of_antialiased = look == Look::kAntialiased,
                           .cut_outlines = probe.CutOutlines(size, look),
                           .coarse_outlines = probe.CoarseOutlines(size, look)};
}

// Outlines of antialiased fits are narrower than those of classic ones.
Result<PixelSizeEstimate> EstimateAntialiased(PixelSizeProbe& probe) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(Settled settled, Settle(kAntialiasedPixelSize, probe.start(), [&](double size) {
                                 return FeaturesOf(std::array{Look::kAntialiased}, probe, size);
                               }));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const double correction,
                               Correction(kAntialiasedPixelSizeCorrection, probe, std::exp(settled.log_size)));
  settled.log_size += correction;
  settled.half = std::max(settled.half, kLeastHalfOfCompensated);
  return EstimateOf(settled, probe, Look::kAntialiased);
}

}  // namespace

Result<PixelSizeEstimate> EstimatePixelSize(const GaussianCloud& cloud) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(PixelSizeProbe probe, PixelSizeProbe::Make(cloud));
  return EstimatePixelSize(probe, cloud.render_mode);
}

Result<PixelSizeEstimate> EstimatePixelSize(PixelSizeProbe& probe, std::optional<RenderMode> mode) {
  if (mode == RenderMode::kAntialiased) return EstimateAntialiased(probe);
  ANCHORSPLAT_ASSIGN_OR_RETURN(Settled settled,
                               Settle(kStandardPixelSize, probe.start(), [&](double size) { return probe.At(size); }));
  double share = std::max(Share(settled.strangeness, kStandard, kOther),
                          Share(StrangenessOfSizes(probe, std::exp(settled.log_size)), kPlausible, kImplausible));
  double like_standard = IsCompensated(mode) ? 0 : Share(probe.showing(), kFewShow, kMostShow);
  const double doubtful = like_standard * Share(settled.strangeness, kFamiliarOutlines, kOddOutlines);
  share *= 1 - like_standard;
  double disagreement = 1;
  if (share > 0 || doubtful > 0) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Settled kinds, SettleKinds(probe, settled));
    if (doubtful > 0) {
      disagreement = std::min(1.0, std::exp(kinds.log_size - settled.log_size));
      const double doubt = doubtful * Share(disagreement, kAgreeing, kDisagreeing);
      like_standard -= doubt;
      share = std::max(share, doubt);
    }
    // It may only lower the estimate. Splats that have lost less width than classic ones and do not say so, such as
    // antialiased ones, look like fits of smaller pixels to the standard regression, which is what they need.
    settled.log_size = std::min(settled.log_size, std::lerp(settled.log_size, kinds.log_size, share));
    settled.half = std::lerp(settled.half, kinds.half, share);
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const double correction,
                               Correction(kPixelSizeCorrection, probe, std::exp(settled.log_size)));
  settled.log_size += (1 - like_standard) * (correction > 0 ? kUpwards : 1) * correction;
  double softness = 1;
  if (IsCompensated(mode)) {
    settled.half = std::max(settled.half, kLeastHalfOfCompensated);
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(softness, Softness(probe, std::exp(settled.log_size)));
    settled.log_size += std::log(softness);
    settled.half -= std::log(softness) / 2;
  }
  PixelSizeEstimate estimate = EstimateOf(settled, probe, Look::kAlpha);
  estimate.softness = softness;
  estimate.unlike_standard = share;
  estimate.disagreement = disagreement;
  return estimate;
}

}  // namespace anchorsplat
