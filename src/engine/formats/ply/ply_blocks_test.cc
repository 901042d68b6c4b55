#include "formats/ply/ply_blocks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include "core/messages_for_test.h"
#include "core/statistics.h"
#include "core/text.h"
#include "formats/both_ways_for_test.h"
#include "formats/extra_properties.h"
#include "formats/opened_splat.h"
#include "formats/ply/ply_reader.h"
#include "formats/ply/ply_writer.h"
#include "formats/random_cloud_for_test.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

// What a file's blocks show is what reading it gives.
void ExpectBlocksOf(const std::filesystem::path& path) {
  const auto file = InputFile::Open(path);
  const auto read = ReadBothWays(ReadPly, BlocksOfPly, *file);
  ASSERT_TRUE(read.ok()) << read.error().message;
  const auto blocks = BlocksOfPly(*file, {});
  ASSERT_TRUE(blocks.ok()) << blocks.error().message;
  ASSERT_NE(*blocks, nullptr);
  StatisticsStudy study(**blocks);
  RowStudy* const studies[] = {&study};
  ASSERT_TRUE(Study(**blocks, studies).ok());
  const CloudStatistics streamed = study.Find(), expected = ComputeStatistics(*read);
  EXPECT_EQ(streamed.not_finite, expected.not_finite);
  EXPECT_EQ(streamed.largest_axis, expected.largest_axis);
  EXPECT_EQ(streamed.opacity, expected.opacity);
  EXPECT_EQ(streamed.outliers, expected.outliers);
}

TEST(PlyBlocks, ShowWhatReadingGives) {
  const TestFolder folder;
  for (int degree = 0; degree <= kMaxShDegree; ++degree) {
    for (const int64_t n : {int64_t{2}, int64_t{700}, 5 * kCloudBlockRows + 3}) {
      GaussianCloud cloud = CloudWithNonFinite(n, degree);
      cloud.comments = {"a comment"};
      ASSERT_TRUE(WritePly(folder / "a.ply", cloud, {.overwrite = true}).ok());
      SCOPED_TRACE(testing::Message() << n << " Gaussians of degree " << degree);
      ExpectBlocksOf(folder / "a.ply");
    }
  }
}

// As of two files one behind the other.
TEST(PlyBlocks, BytesThatNobodyReadsAreSaid) {
  const TestFolder folder;
  const GaussianCloud cloud = CloudWithNonFinite(30, 1);
  ASSERT_TRUE(WritePly(folder / "a.ply", cloud).ok());
  const std::string whole = FileBytes(folder / "a.ply");
  const auto warnings = [&](const std::string& behind) {
    std::ofstream(folder / "a.ply", std::ios::binary) << whole << behind;
    Messages messages;
    const auto file = InputFile::Open(folder / "a.ply");
    EXPECT_TRUE(ReadPly(*file, {}).ok());
    const std::vector<std::string> of_reader = messages.TakeWarnings();
    const auto blocks = BlocksOfPly(*file, {});
    EXPECT_TRUE(blocks.ok() && (*blocks)->ForEach([](const CloudBlock&) {}).ok());
    EXPECT_EQ(messages.warnings(), of_reader);
    return of_reader;
  };
  EXPECT_THAT(warnings(""), testing::IsEmpty());
  EXPECT_THAT(warnings("\r\n"), testing::IsEmpty());
  EXPECT_THAT(warnings(std::string(1000, 'x')),
              testing::ElementsAre(testing::HasSubstr("ignoring 1,000 bytes after its 30 Gaussians")));
}

// Mip-Splatting's filter, and a property that is no float.
std::filesystem::path WriteFiltered(const TestFolder& folder, int64_t n, int64_t bad_row) {
  const GaussianCloud cloud = CloudWithNonFinite(n, 1);
  ExtraProperties extras;
  extras.properties = {{"label", PlyType::kUint8}, {"filter_3D", PlyType::kFloat}};
  extras.rows.resize(extras.row_size() * static_cast<size_t>(n));
  for (int64_t i = 0; i < n; ++i) {
    const float size = i >= bad_row ? -1.0f : 0.001f * static_cast<float>(i % 50);
    std::memcpy(extras.rows.data() + static_cast<size_t>(i) * extras.row_size() + 1, &size, sizeof size);
  }
  EXPECT_TRUE(WritePlyWithExtras(folder / "mip.ply", cloud, {.overwrite = true}, extras).ok());
  return folder / "mip.ply";
}

TEST(PlyBlocks, FuseTheFilterOfMipSplatting) {
  const TestFolder folder;
  ExpectBlocksOf(WriteFiltered(folder, kCloudBlockRows + 100, INT64_MAX));
  // The same first bad row.
  const auto file = OpenedSplat::Open(WriteFiltered(folder, 9 * kCloudBlockRows, 3 * kCloudBlockRows + 5));
  const auto blocks = file->Blocks();
  ASSERT_TRUE(blocks.ok());
  const Status status = (*blocks)->ForEach([](const CloudBlock&) {});
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().message, file->Read().error().message);
}

TEST(PlyBlocks, FailAsReadingDoes) {
  const TestFolder folder;
  ASSERT_TRUE(WritePly(folder / "a.ply", RandomCloud(50, 3, 1)).ok());
  const std::string bytes = FileBytes(folder / "a.ply");
  const size_t header = bytes.find("end_header\n") + 11;
  std::string many = bytes;
  many.replace(many.find("vertex 50"), 9, "vertex 99999999");
  for (const std::string& bad : {bytes.substr(0, header), bytes.substr(0, bytes.size() - 1),
                                 bytes.substr(0, header - 4), bytes.substr(0, 10), many, std::string("ply\n")}) {
    const InputFile file = InputFile::FromBytes("bad.ply", bad);
    const auto blocks = BlocksOfPly(file, {});
    ASSERT_FALSE(blocks.ok());
    EXPECT_EQ(blocks.error().message, ReadPly(file).error().message);
    EXPECT_EQ(blocks.error().code, ReadPly(file).error().code);
  }
  const InputFile file = InputFile::FromBytes("a.ply", bytes);
  const ReadLimits few = {.max_gaussians = 49};
  EXPECT_EQ(BlocksOfPly(file, few).error().message, ReadPly(file, few).error().message);
}

// Files that others write in other ways are read whole.
TEST(PlyBlocks, AreNoneOfTextListsDoublesAndBigEndian) {
  const TestFolder folder;
  ASSERT_TRUE(WritePly(folder / "a.ply", RandomCloud(2, 0, 1)).ok());
  const std::string bytes = FileBytes(folder / "a.ply");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = bytes;
    changed.replace(changed.find(from), from.size(), to);
    return InputFile::FromBytes("a.ply", changed + std::string(64, '\0'));
  };
  for (const InputFile& file :
       {with("binary_little_endian", "binary_big_endian"), with("float opacity", "double opacity"),
        with("float nx", "list uchar float nx"), with("binary_little_endian", "ascii")}) {
    const auto blocks = BlocksOfPly(file, {});
    ASSERT_TRUE(blocks.ok()) << blocks.error().message;
    EXPECT_EQ(*blocks, nullptr);
  }
  EXPECT_NE(*BlocksOfPly(with("float nx", "uchar nx"), {}), nullptr) << "no part of a Gaussian";
}

}  // namespace
}  // namespace anchorsplat
