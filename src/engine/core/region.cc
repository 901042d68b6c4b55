#include "core/region.h"

#include <algorithm>
#include <cmath>

namespace anchorsplat {

Region RelativeToOrigin(Region region, const WorldOrigin& origin) {
  region.low = RelativeToOrigin(region.low, origin);
  region.high = RelativeToOrigin(region.high, origin);
  return region;
}

std::optional<Region> RegionOf(std::span<const double> numbers) {
  if (numbers.size() != 4 && numbers.size() != 6) return std::nullopt;
  if (!std::ranges::all_of(numbers, [](double x) { return std::isfinite(x); })) return std::nullopt;
  Region region;
  if (numbers.size() == 4) {
    if (!(numbers[3] > 0)) return std::nullopt;
    region.radius = numbers[3];
  }
  for (size_t c = 0; c < 3; ++c) {
    const double other = region.radius ? numbers[c] : numbers[c + 3];
    region.low[c] = std::min(numbers[c], other);
    region.high[c] = std::max(numbers[c], other);
  }
  return region;
}

}  // namespace anchorsplat
