#include "reading/reading.h"

#include <algorithm>
#include <cmath>

#include "core/statistics.h"
#include "core/text.h"

namespace anchorsplat {

Provenance Reading::likeliest() const {
  double full_width = 0;
  for (size_t k = 0; k < kProvenanceCount; ++k)
    full_width += HasFullWidth(static_cast<Provenance>(k)) ? provenance[k] : 0;
  const bool has_full_width = full_width > kFinishedWeight * (1 - full_width);
  size_t best = kProvenanceCount;
  for (size_t k = 0; k < kProvenanceCount; ++k) {
    if (HasFullWidth(static_cast<Provenance>(k)) != has_full_width) continue;
    if (best == kProvenanceCount || provenance[k] > provenance[best]) best = k;
  }
  return static_cast<Provenance>(best);
}

double LikeliestShrink(const Reading& reading, double pixel, std::span<const double> shrinks) {
  double best = shrinks[0], most = 0;
  for (size_t k = 0; k < shrinks.size(); ++k) {
    const double log_size = std::log(pixel / shrinks[k] / reading.unit);
    double density = 0;  // of the members' Laplace distributions
    for (const ReadingPrediction& prediction : reading.predictions) {
      density += std::exp(-std::abs(log_size - prediction.log_pixel) / std::exp(prediction.log_spread) -
                          prediction.log_spread);
    }
    density *= k == 0 ? kAsGiven : (1 - kAsGiven) / static_cast<double>(shrinks.size() - 1);
    if (density > most) {
      most = density;
      best = shrinks[k];
    }
  }
  return best;
}

std::string DescribeProvenance(const Reading& reading) {
  const Provenance made = reading.likeliest();
  return Cat(Describe(made), " (", std::lround(100 * std::min(reading.probability(made), 0.99)), " %)");
}

namespace {

// Combines the pixel read off the whole with the median of those read off its places, by their precision. Their errors
// are alike, so agreement makes the result no more certain than the more certain one; disagreement makes it less so.
void CombineWithPlaces(const SplatFeatures& whole, const ReadingModel& model,
                       std::vector<ReadingPrediction>& predictions) {
  if (whole.places.size() < 2) return;
  std::vector<Buffer<float>> pixels(predictions.size()), spreads(predictions.size());
  for (const SplatFeatures& place : whole.places) {
    const std::vector<ReadingPrediction> own = model.Predict(place.values);
    for (size_t m = 0; m < own.size(); ++m) {
      pixels[m].push_back(static_cast<float>(own[m].log_pixel + std::log(place.unit / whole.unit)));
      spreads[m].push_back(static_cast<float>(own[m].log_spread));
    }
  }
  for (size_t m = 0; m < predictions.size(); ++m) {
    ReadingPrediction& prediction = predictions[m];
    const double pixel{Quantile(pixels[m], 0.5)}, log_spread{Quantile(spreads[m], 0.5)};
    const double share = 1 / (1 + std::exp(2 * (log_spread - prediction.log_spread)));
    const double apart = pixel - prediction.log_pixel;
    prediction.log_pixel += share * apart;
    prediction.log_spread = std::log(
        std::hypot(std::exp(std::min(prediction.log_spread, log_spread)), std::sqrt(share * (1 - share)) * apart));
  }
}

}  // namespace

Reading ReadFrom(const SplatFeatures& features, const ReadingModel& model) {
  Reading reading;
  reading.unit = features.unit;
  reading.strangeness = model.Strangeness(features.values);
  reading.predictions = model.Predict(features.values);
  CombineWithPlaces(features, model, reading.predictions);
  const auto members = static_cast<double>(reading.predictions.size());
  double middle = 0, spread = 0, apart = 0;
  for (const ReadingPrediction& prediction : reading.predictions) {
    middle += prediction.log_pixel / members;
    spread += std::exp(prediction.log_spread) / members;
    const double most = std::ranges::max(prediction.logits);
    double sum = 0;
    for (const double logit : prediction.logits) sum += std::exp(logit - most);
    for (size_t k = 0; k < kProvenanceCount; ++k)
      reading.provenance[k] += std::exp(prediction.logits[k] - most) / sum / members;
  }
  for (const ReadingPrediction& prediction : reading.predictions) {
    apart += (prediction.log_pixel - middle) * (prediction.log_pixel - middle) / members;
  }
  const double half = model.interval() * std::hypot(spread, std::sqrt(apart));
  reading.pixel = reading.unit * std::exp(middle);
  reading.low = reading.pixel * std::exp(-half);
  reading.high = reading.pixel * std::exp(half);
  return reading;
}

Result<Reading> Read(const CloudView& cloud, const VisibleGaussians& visible, const ReadingModel& model) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SplatFeatures features, FeaturesOf(cloud, visible));
  return ReadFrom(features, model);
}

Result<Reading> Read(const CloudView& cloud, const ReadingModel& model) {
  return Read(cloud, FindVisibleGaussians(cloud), model);
}

}  // namespace anchorsplat
