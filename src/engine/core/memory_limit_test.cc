#include "core/memory_limit.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <iterator>
#include <numeric>
#include <optional>
#include <string>

#include "core/buffer.h"

namespace anchorsplat {
namespace {

constexpr size_t kMegabyte = size_t{1} << 20;

class MemoryLimitTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "anchorsplat-test-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  bool folder_is_empty() const {
    return std::filesystem::directory_iterator(folder_) == std::filesystem::directory_iterator();
  }

  std::filesystem::path folder_;
};

TEST_F(MemoryLimitTest, WhatIsBeyondLiesInFilesWithoutNames) {
  const MemoryLimit limit(10 * kMegabyte, folder_);
  Buffer<uint8_t> first(8 * kMegabyte, 1), small(kMegabyte, 2);
  EXPECT_EQ(limit.most_on_disk(), 0u);
  Buffer<uint8_t> second(8 * kMegabyte, 3);
  EXPECT_EQ(limit.most_on_disk(), 8 * kMegabyte);
  EXPECT_TRUE(folder_is_empty());
  std::iota(second.begin(), second.end(), uint8_t{0});
  Buffer<uint8_t> third = std::move(second);
  third.resize(9 * kMegabyte);  // from file to file, where it gets twice the room
  EXPECT_EQ(third[8 * kMegabyte - 1], 255);
  EXPECT_EQ(limit.most_on_disk(), 24 * kMegabyte);
  Buffer<uint8_t>().swap(first);  // makes room in memory
  const Buffer<uint8_t> fourth(8 * kMegabyte);
  EXPECT_EQ(limit.most_on_disk(), 24 * kMegabyte);
}

TEST_F(MemoryLimitTest, LargestGetHalf) {
  const MemoryLimit limit(100 * kMegabyte, folder_);
  const Buffer<uint8_t> large(64 * kMegabyte);
  EXPECT_EQ(limit.most_on_disk(), 64 * kMegabyte);
  const Buffer<uint8_t> medium(60 * kMegabyte);
  EXPECT_EQ(limit.most_on_disk(), 64 * kMegabyte);
}

TEST_F(MemoryLimitTest, BuffersOutliveIt) {
  Buffer<int> kept, before(2 * kMegabyte, 4);
  {
    const MemoryLimit limit(0, folder_);
    kept.assign(2 * kMegabyte, 7);
    before.resize(4 * kMegabyte, 5);  // from memory to a file
    EXPECT_EQ(limit.most_on_disk(), 24 * kMegabyte);
  }
  EXPECT_EQ(kept.back(), 7);
  EXPECT_EQ(before.front(), 4);
  EXPECT_EQ(before.back(), 5);
  Buffer<int>().swap(kept);
  Buffer<int>().swap(before);
  const MemoryLimit next(0, folder_);
  EXPECT_EQ(next.most_on_disk(), 0u);
}

TEST_F(MemoryLimitTest, NoRoomOnDiskIsAnErrorThatNamesTheFolder) {
  const MemoryLimit limit(0, folder_ / "none");
  try {
    const Buffer<uint8_t> buffer(8 * kMegabyte);
    FAIL() << "made in a folder that is not there";
  } catch (const DiskFull& none) {
    EXPECT_NE(std::string(none.what()).find((folder_ / "none").string()), std::string::npos) << none.what();
  }
  const MemoryLimit other(0, folder_);
  EXPECT_THROW(Buffer<uint8_t>(size_t{1} << 60), std::bad_alloc);  // more than any disk has
}

TEST(MachineMemory, IsThere) { EXPECT_GT(MachineMemory(), 64 * kMegabyte); }

}  // namespace
}  // namespace anchorsplat
