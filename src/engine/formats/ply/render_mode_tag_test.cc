#include "formats/ply/render_mode_tag.h"

#include <gtest/gtest.h>

namespace anchorsplat {
namespace {

using Mode = std::optional<RenderMode>;

Mode ModeOf(const std::vector<std::string>& comments) {
  RenderModeTag tag;
  for (const std::string& comment : comments) tag.Take(comment);
  return tag.mode();
}

TEST(RenderModeTag, OneComment) {
  EXPECT_EQ(ModeOf({}), Mode());
  EXPECT_EQ(ModeOf({"SplatRenderMode: mip"}), RenderMode::kAntialiased);
  EXPECT_EQ(ModeOf({"  SPLATRENDERMODE:MIP "}), RenderMode::kAntialiased);
  EXPECT_EQ(ModeOf({"SplatRenderMode: default"}), RenderMode::kClassic);
  EXPECT_EQ(ModeOf({"antialiased 1"}), RenderMode::kAntialiased);
  EXPECT_EQ(ModeOf({"Antialiased 0"}), RenderMode::kClassic);
  for (const char* other : {"", "SplatRenderMode: 2dgs", "antialiased", "antialiased 2", "not antialiased 1",
                            "Exported from Brush", "SplatRenderDilation: wide", "SplatRenderDilation: -0.1"}) {
    RenderModeTag tag;
    EXPECT_FALSE(tag.Take(other)) << other;
    EXPECT_EQ(tag.mode(), Mode()) << other;
  }
}

// Brush draws "mip" with 0.1 px², gsplat's and nerfstudio's exporters mean 0.3 px² by it.
TEST(RenderModeTag, MipIsWhatItsWriterDraws) {
  EXPECT_EQ(ModeOf({"Exported from Brush", "SplatRenderMode: mip"}), RenderMode::kMip);
  EXPECT_EQ(ModeOf({"SplatRenderMode: mip", "exported from brush"}), RenderMode::kMip);
  EXPECT_EQ(ModeOf({"Exported from Brush", "SplatRenderMode: default"}), RenderMode::kClassic);
  EXPECT_EQ(ModeOf({"Exported from Brush", "antialiased 1"}), RenderMode::kAntialiased);
  EXPECT_EQ(ModeOf({"SplatRenderMode: mip", "SplatRenderDilation: 0.1"}), RenderMode::kMip);
  EXPECT_EQ(ModeOf({"Exported from Brush", "SplatRenderMode: mip", "SplatRenderDilation: 0.3"}),
            RenderMode::kAntialiased);
  EXPECT_EQ(ModeOf({"SplatRenderDilation: 0.1"}), Mode());
}

TEST(RenderModeTag, TheLastOneCounts) {
  EXPECT_EQ(ModeOf({"antialiased 1", "SplatRenderMode: default"}), RenderMode::kClassic);
  EXPECT_EQ(ModeOf({"SplatRenderMode: default", "antialiased 1"}), RenderMode::kAntialiased);
  EXPECT_EQ(ModeOf({"SplatRenderMode: mip", "SplatRenderMode: nonsense"}), RenderMode::kAntialiased);
}

TEST(RenderModeTag, EveryModeComesBack) {
  for (const RenderMode mode : kRenderModes) {
    EXPECT_EQ(ModeOf(CommentsOf(mode)), mode) << NameOf(mode);
    EXPECT_EQ(RenderModeNamed(NameOf(mode)), mode);
    RenderModeTag tag;
    for (const std::string& comment : CommentsOf(mode)) EXPECT_TRUE(tag.Take(comment)) << comment;
  }
  EXPECT_EQ(RenderModeNamed("Classic"), std::nullopt);
}

}  // namespace
}  // namespace anchorsplat
