#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "core/messages_for_test.h"
#include "core/smoothing_filter.h"
#include "formats/cloud_io.h"
#include "formats/extra_properties.h"
#include "formats/opened_splat.h"
#include "formats/ply/ply_reader.h"
#include "formats/ply/ply_writer.h"
#include "formats/random_cloud_for_test.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// What Mip-Splatting's program writes before its create_fused_ply: the filter's size beside every Gaussian. Another
// property stands with it.
struct UnfusedFile {
  TestFolder folder;
  GaussianCloud cloud = RandomCloud(40, 1, 5);
  std::vector<float> sizes;
  std::string name = "filter_3D";
  PlyType type = PlyType::kFloat;

  UnfusedFile() {
    for (int64_t i = 0; i < cloud.size(); ++i) sizes.push_back(0.05f * static_cast<float>(i));  // 0 for the first
  }
  std::filesystem::path Write() const {
    ExtraProperties extras;
    extras.properties = {{name, type}, {"label", PlyType::kFloat}};
    extras.rows.resize(2 * sizeof(float) * sizes.size());
    for (size_t i = 0; i < sizes.size(); ++i) {
      const float row[] = {sizes[i], static_cast<float>(i)};
      std::memcpy(extras.rows.data() + i * sizeof row, row, sizeof row);
    }
    EXPECT_TRUE(WritePlyWithExtras(folder / "mip.ply", cloud, {.overwrite = true}, extras).ok());
    return folder / "mip.ply";
  }
  std::string ErrorOf() const {
    const auto read = ReadCloud(Write());
    return read.ok() ? "accepted" : read.error().message;
  }
};

TEST(MipSplattingPly, TheFilterBecomesAPartOfTheGaussians) {
  const UnfusedFile file;
  const Messages messages;
  const auto read = ReadCloud(file.Write());
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->render_mode, RenderMode::kMip);
  EXPECT_THAT(messages.notes(), ElementsAre(AllOf(HasSubstr("mip.ply"), HasSubstr("filter_3D"), HasSubstr("mip"))));
  EXPECT_TRUE(SameBits(read->means, file.cloud.means));
  EXPECT_TRUE(SameBits(read->sh, file.cloud.sh));
  GaussianCloud smoothed = file.cloud;
  Smooth(file.cloud, file.sizes, smoothed.log_scales.data(), smoothed.opacity_logits.data());
  EXPECT_TRUE(SameBits(read->log_scales, smoothed.log_scales));
  EXPECT_TRUE(SameBits(read->opacity_logits, smoothed.opacity_logits));
}

// What is written has the filter in it, so nobody may apply it again.
TEST(MipSplattingPly, IsFusedOnce) {
  const UnfusedFile file;
  const auto opened = OpenedSplat::Open(file.Write());
  ASSERT_TRUE(opened.ok());
  ExtraProperties extras;
  const auto read = opened->Read({}, &extras);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(extras.names(), "label");
  float label = 0;
  std::memcpy(&label, extras.rows.data() + 7 * sizeof label, sizeof label);
  EXPECT_EQ(label, 7);
  ASSERT_TRUE(WriteCloud(file.folder / "again.ply", *read, {}, extras).ok());
  const Messages messages;
  const auto again = ReadCloud(file.folder / "again.ply");
  ASSERT_TRUE(again.ok());
  ExpectSameCloud(*again, *read);
  EXPECT_THAT(messages.notes(), IsEmpty());
  const auto facts = DescribePly(opened->input());
  ASSERT_TRUE(facts.ok());
  std::string text;
  for (const auto& [name, value] : facts->all()) text += name + ": " + value + "\n";
  EXPECT_THAT(text, AllOf(HasSubstr("3-D filter: of Mip-Splatting"), HasSubstr("other properties: nx ny nz label\n")));
}

TEST(MipSplattingPly, ATagCountsMore) {
  UnfusedFile file;
  file.cloud.render_mode = RenderMode::kAntialiased;
  EXPECT_EQ(ReadCloud(file.Write())->render_mode, RenderMode::kAntialiased);
}

TEST(MipSplattingPly, RefusesWhatIsNoSize) {
  for (const float bad : {-0.5f, std::nanf(""), std::numeric_limits<float>::infinity()}) {
    UnfusedFile file;
    file.sizes[4] = bad;
    EXPECT_THAT(file.ErrorOf(), AllOf(HasSubstr("mip.ply: row 5: "), HasSubstr("\"filter_3D\""))) << bad;
  }
  UnfusedFile file;
  file.type = PlyType::kUint32;
  EXPECT_THAT(file.ErrorOf(), AllOf(HasSubstr("\"filter_3D\" has type uint"), HasSubstr("line ")));
}

TEST(RenderModeTag, OneThatIsNotKnownIsAWarning) {
  const TestFolder folder;
  GaussianCloud cloud = RandomCloud(10, 0, 1);
  for (float& x : cloud.log_scales) x = -5;
  for (const char* extension : {".ply", ".compressed.ply"}) {
    const auto warnings = [&](std::vector<std::string> comments) {
      cloud.comments = std::move(comments);
      const std::filesystem::path path = folder / (std::string("a") + extension);
      EXPECT_TRUE(WriteCloud(path, cloud, {.overwrite = true}).ok());
      const Messages messages;
      EXPECT_TRUE(ReadCloud(path).ok());
      return messages.warnings();
    };
    const auto names = [](const char* tag, const char* mode) {
      return ElementsAre(AllOf(HasSubstr("a."), HasSubstr(tag), HasSubstr(mode), HasSubstr("--mode")));
    };
    EXPECT_THAT(warnings({"SplatRenderMode: 2dgs"}), names("\"SplatRenderMode: 2dgs\"", "assuming classic"));
    EXPECT_THAT(warnings({"SplatRenderMode: mip", "SplatRenderDilation: wide"}), names("wide", "assuming antialiased"));
    EXPECT_THAT(warnings({"antialiased yes", "antialiased 2"}), names("(and 1 more)", "classic"));
    EXPECT_THAT(warnings({"SplatRenderMode: mip", "SplatRenderDilation: 0.1", "antialiased rendering of a mug",
                          "antialiased", "made by a test"}),
                IsEmpty());
  }
}

}  // namespace
}  // namespace anchorsplat
