#include "reading/treatment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace anchorsplat {

namespace {

// Number of pixel sizes tried to either side of the unit: a quarter octave apart, four octaves each.
constexpr int kTried = 16;
constexpr double kTriedStep = 0.25;
// A Laplace distribution as five equal parts: their medians, in mean absolute errors.
constexpr std::array<double, 5> kParts = {-1.609, -0.511, 0, 0.511, 1.609};

double UnsquashGain(double squashed) { return 2 * std::sinh(squashed / 2); }

struct Expectation {
  double gain = 0, loss = 0;  // expectations of the squashed gain, and of its part below zero, sign changed
};

// Predicted at a multiple of the true pixel (given as ln). Below the measured multiples both fall to zero with the
// square; above them the gain falls on linearly, and what it falls is lost.
Expectation At(const ReadingPrediction& prediction, size_t treatment, double log_multiple) {
  constexpr size_t kLast = kGainMultiples.size() - 1;
  static const std::array<double, kLast + 1> multiples = [] {
    std::array<double, kLast + 1> out;
    std::ranges::transform(kGainMultiples, out.begin(), [](double multiple) { return std::log(multiple); });
    return out;
  }();
  const auto& gains = prediction.gains[treatment];
  const auto& losses = prediction.losses[treatment];
  if (log_multiple < multiples[0]) {
    const double share = std::exp(2 * (log_multiple - multiples[0]));
    return {gains[0] * share, losses[0] * share};
  }
  if (log_multiple > multiples[kLast]) {
    const double slope = std::min(-1.0, (gains[kLast] - gains[kLast - 1]) / (multiples[kLast] - multiples[kLast - 1]));
    const double fall = slope * (log_multiple - multiples[kLast]);
    return {gains[kLast] + fall, losses[kLast] - fall};
  }
  size_t k = 0;
  while (k + 2 < multiples.size() && log_multiple > multiples[k + 1]) ++k;
  const double part = (log_multiple - multiples[k]) / (multiples[k + 1] - multiples[k]);
  return {gains[k] * (1 - part) + gains[k + 1] * part, losses[k] * (1 - part) + losses[k + 1] * part};
}

// Expectation over ensemble members and the pixel sizes each considers possible.
Expectation Expect(const Reading& reading, size_t treatment, double log_size, bool is_known) {
  Expectation sum;
  const double weight = 1.0 / static_cast<double>(reading.predictions.size() * (is_known ? 1 : kParts.size()));
  for (const ReadingPrediction& prediction : reading.predictions) {
    for (const double part : kParts) {
      // A known pixel is the true one, so the multiple is exact.
      const double off = is_known ? 0 : log_size - prediction.log_pixel - std::exp(prediction.log_spread) * part;
      const Expectation at = At(prediction, treatment, off);
      sum.gain += weight * at.gain;
      sum.loss += weight * at.loss;
      if (is_known) break;
    }
  }
  return sum;
}

// Tries all possible pixel sizes.
void Try(const Reading& reading, const TreatmentRequest& request, RenderMode mode, bool network, Treatment& best,
         double& best_score) {
  for (int step = request.pixel ? kTried : -kTried; step <= kTried; ++step) {
    const double log_size = request.pixel ? std::log(*request.pixel / reading.unit) : step * kTriedStep * std::log(2.0);
    const Expectation expected = Expect(reading, GainOf(mode, network), log_size, request.pixel.has_value());
    const double score = expected.gain - request.loss_weight * expected.loss;
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
    // Without a tag, Mip-Splatting splats are rendered as classic, whatever is known.
    if (request.mode ? mode != *request.mode : mode == RenderMode::kMip) continue;
    for (const bool network : {false, true}) {
      if (network ? !request.network : !request.filter) continue;
      Try(reading, request, mode, network, best, best_score);
    }
  }
  // A known pixel lowers the risk.
  if (request.pixel ? best.gain > 0 : best_score > 0) return best;
  if (!request.mode_is_given) {
    best.method = TreatmentMethod::kNone;
  } else if (!request.pixel) {  // a given pixel is believed: such splats have lost that width
    best.method = request.network ? TreatmentMethod::kNetwork : TreatmentMethod::kFilter;
    best.pixel = reading.low;
    best.gain = 0;
  }
  return best;
}

}  // namespace anchorsplat
