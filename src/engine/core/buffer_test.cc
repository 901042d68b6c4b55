#include "core/buffer.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <numeric>

namespace anchorsplat {
namespace {

uintptr_t Address(const void* p) { return reinterpret_cast<uintptr_t>(p); }

TEST(Buffer, IsAlignedForVectorsAndHugePages) {
  for (const size_t size : {1, 3, 1000, 100'000}) {
    EXPECT_EQ(Address(Buffer<float>(size).data()) % 64, 0u) << size;
  }
  EXPECT_EQ(Address(Buffer<float>(3 << 20).data()) % (2 << 20), 0u);
}

TEST(Buffer, KeepsItsValuesAndSetsThoseGiven) {
  Buffer<int> buffer(5);
  std::iota(buffer.begin(), buffer.end(), 0);
  buffer.resize(3 << 20);  // through a move to huge pages
  for (int i = 0; i < 5; ++i) EXPECT_EQ(buffer[static_cast<size_t>(i)], i);
  EXPECT_EQ(Buffer<float>(7, 2.5f), (Buffer<float>{2.5f, 2.5f, 2.5f, 2.5f, 2.5f, 2.5f, 2.5f}));
  Buffer<int> copy = buffer;
  copy[0] = 9;
  EXPECT_EQ(buffer[0], 0);
}

TEST(Buffer, ElementsThatAreObjectsAreConstructed) {
  const Buffer<std::vector<int>> buffer(10);
  for (const auto& element : buffer) EXPECT_TRUE(element.empty());
}

TEST(Buffer, RefusesSizesThatOverflow) {
  UninitializedAllocator<double> allocator;
  EXPECT_THROW((void)allocator.allocate(std::numeric_limits<size_t>::max() / 4), std::bad_array_new_length);
}

}  // namespace
}  // namespace anchorsplat
