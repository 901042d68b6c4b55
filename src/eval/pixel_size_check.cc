#include "eval/pixel_size_check.h"

#include <chrono>
#include <cmath>
#include <utility>
#include <vector>

#include "eval/filter_sweep.h"
#include "eval/protocol.h"

namespace anchorsplat {

namespace {
constexpr int kSamplesAside = 5;
constexpr double kSampleOctaves = 0.25;
constexpr size_t kStrengthViews = 3;
}  // namespace

Result<PixelSizeCheck> CheckPixelSize(const BenchmarkObject& object, bool with_samples) {
  PixelSizeCheck check;
  check.object = object.name;
  check.mode = object.low.render_mode.value_or(RenderMode::kClassic);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraPixelSizes truth, TruePixelSizes(object));
  check.truth = truth.median;
  const auto begin = std::chrono::steady_clock::now();
  ANCHORSPLAT_ASSIGN_OR_RETURN(check.estimate, EstimatePixelSize(object.low));
  check.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  ANCHORSPLAT_ASSIGN_OR_RETURN(check.evidence, GatherPixelSizeEvidence(object.low));
  check.things = FindPixelSizesOfThings(object.low, {}, true).things;
  ANCHORSPLAT_ASSIGN_OR_RETURN(PixelSizeProbe probe, PixelSizeProbe::Make(object.low));
  check.start = probe.start();
  for (int k = -kSamplesAside; with_samples && k <= kSamplesAside; ++k) {
    PixelSizeCheck::Sample sample;
    sample.size = check.truth * std::exp2(k * kSampleOctaves);
    for (const Look look : {Look::kAlpha, Look::kAntialiased, Look::kOverBlack}) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const PixelSizeFeatures features, probe.At(sample.size, look));
      sample.features.insert(sample.features.end(), features.begin(), features.end());
    }
    const SizeFeatures sizes = probe.SizesAt(sample.size);
    sample.features.insert(sample.features.end(), sizes.begin(), sizes.end());
    check.samples.push_back(std::move(sample));
  }
  if (with_samples) {
    const std::vector<size_t> views = Thinned(object.held_out, kStrengthViews);
    ANCHORSPLAT_ASSIGN_OR_RETURN(check.best_strength,
                                 BestFilterStrength({.object = object, .views = views, .cache = {}}));
  }
  return check;
}

}  // namespace anchorsplat
