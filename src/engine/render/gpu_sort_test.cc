#include "render/gpu_sort.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <vector>

#include "core/random.h"
#include "gpu/gpu_for_test.h"

namespace anchorsplat {
namespace {

using Numbers = std::vector<uint32_t>;

GpuMemory MemoryOf(GpuDevice& device, const Numbers& values, uint64_t bytes) {
  GpuMemory memory = device.Allocate(std::max<uint64_t>(4, bytes), "numbers of a test").value();
  if (!values.empty()) device.Write(*memory, 0, std::as_bytes(std::span(values)));
  return memory;
}

Numbers ReadNumbers(GpuDevice& device, const GpuBuffer& buffer, size_t count) {
  Numbers values(count);
  const GpuRead read = {&buffer, 0, std::as_writable_bytes(std::span(values))};
  const Status status = count > 0 ? device.Read({&read, 1}) : device.Wait();
  EXPECT_TRUE(status.ok()) << status.error().message;
  return values;
}

class GpuSortTest : public testing::Test {
 protected:
  void SetUp() override {
    device_ = GpuForTest();
    if (device_ == nullptr) GTEST_FAIL() << "no device";
  }

  // `room` for more items than there are: the host need not know how many these are.
  void ExpectSorted(const Numbers& keys, int bits, uint64_t room) {
    Numbers expected(keys.size());
    std::iota(expected.begin(), expected.end(), 0u);
    const Numbers rows = expected;
    std::stable_sort(expected.begin(), expected.end(), [&](uint32_t a, uint32_t b) { return keys[a] < keys[b]; });
    const std::array<GpuMemory, 2> key_memory = {MemoryOf(*device_, keys, 4 * room), MemoryOf(*device_, {}, 4 * room)};
    const std::array<GpuMemory, 2> row_memory = {MemoryOf(*device_, rows, 4 * room), MemoryOf(*device_, {}, 4 * room)};
    const GpuMemory tables = MemoryOf(*device_, {}, GpuSortTableBytes(room));
    const GpuMemory sizes = MemoryOf(*device_, {7, static_cast<uint32_t>(keys.size()), 9}, 64);
    const GpuMemory totals = MemoryOf(*device_, {}, 64);
    const size_t sorted = SortOnGpu(*device_, {*sizes,
                                               kSizePairs,
                                               {key_memory[0].get(), key_memory[1].get()},
                                               {row_memory[0].get(), row_memory[1].get()},
                                               *tables,
                                               *totals,
                                               room,
                                               bits});
    EXPECT_EQ(ReadNumbers(*device_, *row_memory[sorted], keys.size()), expected) << keys.size() << " keys";
  }

  std::shared_ptr<GpuDevice> device_;
};

TEST_F(GpuSortTest, MatchesStableSort) {
  Random random(1);
  for (const size_t count : {0, 1, 2, 255, 256, 257, 2047, 2048, 2049, 4097, 100000}) {
    Numbers keys(count);
    for (uint32_t& key : keys) key = static_cast<uint32_t>(random.Next());
    ExpectSorted(keys, 32, count);
    for (uint32_t& key : keys) key = std::bit_cast<uint32_t>(static_cast<float>(random.Uniform(1, 2)));
    ExpectSorted(keys, 32, count + 5000);
    for (uint32_t& key : keys) key = static_cast<uint32_t>(random.Below(300));  // many ties, three passes
    ExpectSorted(keys, 9, count);
  }
}

TEST_F(GpuSortTest, TheWholeRangeOfKeys) {
  ExpectSorted({0xffffffffu, 0, 0x80000000u, 0x7fffffffu, 1, 0xfffffffeu, 0, 0xffffffffu}, 32, 8);
}

TEST_F(GpuSortTest, EqualKeysStayInOrder) { ExpectSorted(Numbers(5000, 42), 8, 5000); }

TEST_F(GpuSortTest, NoBitsNoWork) { ExpectSorted(Numbers(100, 0), 0, 100); }

TEST_F(GpuSortTest, SumsAreExact) {
  Random random(2);
  for (const size_t count : {0, 1, 2047, 2048, 2049, 100000}) {
    Numbers items(count);
    for (uint32_t& item : items) item = static_cast<uint32_t>(random.Below(1000));
    const uint64_t room = count + 3000;
    const GpuMemory memory = MemoryOf(*device_, items, GpuScanBytes(room));
    const GpuMemory sizes = MemoryOf(*device_, {static_cast<uint32_t>(count)}, 64);
    const GpuMemory totals = MemoryOf(*device_, {}, 64);
    ScanOnGpu(*device_, {*sizes, kSizeVisible, *memory, *totals, room});
    const Numbers scanned = ReadNumbers(*device_, *memory, GpuScanBytes(room) / 4);
    uint32_t sum = 0;
    size_t wrong = 0;
    for (size_t i = 0; i < count; ++i) {
      wrong += scanned[i] + scanned[room + i / kGpuBlock] != sum;
      sum += items[i];
    }
    EXPECT_EQ(wrong, 0u) << count << " items";
    EXPECT_EQ(ReadNumbers(*device_, *totals, 1)[0], sum);
  }
}

}  // namespace
}  // namespace anchorsplat
