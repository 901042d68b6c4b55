#include "formats/extra_properties.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "core/messages_for_test.h"
#include "core/text.h"
#include "formats/convert.h"
#include "formats/opened_splat.h"
#include "formats/ply/ply_reader.h"
#include "formats/ply/ply_writer.h"
#include "formats/random_cloud_for_test.h"
#include "formats/splat_order.h"
#include "io/atomic_file.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Values that tell the row: a label of 1 byte, an index of 4, a confidence of 8, and normals.
uint8_t LabelOf(int64_t row) { return static_cast<uint8_t>(row % 251); }
double ConfidenceOf(int64_t row) { return 1.0 / static_cast<double>(row + 3); }
float NormalOf(int64_t row, int axis) { return static_cast<float>(row) + 0.25f * static_cast<float>(axis + 1); }

// A PLY of `cloud` (SH 0) with these before, between and behind the Gaussian's own properties.
std::string FileWithExtras(const GaussianCloud& cloud, const std::string& encoding, const std::string& more = "") {
  std::string out = "ply\nformat " + encoding + " 1.0\nelement vertex " + std::to_string(cloud.size()) +
                    "\nproperty uchar label\nproperty float x\nproperty float y\nproperty float z\n"
                    "property float nx\nproperty float ny\nproperty float nz\nproperty int index\n"
                    "property float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\nproperty float opacity\n"
                    "property float scale_0\nproperty float scale_1\nproperty float scale_2\n"
                    "property float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3\n"
                    "property double confidence\n" +
                    more + "end_header\n";
  const auto put = [&](auto value) {
    if (encoding == "ascii") {
      char text[40];
      std::snprintf(text, sizeof text, "%.17g ", static_cast<double>(value));
      out += text;
      return;
    }
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    if (encoding == "binary_big_endian") std::reverse(bytes, bytes + sizeof value);
    out.append(bytes, sizeof value);
  };
  for (int64_t i = 0; i < cloud.size(); ++i) {
    const auto k = static_cast<size_t>(i);
    put(LabelOf(i));
    for (size_t a = 0; a < 3; ++a) put(cloud.means[3 * k + a]);
    for (int a = 0; a < 3; ++a) put(NormalOf(i, a));
    put(static_cast<int32_t>(i));
    for (size_t a = 0; a < 3; ++a) put(cloud.sh[3 * k + a]);
    put(cloud.opacity_logits[k]);
    for (size_t a = 0; a < 3; ++a) put(cloud.log_scales[3 * k + a]);
    for (size_t a = 0; a < 4; ++a) put(cloud.quats[4 * k + a]);
    put(ConfidenceOf(i));
    if (more.find("list") != more.npos) {
      put(static_cast<uint8_t>(2));
      put(int32_t{7});
      put(int32_t{8});
    }
    if (encoding == "ascii") out += "\n";
  }
  return out;
}

std::filesystem::path Written(const TestFolder& folder, const std::string& bytes) {
  EXPECT_TRUE(WriteWholeFile(folder / "in.ply", bytes, true).ok());
  return folder / "in.ply";
}

// That every Gaussian of `path` still has what it had in `cloud`, by its index; the indices.
std::vector<int32_t> ExpectTheirOwn(const std::filesystem::path& path, const GaussianCloud& cloud) {
  ExtraProperties extras;
  const auto file = OpenedSplat::Open(path);
  EXPECT_TRUE(file.ok());
  const auto read = file->Read({}, &extras);
  EXPECT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(extras.names(), "label, index, confidence, normals");
  EXPECT_EQ(extras.row_size(), 13u);
  std::vector<int32_t> indices;
  if (!extras.fits(read->size()) || extras.row_size() != 13) {
    ADD_FAILURE() << "rows are missing";
    return indices;
  }
  for (int64_t i = 0; i < read->size(); ++i) {
    const std::byte* row = extras.rows.data() + 13 * i;
    int32_t index = 0;
    double confidence = 0;
    std::memcpy(&index, row + 1, 4);
    std::memcpy(&confidence, row + 5, 8);
    indices.push_back(index);
    EXPECT_EQ(std::to_integer<uint8_t>(row[0]), LabelOf(index));
    EXPECT_EQ(confidence, ConfidenceOf(index));
    for (int a = 0; a < 3; ++a) {
      EXPECT_EQ(extras.normals[static_cast<size_t>(3 * i + a)], NormalOf(index, a));
      EXPECT_EQ(read->means[static_cast<size_t>(3 * i + a)], cloud.means[static_cast<size_t>(3 * index + a)]);
    }
  }
  return indices;
}

TEST(ExtraProperties, StayWithTheirGaussiansFromPlyToPly) {
  const TestFolder folder;
  const GaussianCloud cloud = RandomCloud(3000, 0, 3);
  for (const char* encoding : {"binary_little_endian", "binary_big_endian", "ascii"}) {
    SCOPED_TRACE(encoding);
    const Messages messages;
    const auto input = Written(folder, FileWithExtras(cloud, encoding));
    ASSERT_TRUE(ConvertFile(input, folder / "all.ply", {.write = {.overwrite = true}}).ok());
    EXPECT_EQ(ExpectTheirOwn(folder / "all.ply", cloud).size(), 3000u);
    ConvertOptions some{.min_opacity = 0.3f, .max_gaussians = 500};
    some.write = {.overwrite = true, .order = SplatOrder::kMorton};
    ASSERT_TRUE(ConvertFile(input, folder / "some.ply", some).ok());
    EXPECT_EQ(ExpectTheirOwn(folder / "some.ply", cloud).size(), 500u);
    EXPECT_THAT(messages.warnings(), IsEmpty());
  }
}

TEST(ExtraProperties, TheOrderIsThatOfTheGaussians) {
  const TestFolder folder;
  const GaussianCloud cloud = RandomCloud(200, 0, 3);
  ConvertOptions options;
  options.write.order = SplatOrder::kImportance;
  ASSERT_TRUE(
      ConvertFile(Written(folder, FileWithExtras(cloud, "binary_little_endian")), folder / "a.ply", options).ok());
  const Buffer<uint32_t> order = ImportanceOrder(cloud);
  EXPECT_THAT(ExpectTheirOwn(folder / "a.ply", cloud), ::testing::ElementsAreArray(order.begin(), order.end()));
}

TEST(ExtraProperties, WhatHasNoPlaceIsNamed) {
  const TestFolder folder;
  const GaussianCloud cloud = RandomCloud(50, 0, 3);
  const auto input = Written(folder, FileWithExtras(cloud, "ascii",
                                                    "property list uchar int neighbours\nelement region 1\n"
                                                    "property float size\n") +
                                         "3\n");
  {
    const Messages messages;
    ASSERT_TRUE(ConvertFile(input, folder / "a.ply", {}).ok());
    EXPECT_THAT(messages.warnings(),
                ElementsAre(HasSubstr("a.ply: extra properties of the input dropped: list \"neighbours\", element "
                                      "\"region\"")));
    ExpectTheirOwn(folder / "a.ply", cloud);
  }
  const Messages messages;
  ASSERT_TRUE(ConvertFile(input, folder / "a.glb", {}).ok());
  EXPECT_THAT(messages.warnings(),
              ElementsAre(HasSubstr("a.glb: extra properties of the input dropped: label, index, confidence, "
                                    "normals, list \"neighbours\", element \"region\"")));
}

TEST(ExtraProperties, NormalsFollowTheAxes) {
  const TestFolder folder;
  ConvertOptions options;
  options.input_axes = kRub;
  const auto input = Written(folder, FileWithExtras(RandomCloud(10, 0, 3), "binary_little_endian"));
  ASSERT_TRUE(ConvertFile(input, folder / "a.ply", options).ok());
  ExtraProperties extras;
  ASSERT_TRUE(OpenedSplat::Open(folder / "a.ply")->Read({}, &extras).ok());
  ASSERT_EQ(extras.normals.size(), 30u);
  for (int a = 0; a < 3; ++a) {
    EXPECT_EQ(extras.normals[static_cast<size_t>(6 + a)], NormalOf(2, a) * (a == 0 ? 1.0f : -1.0f));
  }
}

TEST(ExtraProperties, NormalsOfZeroAreNone) {
  const TestFolder folder;
  ASSERT_TRUE(WritePly(folder / "in.ply", RandomCloud(10, 1, 3)).ok());
  const Messages messages;
  ExtraProperties extras;
  ASSERT_TRUE(OpenedSplat::Open(folder / "in.ply")->Read({}, &extras).ok());
  EXPECT_TRUE(extras.empty());
  EXPECT_EQ(extras.lost(false), "");
  ASSERT_TRUE(ConvertFile(folder / "in.ply", folder / "a.glb", {}).ok());
  EXPECT_THAT(messages.warnings(), IsEmpty());
}

TEST(ExtraProperties, OneNormalAloneHasTheOthersZero) {
  const TestFolder folder;
  std::string bytes = FileWithExtras(RandomCloud(5, 0, 3), "ascii");
  for (const char* axis : {"ny", "nz"}) bytes.replace(bytes.find(Cat(" ", axis, "\n")) + 1, 2, Cat("m", axis[1]));
  ASSERT_TRUE(ConvertFile(Written(folder, bytes), folder / "a.ply", {}).ok());
  ExtraProperties extras;
  ASSERT_TRUE(OpenedSplat::Open(folder / "a.ply")->Read({}, &extras).ok());
  EXPECT_EQ(extras.names(), "label, my, mz, index, confidence, normals");
  EXPECT_EQ(extras.normals[3], NormalOf(1, 0));
  EXPECT_EQ(extras.normals[4], 0);
}

TEST(ExtraProperties, ABadValueIsNamedWithItsLine) {
  const TestFolder folder;
  for (const auto& [from, to] : {std::pair{"\n1 ", "\n300 "}, {"\n1 ", "\n1.5 "}, {"\n1 ", "\nred "}}) {
    std::string bytes = FileWithExtras(RandomCloud(5, 0, 3), "ascii");
    const size_t body = bytes.find("end_header");
    bytes.replace(bytes.find(from, body), std::strlen(from), to);
    const auto result = ConvertFile(Written(folder, bytes), folder / "a.ply", {.write = {.overwrite = true}});
    ASSERT_FALSE(result.ok()) << to;
    EXPECT_EQ(result.error().code, ErrorCode::kBadFile);
    EXPECT_THAT(result.error().message, HasSubstr("property \"label\": expected a number, found"));
    EXPECT_TRUE(ReadCloud(folder / "in.ply").ok());  // who does not keep it does not look at it
  }
}

TEST(ExtraProperties, APromiseIsCheckedBeforeItBecomesMemory) {
  std::string bytes = FileWithExtras(RandomCloud(5, 0, 3), "binary_little_endian");
  bytes.replace(bytes.find("vertex 5"), 8, "vertex 250000000");
  ExtraProperties extras;
  const auto result = ReadPlyWithExtras(InputFile::FromBytes("a.ply", bytes), {}, extras);
  ASSERT_FALSE(result.ok());
  EXPECT_THAT(result.error().message, HasSubstr("the file ends too early"));
  EXPECT_EQ(extras.rows.capacity(), 0u);
}

TEST(ExtraProperties, ThoseOfOtherGaussiansAreRefused) {
  const TestFolder folder;
  ExtraProperties extras;
  extras.properties = {{"label", PlyType::kUint8}};
  extras.rows.resize(9);
  const Status status = WriteCloud(folder / "a.ply", RandomCloud(10, 0, 3), {}, extras);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kBadArgument);
  EXPECT_THAT(status.error().message, HasSubstr("(label) do not match the 10 Gaussians"));
  EXPECT_EQ(folder.Entries(), 0);
}

}  // namespace
}  // namespace anchorsplat
