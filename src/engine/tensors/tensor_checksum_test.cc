#include "tensors/tensor_checksum.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "core/parallel.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"
#include "io/little_endian.h"
#include "tensors/safetensors.h"
#include "tensors/tensor_bytes_for_test.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;

std::string ProblemOf(const std::string& bytes) {
  const auto file = TensorFile::FromBytes(tensor_bytes::ToBuffer(bytes), "state");
  if (!file.ok()) return file.error().message;
  const Status status = VerifyChecksum(*file);
  return status.ok() ? "" : status.error().message;
}

TEST(TensorChecksum, FindsEveryFlippedBit) {
  const TestFolder folder;
  const std::vector<float> floats = {1, 2, 3, 4, 5, 6};
  const std::vector<int64_t> counts = {7, 8};
  const std::vector<TensorEntry> entries = {MakeEntry("a", {2, 3}, floats), MakeEntry("b", {2}, counts),
                                            MakeEntry("none", {0}, std::span<const float>())};
  const auto metadata = WithChecksum({{"step", "31"}, {"settings", R"({"seed":7})"}}, entries);
  ASSERT_TRUE(metadata.ok());
  ASSERT_TRUE(WriteSafetensors(folder / "state", entries, *metadata).ok());
  const std::string whole = FileBytes(folder / "state");
  ASSERT_EQ(ProblemOf(whole), "");
  // What fills the header up to 64 bytes means nothing.
  const size_t data = 8 + LoadLittleEndian<uint64_t>(reinterpret_cast<const std::byte*>(whole.data())),
               filling = whole.rfind('}', data) + 1;
  for (size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    if (bit / 8 >= filling && bit / 8 < data) continue;
    std::string damaged = whole;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
    ASSERT_NE(ProblemOf(damaged), "") << "bit " << bit % 8 << " of byte " << bit / 8;
  }
  std::string damaged = whole;
  damaged.back() = 1;
  EXPECT_THAT(ProblemOf(damaged), HasSubstr("state: is damaged"));
}

TEST(TensorChecksum, FilesWithoutOneSaySo) {
  const TestFolder folder;
  ASSERT_TRUE(WriteSafetensors(folder / "state", {}, {{"step", "31"}}).ok());
  EXPECT_THAT(ProblemOf(FileBytes(folder / "state")), HasSubstr("has no checksum"));
}

// Of more than one chunk, of other strides, by any number of threads; and of a sum that is already there.
TEST(TensorChecksum, IsThatOfTheValues) {
  std::vector<float> values(3 << 18);
  std::iota(values.begin(), values.end(), 0.0f);
  const std::vector<TensorEntry> entries = {MakeEntry("a", {3, 1 << 18}, values)};
  SetThreadCount(1);
  const auto one = WithChecksum({}, entries);
  SetThreadCount(0);
  EXPECT_EQ(*WithChecksum({}, entries), *one);
  EXPECT_EQ(*WithChecksum(*one, entries), *one);

  std::vector<float> turned(values.size());
  for (size_t row = 0; row < 3; ++row) {
    for (size_t column = 0; column < 1 << 18; ++column) turned[3 * column + row] = values[(row << 18) + column];
  }
  TensorEntry strided = MakeEntry("a", {3, 1 << 18}, turned);
  strided.strides = {1, 3};
  EXPECT_EQ(*WithChecksum({}, std::span(&strided, 1)), *one);
  values.back() += 1;
  EXPECT_NE(*WithChecksum({}, entries), *one);
}

}  // namespace
}  // namespace anchorsplat
