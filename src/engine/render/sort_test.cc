#include "render/sort.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <numeric>
#include <vector>

#include "core/random.h"

namespace anchorsplat {
namespace {

// Rows by SortCpu with so many chunks, and by the standard library.
void ExpectSorted(const std::vector<uint32_t>& keys, int64_t chunks) {
  std::vector<int32_t> expected(keys.size());
  std::iota(expected.begin(), expected.end(), 0);
  std::vector<int32_t> rows = expected;
  std::stable_sort(expected.begin(), expected.end(),
                   [&](int32_t a, int32_t b) { return keys[static_cast<size_t>(a)] < keys[static_cast<size_t>(b)]; });
  std::vector<uint32_t> work = keys, spare_keys(keys.size()),
                        histograms(static_cast<size_t>(chunks * kSortBuckets), 0xdeadbeef);
  std::vector<int32_t> spare_rows(keys.size());
  SortCpu({static_cast<int64_t>(keys.size()), work.data(), rows.data(), spare_keys.data(), spare_rows.data(), chunks,
           histograms.data()});
  EXPECT_EQ(rows, expected) << keys.size() << " keys, " << chunks << " chunks";
}

TEST(Sort, MatchesStableSort) {
  Random random(1);
  for (const size_t count : {0, 1, 2, 3, 100, 4097, 30000}) {
    for (const int64_t chunks : {1, 2, 7}) {
      std::vector<uint32_t> keys(count);
      for (uint32_t& key : keys) key = static_cast<uint32_t>(random.Next());  // all 32 bits: three passes
      ExpectSorted(keys, chunks);
      for (uint32_t& key : keys) key = std::bit_cast<uint32_t>(static_cast<float>(random.Uniform(1, 2)));
      ExpectSorted(keys, chunks);
      for (uint32_t& key : keys) key = 0xfffffff0u + static_cast<uint32_t>(random.Below(16));  // many ties, one pass
      ExpectSorted(keys, chunks);
    }
  }
}

TEST(Sort, TheWholeRangeOfKeys) {
  ExpectSorted({0xffffffffu, 0, 0x80000000u, 0x7fffffffu, 1, 0xfffffffeu, 0, 0xffffffffu}, 3);
}

TEST(Sort, EqualKeysStayInOrder) { ExpectSorted(std::vector<uint32_t>(5000, 42), 4); }

}  // namespace
}  // namespace anchorsplat
