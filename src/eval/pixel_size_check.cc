#include "eval/pixel_size_check.h"

#include <chrono>
#include <cmath>
#include <utility>

#include "eval/filter_sweep.h"

namespace anchorsplat {

namespace {
constexpr int kSamplesAside = 5;
constexpr double kSampleOctaves = 0.25;
}  // namespace

Result<PixelSizeCheck> CheckPixelSize(const BenchmarkObject& object, bool with_samples) {
  PixelSizeCheck check;
  check.object = object.name;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraPixelSizes truth, TruePixelSizes(object));
  check.truth = truth.median;
  const auto begin = std::chrono::steady_clock::now();
  ANCHORSPLAT_ASSIGN_OR_RETURN(check.estimate, EstimatePixelSize(object.low));
  check.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  ANCHORSPLAT_ASSIGN_OR_RETURN(PixelSizeProbe probe, PixelSizeProbe::Make(object.low));
  check.start = probe.start();
  for (int k = -kSamplesAside; with_samples && k <= kSamplesAside; ++k) {
    PixelSizeCheck::Sample sample;
    sample.size = check.truth * std::exp2(k * kSampleOctaves);
    ANCHORSPLAT_ASSIGN_OR_RETURN(sample.features, probe.At(sample.size));
    check.samples.push_back(sample);
  }
  return check;
}

}  // namespace anchorsplat
