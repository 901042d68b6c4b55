#include "eval/summary.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/random.h"

namespace anchorsplat {

namespace {

constexpr int kSamples = 10000;

// Percentile of sorted `values` by linear interpolation.
double PercentileOf(const std::vector<double>& values, double q) {
  const double at = q * static_cast<double>(values.size() - 1);
  const size_t below = static_cast<size_t>(at);
  const size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (at - static_cast<double>(below)) * (values[above] - values[below]);
}

// Paired results of two methods.
struct Gains {
  std::vector<double> values, weights;
  int64_t wins = 0;
};

double Weight(const MethodResult& result, Protocol protocol) {
  return protocol == Protocol::kUpstream ? static_cast<double>(result.views.size()) : 1.0;
}

Gains GainsOver(const Evaluation& evaluation, const std::string& method, const std::string& other) {
  Gains gains;
  for (const MethodResult& result : evaluation.results) {
    if (result.method != method) continue;
    const MethodResult* baseline = evaluation.Find(result.object, other);
    if (baseline == nullptr) continue;
    const double gain = result.MeanPsnr() - baseline->MeanPsnr();
    gains.values.push_back(gain);
    gains.weights.push_back(Weight(result, evaluation.protocol));
    if (gain > 0) ++gains.wins;
  }
  return gains;
}

}  // namespace

Interval BootstrapMean(const std::vector<double>& values, const std::vector<double>& weights, uint64_t seed) {
  double sum = 0, weight = 0;
  for (size_t i = 0; i < values.size(); ++i) {
    sum += weights[i] * values[i];
    weight += weights[i];
  }
  Interval interval{sum / weight, sum / weight, sum / weight};
  if (!std::isfinite(interval.mean)) return interval;
  Random random(seed);
  std::vector<double> means(kSamples);
  const int64_t count = static_cast<int64_t>(values.size());
  for (double& mean : means) {
    sum = weight = 0;
    for (int64_t k = 0; k < count; ++k) {
      const size_t i = static_cast<size_t>(random.Below(count));
      sum += weights[i] * values[i];
      weight += weights[i];
    }
    mean = sum / weight;
  }
  std::sort(means.begin(), means.end());
  interval.low = PercentileOf(means, 0.025);
  interval.high = PercentileOf(means, 0.975);
  return interval;
}

std::vector<MethodSummary> Summarise(const Evaluation& evaluation, uint64_t seed) {
  std::vector<MethodSummary> summaries;
  for (const std::string& method : evaluation.methods) {
    std::vector<double> psnr, ssim, lpips, weights;
    MethodSummary summary;
    summary.method = method;
    for (const MethodResult& result : evaluation.results) {
      if (result.method != method) continue;
      psnr.push_back(result.MeanPsnr());
      ssim.push_back(result.MeanSsim());
      if (const auto value = result.MeanLpips()) lpips.push_back(*value);
      weights.push_back(Weight(result, evaluation.protocol));
      summary.seconds += result.seconds;
      summary.gaussians += static_cast<double>(result.gaussians);
    }
    if (psnr.empty()) continue;
    summary.objects = static_cast<int64_t>(psnr.size());
    summary.seconds /= static_cast<double>(psnr.size());
    summary.gaussians /= static_cast<double>(psnr.size());
    summary.psnr = BootstrapMean(psnr, weights, seed);
    summary.ssim = BootstrapMean(ssim, weights, seed);
    if (lpips.size() == psnr.size()) summary.lpips = BootstrapMean(lpips, weights, seed);
    const Gains raw = GainsOver(evaluation, method, "raw");
    if (method != "raw" && !raw.values.empty()) summary.gain_over_raw = BootstrapMean(raw.values, raw.weights, seed);
    const Gains filter = GainsOver(evaluation, method, "filter");
    if (method != "filter" && !filter.values.empty()) {
      summary.gain_over_filter = BootstrapMean(filter.values, filter.weights, seed);
      summary.compared_with_filter = static_cast<int64_t>(filter.values.size());
      summary.wins_over_filter = filter.wins;
    }
    summaries.push_back(std::move(summary));
  }
  return summaries;
}

namespace {

std::optional<WorstObject> WorstOver(const Evaluation& evaluation, const std::string& method, const std::string& over) {
  std::optional<WorstObject> worst;
  if (method == over) return worst;
  for (const MethodResult& result : evaluation.results) {
    const MethodResult* baseline = result.method == method ? evaluation.Find(result.object, over) : nullptr;
    if (baseline == nullptr) continue;
    const double gain = result.MeanPsnr() - baseline->MeanPsnr();
    // NaN is the difference of two infinities, of identical pictures.
    if (std::isnan(gain) || (worst && gain >= worst->gain)) continue;
    worst = WorstObject{result.object, method, KindOf(evaluation, result.object), over, gain};
  }
  return worst;
}

// The evaluation restricted to objects of one kind.
Evaluation OfKind(const Evaluation& evaluation, const std::string& kind) {
  Evaluation part;
  part.protocol = evaluation.protocol;
  part.max_views = evaluation.max_views;
  part.lpips = evaluation.lpips;
  part.methods = evaluation.methods;
  for (size_t i = 0; i < evaluation.kinds.size(); ++i) {
    if (evaluation.kinds[i] != kind) continue;
    part.objects.push_back(evaluation.objects[i]);
    part.kinds.push_back(kind);
  }
  for (const MethodResult& result : evaluation.results) {
    if (KindOf(evaluation, result.object) == kind) part.results.push_back(result);
  }
  return part;
}

}  // namespace

std::string KindOf(const Evaluation& evaluation, const std::string& object) {
  const auto found = std::find(evaluation.objects.begin(), evaluation.objects.end(), object);
  const size_t place = static_cast<size_t>(found - evaluation.objects.begin());
  return place < evaluation.kinds.size() ? evaluation.kinds[place] : std::string();
}

std::vector<KindSummary> SummariseKinds(const Evaluation& evaluation, uint64_t seed) {
  const std::set<std::string> kinds(evaluation.kinds.begin(), evaluation.kinds.end());
  std::vector<KindSummary> summaries;
  if (kinds.size() < 2) return summaries;
  for (const std::string& kind : kinds) {
    const Evaluation part = OfKind(evaluation, kind);
    for (MethodSummary& summary : Summarise(part, seed)) {
      std::optional<WorstObject> worst;
      if (summary.method != "raw") worst = WorstOver(part, summary.method, "raw");
      if (summary.method != "raw" && !worst) worst = WorstOver(part, summary.method, "filter");
      summaries.push_back({kind, std::move(summary), std::move(worst)});
    }
  }
  return summaries;
}

std::optional<WorstObject> WorstOverRaw(const Evaluation& evaluation) {
  std::optional<WorstObject> worst;
  for (const std::string& method : evaluation.methods) {
    auto candidate = WorstOver(evaluation, method, "raw");
    if (candidate && (!worst || candidate->gain < worst->gain)) worst = std::move(candidate);
  }
  return worst;
}

std::optional<PixelSizeError> SummarisePixelSizes(const Evaluation& evaluation) {
  std::vector<double> errors;
  for (const MethodResult& result : evaluation.results) {
    const auto ratio = result.facts.find("pixel_size_ratio");
    if (ratio != result.facts.end()) errors.push_back(std::abs(NumberOf(ratio->second) - 1));
  }
  if (errors.empty()) return std::nullopt;
  std::sort(errors.begin(), errors.end());
  return PixelSizeError{static_cast<int64_t>(errors.size()), PercentileOf(errors, 0.5), PercentileOf(errors, 0.95)};
}

}  // namespace anchorsplat
