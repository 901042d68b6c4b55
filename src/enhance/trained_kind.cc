#include "enhance/trained_kind.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/run_context.h"
#include "core/statistics.h"
#include "enhance/cloud_shape.h"
#include "enhance/enhanced_look.h"
#include "enhance/showing_gaussians.h"
#include "enhance/two_sides.h"

namespace anchorsplat {

namespace {

constexpr int64_t kFewest = 400;  // eight in the shorter tail: enough to see where all end
constexpr int64_t kFew = 1000;    // below, there is more doubt
constexpr double kShorter = 0.02, kLonger = 0.05;

// Of smallest axes: 0.30 and more in both, up to 0.08 in those of Mip-Splatting, 0.15 to 0.31 in what the network
// makes.
constexpr double kWidenedTail = 0.12, kThinTail = 0.35;
// docs/results/recognised.md has the tails of fits. Of middle axes, times exp(−opaque): up to 0.24 in 58 antialiased
// ones and 0.29 in a dense one, 0.34 and more in classic ones of 6,000 steps, and 0.25 and more in most of few steps or
// of small pictures. An antialiased one that is taken for classic gains 1.1 dB in the mean (−0.6 to +2.5 of five), a
// classic one that is taken for antialiased nothing (down to −1.3), and one that is unclear a fifth of what it could.
struct TailBounds {
  double antialiased, classic;  // of middle axes: below the first; from the second on
  double antialiased_of_few;
  double thin;  // of smallest axes, rather round ones: below, nothing is clear
};
constexpr TailBounds kTails = {0.25, 0.25, 0.25, 0.31};
// What networks made of one or the other lies between. Here sizes say little, and weaker odds of that are enough.
constexpr TailBounds kTailsOfEnhanced = {0.335, 0.36, 0.28, kThinTail};
constexpr double kClassicTailOfFew = 0.42;
// What a training leaves is uneven: middle axes of antialiased fits have tails of 0.08 and more, and 7 % and more of
// what shows is fainter than 0.3. Converters of meshes make Gaussians all alike, and who throws the faint ones away
// leaves the opaque ones among the thinnest: both look antialiased, and would be drawn too faint as such.
constexpr double kLeastTail = 0.03, kLeastFaint = 0.02, kFaintOpacity = 0.3;
// A width that was added is in all axes: the smallest are nearly half as long as the middle ones then. Flat Gaussians,
// whose third axis other programs write as nearly nothing, also end at one size.
constexpr double kRound = 0.4;

// ln of the odds. Sizes that are like those of no fit are mostly those of a network. Where twins have harmonics of
// their own it can only be one that made one of each, which has odds of 1.5 and more (235 files); fits of 2,000 to
// 3,000 steps are at −2 to 0.9.
constexpr double kEnhancedOdds = 0, kEnhancedOddsWhereUnclear = -2, kEnhancedOddsOfOwnHarmonics = 1.3;

double Tail(std::span<float> logarithms, double share) {
  const auto quantile = double{Quantile(logarithms, share)};
  double sum = 0;
  for (const float x : logarithms) sum += std::max(0.0, quantile - double{x});
  return sum / (share * static_cast<double>(logarithms.size()));
}

constexpr double kThinnest = 0.1;
constexpr float kOpaque = 0.95f;

// Of (ln(middle × largest axis), opacity).
double OpaqueShare(std::vector<std::pair<float, float>>& items) {
  const auto count = static_cast<std::ptrdiff_t>(kThinnest * static_cast<double>(items.size()));
  if (count == 0) return 0;
  std::nth_element(items.begin(), items.begin() + count, items.end());
  const auto opaque =
      std::count_if(items.begin(), items.begin() + count, [](const auto& item) { return item.second > kOpaque; });
  return static_cast<double>(opaque) / static_cast<double>(count);
}

// The share of sizes that a format cut off, as SPZ does at e^−10: all are the least, and few are next to it. Where a
// width was added, more are next to the least than are it, whatever the steps of the format.
constexpr double kCutOff = 0.01;  // less matters little
constexpr float kNext = 0.07f;    // a step of SPZ and a little
double ShareCutOff(std::span<const float> logarithms) {
  const float least = *std::ranges::min_element(logarithms);
  const auto cut = std::ranges::count(logarithms, least);
  const auto next = std::ranges::count_if(logarithms, [&](float x) { return x > least && x <= least + kNext; });
  const double share = static_cast<double>(cut) / static_cast<double>(logarithms.size());
  return share >= kCutOff && cut > 2 * next ? share : 0;
}

// Opacities of fits go down to nothing: 7 % and more of those that show are fainter than 0.3 (4 in a teddy bear). Where
// the faint ones were thrown away they begin all at once: the lowest hundredth is 0.08 to 0.11 times as far (in logits)
// from the lowest as the lowest tenth is from it. Where they were raised by three logits it is 0.63 to 0.72 times as
// far, and where they were set to one, or to no less than something, a tenth have the same.
constexpr double kFewFaint = 0.03, kBeginsAtOnce = 0.35, kSameOpacity = 0.02;
bool WereRaised(std::span<float> logits, double faint) {
  if (faint >= kFewFaint || logits.empty()) return false;
  const auto least = double{Quantile(logits, 0.001)}, low = double{Quantile(logits, 0.01)};
  const auto tenth = double{Quantile(logits, 0.1)};
  return tenth - least < kSameOpacity || low - least > kBeginsAtOnce * (tenth - low);
}

// `cut`: ShareCutOff() of them.
double MeanTail(std::span<float> logarithms, double cut) {
  if (cut > 0) {
    // What is left of the tail: of some more than are cut.
    return Tail(logarithms, std::clamp(1.3 * cut, kLonger, 0.5));
  }
  return std::sqrt(Tail(logarithms, kShorter) * Tail(logarithms, kLonger));
}

std::optional<TrainedKind> JudgeBy(const SizeTails& tails, const TailBounds& bounds) {
  if (tails.gaussians < kFewest) return std::nullopt;
  if (tails.roundness > kRound && tails.smallest < kWidenedTail) return TrainedKind::kWidened;
  // Where a format cut off a part of the smallest axes, a tail that is a little shorter says nothing.
  const bool rather_thick = tails.rather_round() && tails.smallest < kThinTail && tails.cut_off == 0;
  if (rather_thick && tails.smallest < bounds.thin) return TrainedKind::kUnclear;
  if (tails.raised && tails.middle >= kLeastTail) return TrainedKind::kRaised;
  const double tail = tails.middle * std::exp(-tails.opaque);
  if (tails.middle < kLeastTail || tails.faint < kLeastFaint) {
    return tail < kClassicTailOfFew ? TrainedKind::kUnclear : TrainedKind::kClassic;
  }
  const bool few = tails.gaussians < kFew;
  if (tail < (few ? bounds.antialiased_of_few : bounds.antialiased)) {
    return rather_thick ? TrainedKind::kUnclear : TrainedKind::kAntialiased;
  }
  return tail < (few ? kClassicTailOfFew : bounds.classic) ? TrainedKind::kUnclear : TrainedKind::kClassic;
}

}  // namespace

std::string_view NameOf(TrainedKind kind) {
  switch (kind) {
    case TrainedKind::kAntialiased:
      return "antialiased";
    case TrainedKind::kWidened:
      return "widened";
    case TrainedKind::kEnhanced:
      return "enhanced";
    case TrainedKind::kRaised:
      return "raised";
    case TrainedKind::kUnclear:
      return "unclear";
    default:
      return "classic";
  }
}

SizeTails SizeTailsOf(const GaussianCloud& showing) {
  SizeTails tails;
  Buffer<float> smallest, middle, logits;
  std::vector<std::pair<float, float>> areas;
  for (size_t i = 0; i < showing.opacity_logits.size(); ++i) {
    const float* scales = showing.log_scales.data() + 3 * i;
    std::array<float, 3> axes = {scales[0], scales[1], scales[2]};
    std::sort(axes.begin(), axes.end());
    if (!std::isfinite(axes[0])) continue;  // flat
    smallest.push_back(axes[0]);
    middle.push_back(axes[1]);
    logits.push_back(showing.opacity_logits[i]);
    areas.emplace_back(axes[1] + axes[2], Sigmoid(showing.opacity_logits[i]));
  }
  tails.gaussians = static_cast<int64_t>(middle.size());
  if (middle.empty()) return tails;
  LeaveIfAbandoned();
  tails.cut_off = ShareCutOff(smallest);
  tails.smallest = MeanTail(smallest, tails.cut_off);
  LeaveIfAbandoned();
  tails.middle = MeanTail(middle, ShareCutOff(middle));
  LeaveIfAbandoned();
  tails.roundness = std::exp(double{Quantile(smallest, kLonger)} - double{Quantile(middle, kLonger)});
  tails.opaque = OpaqueShare(areas);
  const auto faint = std::ranges::count_if(areas, [](const auto& item) { return double{item.second} < kFaintOpacity; });
  tails.faint = static_cast<double>(faint) / static_cast<double>(areas.size());
  tails.raised = WereRaised(logits, tails.faint);
  return tails;
}

namespace {

// Land seen from above is where sizes do not tell: antialiased fits to it by MCMC are at 0.24 to 0.34, classic ones of
// few steps at 0.27 to 0.36 (docs/results/recognised.md, land).
constexpr double kClassicTailOfLand = 0.365;

bool MayBeAntialiasedLand(const SizeTails& tails, const GaussianCloud& showing) {
  if (tails.gaussians < kFew || tails.middle * std::exp(-tails.opaque) >= kClassicTailOfLand) return false;
  LeaveIfAbandoned();
  return ShapeOf(showing).is_flat() && !TwoSidesOf(showing).both_were_shown();
}

}  // namespace

std::optional<TrainedKind> Judge(const SizeTails& tails) { return JudgeBy(tails, kTails); }

std::optional<TrainedKind> TrainedKindOf(const GaussianCloud& showing, const WholeCloud& whole) {
  const SizeTails tails = SizeTailsOf(showing);
  auto by_sizes = Judge(tails);
  if (by_sizes == TrainedKind::kClassic && MayBeAntialiasedLand(tails, showing)) by_sizes = TrainedKind::kUnclear;
  if (!by_sizes || by_sizes == TrainedKind::kWidened || HasQuaternionsOfTraining(showing)) return by_sizes;
  LeaveIfAbandoned();
  FoundTwins twins;
  const auto look = FindEnhancedLook(showing, tails, &twins);
  if (!look || twins.unrelated) return by_sizes;
  const double odds = LogOddsOfEnhanced(*look);
  const bool unclear = JudgeBy(tails, kTailsOfEnhanced) == TrainedKind::kUnclear;
  if (odds <= (unclear ? kEnhancedOddsWhereUnclear : kEnhancedOdds)) return by_sizes;
  if (odds < kEnhancedOddsOfOwnHarmonics && whole.harmonics) {
    const auto likeness = LikenessOfHarmonics(whole.harmonics(), whole.rows, twins);
    if (likeness && *likeness < kOwnHarmonics) return by_sizes;
  }
  return TrainedKind::kEnhanced;
}

std::optional<TrainedKind> TrainedKindOf(const CloudView& cloud, const ShowingGaussians& showing) {
  return TrainedKindOf(showing.all, {showing.rows_of_all, [&] { return cloud; }});
}

std::optional<TrainedKind> BesideTag(std::optional<TrainedKind> kind, std::optional<RenderMode> tag, int64_t showing) {
  if (!tag || (kind == TrainedKind::kRaised && tag != RenderMode::kMip)) return kind;
  const bool counts = tag == RenderMode::kAntialiased || (tag == RenderMode::kClassic && showing >= kFew);
  return counts && IsWide(kind) ? kind : std::nullopt;
}

}  // namespace anchorsplat
