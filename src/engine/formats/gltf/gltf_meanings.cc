#include "formats/gltf/gltf_meanings.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "core/parallel.h"
#include "core/text.h"
#include "formats/first_failure.h"
#include "formats/gltf/gltf_values.h"

namespace anchorsplat {

namespace {

using Accessor = GltfDocument::Accessor;

constexpr double kLeastShare = 0.01;      // fraction of forbidden values that shows intent
constexpr float kLeastNegative = 1e-6f;   // may count as zero in some programs
constexpr float kLeastOutside = 1e-3f;    // rounding error
constexpr float kMostPositiveLogit = 30;  // 100 and 255 mean opaque on other scales

struct Spread {
  int64_t known = 0, forbidden = 0;  // values except NaN
  float min = 0, max = 0;            // of the finite ones
};

template <typename Forbidden>
Result<Spread> SpreadOf(const Accessor& accessor, Forbidden&& forbidden) {
  constexpr int64_t kRows = 1 << 14;
  Spread spread;
  std::mutex mutex;
  FirstFailure failure;
  ParallelFor(0, accessor.count, kRows, [&](int64_t first, int64_t last) {
    Buffer<uint8_t> bytes;
    Buffer<float> values(static_cast<size_t>((last - first) * accessor.components));
    const Status status = ReadGltfBytes(accessor, first, last, bytes);
    if (!status.ok()) return failure.Report(first, status);
    UnpackGltfValues(accessor, bytes.data(), last - first, values.data(), accessor.components);
    Spread here;
    for (const float x : values) {
      if (std::isnan(x)) continue;
      ++here.known;
      here.forbidden += forbidden(x) ? 1 : 0;
      if (!std::isfinite(x)) continue;
      here.min = std::min(here.min, x);
      here.max = std::max(here.max, x);
    }
    const std::lock_guard lock(mutex);
    spread.known += here.known;
    spread.forbidden += here.forbidden;
    spread.min = std::min(spread.min, here.min);
    spread.max = std::max(spread.max, here.max);
  });
  ANCHORSPLAT_RETURN_IF_ERROR(failure.status());
  return spread;
}

bool IsMeant(const Spread& spread) {
  return static_cast<double>(spread.forbidden) >= kLeastShare * static_cast<double>(spread.known);
}

std::string Some(const Spread& spread) {
  return Cat(WithThousands(spread.forbidden), " of ", WithThousands(spread.known), " values");
}

}  // namespace

Result<bool> HoldsLogarithms(const JsonValue& attribute, const Accessor& scales) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Spread spread, SpreadOf(scales, [](float x) { return x < -kLeastNegative; }));
  if (spread.forbidden == 0) return false;
  if (IsMeant(spread)) return true;
  return attribute.Complain(Cat("has ", Some(spread), " below 0 (down to ", spread.min,
                                "): too many for lengths, too few for logarithms; the file is damaged"));
}

Result<bool> HoldsLogits(const JsonValue& attribute, const Accessor& opacities) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      const Spread spread, SpreadOf(opacities, [](float x) { return x < -kLeastOutside || x > 1 + kLeastOutside; }));
  if (spread.forbidden == 0) return false;
  if (IsMeant(spread) && (spread.min < -kLeastOutside || spread.max <= kMostPositiveLogit)) return true;
  return attribute.Complain(Cat("has ", Some(spread), " outside of 0 to 1 (from ", spread.min, " to ", spread.max,
                                "): neither opacities as in KHR_gaussian_splatting, nor logits"));
}

}  // namespace anchorsplat
