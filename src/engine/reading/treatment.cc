#include "reading/treatment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace anchorsplat {

namespace {

// Pixels that are tried, ln of the unit: a quarter octave apart, four octaves to either side.
constexpr int kTried = 16;
constexpr double kTriedStep = 0.25;
// A Laplace distribution in five parts of a fifth each: their middles, in mean absolute errors.
constexpr std::array<double, 5> kParts = {-1.609, -0.511, 0, 0.511, 1.609};

double UnsquashGain(double squashed) { return 2 * std::sinh(squashed / 2); }

constexpr double kLeast = 1e-6;  // deviations are above it

struct Curve {
  double gain, deviation;
};

// At a multiple of the true pixel, its ln given. Below those measured gains go to nothing with its square, beyond them
// they go on falling.
Curve At(const ReadingOpinion& opinion, size_t treatment, double log_multiple) {
  constexpr size_t kLast = kGainMultiples.size() - 1;
  static const std::array<double, kLast + 1> multiples = [] {
    std::array<double, kLast + 1> out;
    std::ranges::transform(kGainMultiples, out.begin(), [](double multiple) { return std::log(multiple); });
    return out;
  }();
  const auto& gains = opinion.gains[treatment];
  const auto& deviations = opinion.log_deviations[treatment];
  if (log_multiple < multiples[0]) {
    const double share = std::exp(2 * (log_multiple - multiples[0]));
    return {gains[0] * share, std::exp(deviations[0]) * share + kLeast};
  }
  if (log_multiple > multiples[kLast]) {
    const double slope = std::min(-1.0, (gains[kLast] - gains[kLast - 1]) / (multiples[kLast] - multiples[kLast - 1]));
    return {gains[kLast] + slope * (log_multiple - multiples[kLast]), std::exp(deviations[kLast])};
  }
  size_t k = 0;
  while (k + 2 < multiples.size() && log_multiple > multiples[k + 1]) ++k;
  const double part = (log_multiple - multiples[k]) / (multiples[k + 1] - multiples[k]);
  return {gains[k] * (1 - part) + gains[k + 1] * part,
          std::exp(deviations[k]) * (1 - part) + std::exp(deviations[k + 1]) * part};
}

struct Expectation {
  double gain = 0, loss = 0;  // means of what is squashed: of all, and of what lies below nothing
};

// Of a normal distribution: the mean of what lies below zero.
double MeanLoss(const Curve& of) {
  const double u = of.gain / of.deviation;
  const double density = std::exp(-0.5 * u * u) / std::sqrt(2 * std::numbers::pi);
  return of.deviation * density - of.gain * 0.5 * std::erfc(u / std::numbers::sqrt2);
}

// Over opinions and the pixels that each holds possible.
Expectation Expect(const Reading& reading, size_t treatment, double log_size, bool is_known) {
  Expectation sum;
  const double weight = 1.0 / static_cast<double>(reading.opinions.size() * (is_known ? 1 : kParts.size()));
  for (const ReadingOpinion& opinion : reading.opinions) {
    for (const double part : kParts) {
      // Of a pixel that is known, the size is the true one.
      const double off = is_known ? 0 : log_size - opinion.log_pixel - std::exp(opinion.log_spread) * part;
      const Curve at = At(opinion, treatment, off);
      sum.gain += weight * at.gain;
      sum.loss += weight * MeanLoss(at);
      if (is_known) break;
    }
  }
  return sum;
}

// All pixels that are possible.
void Try(const Reading& reading, const TreatmentRequest& request, RenderMode mode, bool network, Treatment& best,
         double& best_score) {
  for (int step = request.pixel ? kTried : -kTried; step <= kTried; ++step) {
    const double log_size = request.pixel ? std::log(*request.pixel / reading.unit) : step * kTriedStep * std::log(2.0);
    const Expectation expected = Expect(reading, GainOf(mode, network), log_size, request.pixel.has_value());
    const double score = expected.gain - request.losses_count * expected.loss;
    if (score <= best_score) continue;
    best_score = score;
    best.method = network ? TreatmentMethod::kNetwork : TreatmentMethod::kFilter;
    best.mode = mode;
    best.pixel = request.pixel.value_or(reading.unit * std::exp(log_size));
    best.gain = UnsquashGain(expected.gain);
  }
}

}  // namespace

Treatment Treat(const Reading& reading, const TreatmentRequest& request) {
  Treatment best;
  best.mode = request.mode.value_or(RenderMode::kClassic);
  double best_score = -std::numeric_limits<double>::infinity();
  for (const RenderMode mode : kRenderModes) {
    // Without a tag those of Mip-Splatting are drawn as classic ones, whatever is known.
    if (request.mode ? mode != *request.mode : mode == RenderMode::kMip) continue;
    for (const bool network : {false, true}) {
      if (network ? !request.network : !request.filter) continue;
      Try(reading, request, mode, network, best, best_score);
    }
  }
  // Who knows the pixel takes less of a risk.
  if (request.pixel ? best.gain > 0 : best_score > 0) return best;
  if (!request.mode_is_said) {
    best.method = TreatmentMethod::kNone;
  } else if (!request.pixel) {  // the caller is believed: it has lost the width that such splats have lost
    best.method = request.network ? TreatmentMethod::kNetwork : TreatmentMethod::kFilter;
    best.pixel = reading.low;
    best.gain = 0;
  }
  return best;
}

}  // namespace anchorsplat
