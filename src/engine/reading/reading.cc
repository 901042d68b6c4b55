#include "reading/reading.h"

#include <algorithm>
#include <cmath>

#include "core/text.h"

namespace anchorsplat {

Provenance Reading::likeliest() const {
  double full_width = 0;
  for (size_t k = 0; k < kProvenanceCount; ++k)
    full_width += HasFullWidth(static_cast<Provenance>(k)) ? provenance[k] : 0;
  const bool has_full_width = full_width > kLossWeight * (1 - full_width);
  size_t best = kProvenanceCount;
  for (size_t k = 0; k < kProvenanceCount; ++k) {
    if (HasFullWidth(static_cast<Provenance>(k)) != has_full_width) continue;
    if (best == kProvenanceCount || provenance[k] > provenance[best]) best = k;
  }
  return static_cast<Provenance>(best);
}

std::string DescribeProvenance(const Reading& reading) {
  const Provenance made = reading.likeliest();
  return Cat(Describe(made), " (", std::lround(100 * std::min(reading.probability(made), 0.99)), " %)");
}

Reading ReadFrom(const SplatFeatures& features, const ReadingModel& model) {
  Reading reading;
  reading.unit = features.unit;
  reading.strangeness = model.Strangeness(features.values);
  static const size_t share =
      static_cast<size_t>(std::ranges::find(FeatureNames(), "count.share_showing") - FeatureNames().begin());
  reading.visible_share = features.values[share];
  reading.predictions = model.Predict(features.values);
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
