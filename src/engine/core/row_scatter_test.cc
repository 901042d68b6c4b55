#include "core/row_scatter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"

namespace anchorsplat {
namespace {

// One bucket, several, and several that the last piece or chunk does not fill.
TEST(ScatterRows, PutsEveryRowIntoItsPlace) {
  for (const int64_t n : {0, 1, 7, 1000, 70'001}) {
    for (const int64_t width : {1, 3, 48}) {
      Random random(static_cast<uint64_t>(n + width));
      std::vector<int32_t> places(static_cast<size_t>(n));
      std::iota(places.begin(), places.end(), 0);
      for (size_t i = places.size(); i > 1; --i) std::swap(places[i - 1], places[random.Below(i)]);
      std::vector<float> values(static_cast<size_t>(n * width));
      std::iota(values.begin(), values.end(), 0.0f);
      std::vector<float> expected(values.size());
      for (int64_t i = 0; i < n; ++i) {
        std::copy_n(values.begin() + i * width, width, expected.begin() + places[static_cast<size_t>(i)] * width);
      }
      const size_t first = static_cast<size_t>(n / 3 * width), second = static_cast<size_t>(n / 2 * width);
      const std::span<const float> all(values);
      const std::vector<std::span<const float>> pieces = {all.first(first), all.subspan(first, 0),
                                                          all.subspan(first, second - first), all.subspan(second)};
      for (const int threads : {1, 3}) {
        SetThreadCount(threads);
        const Buffer<float> out = ScatterRows(pieces, width, places);
        EXPECT_TRUE(std::ranges::equal(out, expected)) << n << " rows of " << width;
      }
      SetThreadCount(0);
    }
  }
}

}  // namespace
}  // namespace anchorsplat
