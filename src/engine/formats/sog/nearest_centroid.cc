#include "formats/sog/nearest_centroid.h"

#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "formats/sog/nearest_centroid.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once per target.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void NearestOfAll(const int16_t* HWY_RESTRICT points, int64_t count, const int16_t* HWY_RESTRICT centroids,
                  int64_t entries, int64_t width, uint16_t* HWY_RESTRICT nearest) {
  const hn::CappedTag<int16_t, 16> d16;
  const hn::RepartitionToWide<decltype(d16)> d32;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d16));
  for (int64_t i = 0; i < count; ++i) {
    const int16_t* point = points + i * width;
    int32_t best = std::numeric_limits<int32_t>::max();
    int64_t best_entry = 0;
    for (int64_t c = 0; c < entries; ++c) {
      const int16_t* centroid = centroids + c * width;
      auto even = hn::Zero(d32);
      auto odd = hn::Zero(d32);
      for (int64_t k = 0; k < width; k += lanes) {
        const auto difference = hn::Sub(hn::LoadU(d16, point + k), hn::LoadU(d16, centroid + k));
        even = hn::ReorderWidenMulAccumulate(d32, difference, difference, even, odd);
      }
      const int32_t distance = hn::GetLane(hn::SumOfLanes(d32, hn::Add(even, odd)));
      if (distance < best) {
        best = distance;
        best_entry = c;
      }
    }
    nearest[i] = static_cast<uint16_t>(best_entry);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(NearestOfAll);

void NearestCentroids(const int16_t* points, int64_t count, const int16_t* centroids, int64_t entries, int64_t width,
                      uint16_t* nearest) {
  HWY_DYNAMIC_DISPATCH(NearestOfAll)(points, count, centroids, entries, width, nearest);
}

}  // namespace anchorsplat
#endif  // HWY_ONCE
