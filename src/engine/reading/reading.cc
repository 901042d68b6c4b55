#include "reading/reading.h"

#include <algorithm>
#include <cmath>

#include "core/text.h"

namespace anchorsplat {

Made Reading::likeliest() const {
  double have_theirs = 0;
  for (size_t k = 0; k < kMadeCount; ++k) have_theirs += HasItsWidth(static_cast<Made>(k)) ? made[k] : 0;
  const bool has_its_width = have_theirs > kLossesCount * (1 - have_theirs);
  size_t best = kMadeCount;
  for (size_t k = 0; k < kMadeCount; ++k) {
    if (HasItsWidth(static_cast<Made>(k)) != has_its_width) continue;
    if (best == kMadeCount || made[k] > made[best]) best = k;
  }
  return static_cast<Made>(best);
}

std::string LooksInWords(const Reading& reading) {
  const Made made = reading.likeliest();
  return Cat(InWords(made), " (", std::lround(100 * std::min(reading.probability(made), 0.99)), " %)");
}

Reading ReadFrom(const SplatFeatures& features, const ReadingModel& model) {
  Reading reading;
  reading.unit = features.unit;
  reading.strangeness = model.Strangeness(features.values);
  static const size_t share =
      static_cast<size_t>(std::ranges::find(FeatureNames(), "count.share_showing") - FeatureNames().begin());
  reading.showing = features.values[share];
  reading.opinions = model.OpinionsOf(features.values);
  const auto members = static_cast<double>(reading.opinions.size());
  double middle = 0, spread = 0, apart = 0;
  for (const ReadingOpinion& opinion : reading.opinions) {
    middle += opinion.log_pixel / members;
    spread += std::exp(opinion.log_spread) / members;
    const double most = std::ranges::max(opinion.logits);
    double sum = 0;
    for (const double logit : opinion.logits) sum += std::exp(logit - most);
    for (size_t k = 0; k < kMadeCount; ++k) reading.made[k] += std::exp(opinion.logits[k] - most) / sum / members;
  }
  for (const ReadingOpinion& opinion : reading.opinions) {
    apart += (opinion.log_pixel - middle) * (opinion.log_pixel - middle) / members;
  }
  const double half = model.interval() * std::hypot(spread, std::sqrt(apart));
  reading.pixel = reading.unit * std::exp(middle);
  reading.low = reading.pixel * std::exp(-half);
  reading.high = reading.pixel * std::exp(half);
  return reading;
}

Result<Reading> Read(const CloudView& cloud, const ShowingGaussians& showing, const ReadingModel& model) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SplatFeatures features, FeaturesOf(cloud, showing));
  return ReadFrom(features, model);
}

Result<Reading> Read(const CloudView& cloud, const ReadingModel& model) {
  return Read(cloud, FindShowingGaussians(cloud), model);
}

}  // namespace anchorsplat
