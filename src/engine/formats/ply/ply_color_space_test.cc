#include "formats/ply/ply_color_space.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/messages_for_test.h"
#include "core/spherical_harmonics.h"
#include "core/splat_comments.h"
#include "core/text.h"
#include "formats/both_ways_for_test.h"
#include "formats/extra_properties.h"
#include "formats/ply/ply_blocks.h"
#include "formats/ply/ply_reader.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;

// A Gaussian as text, and behind it what SHARP writes.
std::string Ply(const std::string& more_header, const std::string& more_rows, const std::string& comments = "") {
  std::string text = "ply\nformat ascii 1.0\n" + comments + "element vertex 1\n";
  for (const char* name : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
                           "rot_0", "rot_1", "rot_2", "rot_3"}) {
    text += Cat("property float ", name, "\n");
  }
  return text + more_header + "end_header\n1 2 3 0 -0.8862269 0.8862269 1 -3 -3 -3 1 0 0 0\n" + more_rows;
}

Result<GaussianCloud> Read(const std::string& text) {
  return ReadBothWays(ReadPly, BlocksOfPly, InputFile::FromBytes("a.ply", text));
}

constexpr const char* kElements =
    "element color_space 1\nproperty uchar color_space\nelement version 3\nproperty uchar version\n";

TEST(PlyColorSpace, LinearLightBecomesSrgb) {
  Messages messages;
  for (const char* value : {"0", "1"}) {
    const auto cloud = ReadPly(InputFile::FromBytes("a.ply", Ply(kElements, Cat(value, "\n1\n5\n0\n"))));
    ASSERT_TRUE(cloud.ok()) << cloud.error().message;
    const bool linear = *value == '1';
    EXPECT_EQ(messages.TakeWarnings().size(), linear ? 1u : 0u);
    EXPECT_NEAR(ColorFromDc(cloud->sh[0]), linear ? 0.735357 : 0.5, 1e-5);
    EXPECT_NEAR(ColorFromDc(cloud->sh[1]), linear ? 0.537099 : 0.25, 1e-5);
    EXPECT_NEAR(ColorFromDc(cloud->sh[2]), linear ? 0.880825 : 0.75, 1e-5);
    const auto facts = DescribePly(InputFile::FromBytes("a.ply", Ply(kElements, Cat(value, "\n1\n5\n0\n"))));
    EXPECT_THAT(facts->all(), testing::Contains(testing::Pair("colour space", HasSubstr(linear ? "linear" : "sRGB"))));
  }
  for (const char* rows : {"2\n1\n5\n0\n", "x\n1\n5\n0\n", "5\n0\n"}) {
    EXPECT_FALSE(ReadPly(InputFile::FromBytes("a.ply", Ply(kElements, rows))).ok()) << rows;
  }
  EXPECT_THAT(Read(Ply("element color_space 2\nproperty uchar a\n", "1\n1\n")).error().message, HasSubstr("not one"));
}

TEST(PlyColorSpace, OfBinaryFiles) {
  for (const bool big : {false, true}) {
    std::string bytes =
        Ply("element before 1\nproperty ushort a\nelement color_space 1\nproperty ushort color_space\n", "");
    bytes.resize(bytes.find("end_header\n") + 11);
    bytes.replace(bytes.find("ascii"), 5, big ? "binary_big_endian" : "binary_little_endian");
    bytes += std::string(14 * 4 + 2, '\0') + (big ? std::string("\0\1", 2) : std::string("\1\0", 2));
    const Messages messages;
    const auto cloud = ReadPly(InputFile::FromBytes("a.ply", bytes));
    ASSERT_TRUE(cloud.ok()) << cloud.error().message;
    EXPECT_NEAR(ColorFromDc(cloud->sh[0]), 0.735357, 1e-5) << big;
    EXPECT_THAT(messages.warnings(), testing::ElementsAre(HasSubstr("linear light")));
    EXPECT_FALSE(ReadPly(InputFile::FromBytes("a.ply", bytes.substr(0, bytes.size() - 1))).ok());
  }
}

TEST(PlyComments, UpOfOtherPrograms) {
  for (const char* line : {"comment Vertical Axis: z\n", "obj_info Vertical axis: z\n"}) {
    const auto cloud = Read(Ply("", "", line));
    ASSERT_TRUE(cloud.ok()) << cloud.error().message;
    EXPECT_EQ(UpOf(cloud->comments), (std::array<double, 3>{0, 0, 1})) << line;
  }
  EXPECT_TRUE(Read(Ply("", "", "obj_info something else\n"))->comments.empty());
}

}  // namespace
}  // namespace anchorsplat
