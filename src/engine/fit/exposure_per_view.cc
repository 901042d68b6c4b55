#include "fit/exposure_per_view.h"

#include <cmath>

#include "core/text.h"
#include "fit/view_exposure.h"

namespace anchorsplat {

Buffer<float> NoExposures(int64_t views) {
  Buffer<float> exposures(static_cast<size_t>(6 * views));
  for (size_t i = 0; i < exposures.size(); ++i) exposures[i] = i % 6 < 3 ? 1.0f : 0.0f;
  return exposures;
}

Status FollowExposure(const Image& rendered, int64_t view, Image& picture, Buffer<float>& exposures) {
  const auto views = static_cast<int64_t>(exposures.size() / 6);
  if (view < 0 || view >= views) {
    return Error{ErrorCode::kBadArgument, Cat("view ", view, " does not exist: there are ", views, " exposures")};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewExposure measured, EstimateExposure(rendered, picture));
  float* own = exposures.data() + 6 * view;
  ViewExposure applied;
  for (size_t c = 0; c < 3; ++c) {
    own[c] += kExposureRate * (static_cast<float>(measured.gain[c]) - own[c]);
    own[3 + c] += kExposureRate * (static_cast<float>(measured.bias[c]) - own[3 + c]);
    double log_gain = 0, bias = 0;
    for (int64_t v = 0; v < views; ++v) {
      log_gain += std::log(double{exposures[static_cast<size_t>(6 * v) + c]});
      bias += double{exposures[static_cast<size_t>(6 * v + 3) + c]};
    }
    applied.gain[c] = double{own[c]} / std::exp(log_gain / static_cast<double>(views));
    applied.bias[c] = double{own[3 + c]} - bias / static_cast<double>(views);
  }
  RemoveExposure(applied, picture);
  return {};
}

}  // namespace anchorsplat
