#include "formats/gsplat_checkpoint/gsplat_checkpoint_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/random_cloud_for_test.h"
#include "io/file_bytes.h"
#include "io/folder_for_test.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {
namespace {

using namespace testing;  // NOLINT: matchers

TEST(GsplatCheckpointWriter, ComesBackThroughTheReader) {
  const TestFolder folder;
  for (int degree = 0; degree <= kMaxShDegree; ++degree) {
    const GaussianCloud cloud = RandomCloud(17, degree, static_cast<uint64_t>(degree) + 1);
    const auto path = folder / ("ckpt_14999_rank0_" + std::to_string(degree) + ".pt");
    ASSERT_TRUE(WriteGsplatCheckpoint(path, cloud, 14999).ok());
    const auto read = ReadCloud(path);
    ASSERT_TRUE(read.ok()) << read.error().message;
    ExpectSameCloud(*read, cloud);

    const auto file = TensorFile::Open(path);
    ASSERT_TRUE(file.ok()) << file.error().message;
    EXPECT_EQ(file->scalars().at("step"), TensorFileScalar(int64_t{14999}));
    const int64_t rest = ShCoefficients(degree) - 1;
    EXPECT_THAT(file->Find("splats.sh0")->shape, ElementsAre(17, 1, 3));
    EXPECT_THAT(file->Find("splats.shN")->shape, ElementsAre(17, rest, 3));
    EXPECT_THAT(file->Find("splats.opacities")->shape, ElementsAre(17));
  }
}

TEST(GsplatCheckpointWriter, EqualCloudsMakeEqualFiles) {
  const TestFolder folder;
  const GaussianCloud cloud = RandomCloud(3, 1, 5);
  ASSERT_TRUE(WriteGsplatCheckpoint(folder / "a.pt", cloud, 6999).ok());
  ASSERT_TRUE(WriteGsplatCheckpoint(folder / "b.pt", cloud, 6999).ok());
  ASSERT_TRUE(WriteGsplatCheckpoint(folder / "c.pt", cloud, 7000).ok());
  EXPECT_EQ(ReadFileBytes(folder / "a.pt", 1 << 20).value(), ReadFileBytes(folder / "b.pt", 1 << 20).value());
  EXPECT_NE(ReadFileBytes(folder / "a.pt", 1 << 20).value(), ReadFileBytes(folder / "c.pt", 1 << 20).value());
}

TEST(GsplatCheckpointWriter, RefusesWhatItCannotWrite) {
  const TestFolder folder;
  const GaussianCloud cloud = RandomCloud(3, 1, 5);
  EXPECT_EQ(WriteGsplatCheckpoint(folder / "a.pt", GaussianCloud{}, 0).error().code, ErrorCode::kBadArgument);
  EXPECT_EQ(WriteGsplatCheckpoint(folder / "a.pt", cloud, -1).error().code, ErrorCode::kBadArgument);
  EXPECT_EQ(folder.Entries(), 0);
  ASSERT_TRUE(WriteGsplatCheckpoint(folder / "a.pt", cloud, 0).ok());
  EXPECT_EQ(WriteGsplatCheckpoint(folder / "a.pt", cloud, 0).error().code, ErrorCode::kExists);
  EXPECT_TRUE(WriteGsplatCheckpoint(folder / "a.pt", cloud, 0, {.overwrite = true}).ok());
  GaussianCloud broken = cloud;
  broken.quats.pop_back();
  EXPECT_EQ(WriteGsplatCheckpoint(folder / "b.pt", broken, 0).error().code, ErrorCode::kBadArgument);
  EXPECT_EQ(folder.Entries(), 1);
}

}  // namespace
}  // namespace anchorsplat
