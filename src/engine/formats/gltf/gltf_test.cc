#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "core/splat_comments.h"
#include "core/text.h"
#include "formats/attribute_error.h"
#include "formats/both_ways_for_test.h"
#include "formats/gltf/gltf_blocks.h"
#include "formats/gltf/gltf_example_for_test.h"
#include "formats/gltf/gltf_reader.h"
#include "formats/gltf/gltf_writer.h"
#include "formats/random_cloud_for_test.h"
#include "formats/registry.h"
#include "formats/write_losses.h"
#include "io/atomic_file.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

TEST(Gltf, RoundTripOfEveryDegree) {
  const TestFolder folder;
  for (int degree = 0; degree <= kMaxShDegree; ++degree) {
    const GaussianCloud cloud = RandomCloud(20'001, degree, 3);
    ASSERT_TRUE(WriteGlb(folder / "a.glb", cloud, {.overwrite = true}).ok());
    const auto read = Read(FileBytes(folder / "a.glb"));
    ASSERT_TRUE(read.ok()) << read.error().message;
    const auto error = CompareAttributes(*read, cloud);
    EXPECT_EQ(error->compared, 20'001);
    EXPECT_EQ(error->means.max, 0);
    EXPECT_EQ(error->harmonics.max, 0);
    EXPECT_EQ(error->colors.max, 0);
    EXPECT_LT(error->log_scales.max, 1e-5);
    EXPECT_LT(error->rotations.max, 1e-5);
    EXPECT_LT(error->opacities.max, 1e-6);
  }
}

TEST(Gltf, WhatItsReadersExpect) {
  const TestFolder folder;
  GaussianCloud cloud = RandomCloud(1, 0, 1);
  cloud.means = {1, 2, 3};
  cloud.quats = {0, 0, 0, 2};
  cloud.sh = {0, 5, -5};
  cloud.opacity_logits = {0};
  ASSERT_TRUE(WriteGlb(folder / "a.glb", cloud).ok());
  const std::string bytes = FileBytes(folder / "a.glb");
  const Glb glb = Glb::Of(bytes);
  EXPECT_EQ(bytes.size() % 4, 0u);
  uint32_t length;
  std::memcpy(&length, bytes.data() + 8, 4);
  EXPECT_EQ(length, bytes.size());
  EXPECT_EQ(glb.json["buffers"][0]["byteLength"], glb.binary.size());
  EXPECT_EQ(glb.json["accessors"][0]["min"], Json({-1, -2, 3}));
  const Json& primitive = glb.json["meshes"][0]["primitives"][0];
  EXPECT_EQ(primitive["mode"], 0);
  EXPECT_EQ(primitive["extensions"]["KHR_gaussian_splatting"]["kernel"], "ellipse");
  float mean[3];
  std::memcpy(mean, glb.binary.data(), 12);
  EXPECT_THAT(mean, testing::ElementsAre(-1, -2, 3));
  uint16_t color[4];
  std::memcpy(color, glb.binary.data() + 12, 8);
  EXPECT_THAT(color, testing::ElementsAre(14027, 65535, 0, 32768));  // sRGB ½ is 0.2140 of the light
}

TEST(Gltf, CreditsAreItsCopyright) {
  const TestFolder folder;
  GaussianCloud cloud = RandomCloud(10, 0, 3);
  cloud.comments = {"credit: Becher, R\xc3\xb6mer, CC BY 4.0", "world up: 0 1 0", "credit: scanned by \xff"};
  ASSERT_TRUE(WriteGlb(folder / "a.glb", cloud).ok());
  const Glb glb = Glb::Of(FileBytes(folder / "a.glb"));
  EXPECT_EQ(glb.json["asset"]["copyright"], "Becher, R\xc3\xb6mer, CC BY 4.0\nscanned by \xef\xbf\xbd");
  const std::vector<std::string> credits = {cloud.comments[0], "credit: scanned by \xef\xbf\xbd", "world up: 0 1 0"};
  EXPECT_EQ(Read(glb.bytes())->comments, credits);
  ASSERT_TRUE(WriteGltf(folder / "a.gltf", cloud).ok());
  const auto json = InputFile::Open(folder / "a.gltf");
  ASSERT_TRUE(json.ok());
  EXPECT_EQ(ReadBothWays(ReadGltf, BlocksOfGltf, *json)->comments, credits);

  Glb other = glb;
  other.json["asset"].erase("extras");
  other.json["asset"]["copyright"] = 7;
  EXPECT_TRUE(Read(other.bytes())->comments.empty());
  other.json["asset"]["copyright"] = std::string(size_t{2} << 20, 'x');
  EXPECT_NE(Read(other.bytes()).error().message.find("asset.copyright"), std::string::npos);
  other.json["asset"].erase("copyright");
  EXPECT_TRUE(Read(other.bytes())->comments.empty());
}

// A splat that has all its width, and says so.
TEST(Gltf, MarksAreKept) {
  const TestFolder folder;
  GaussianCloud cloud = RandomCloud(10, 0, 3);
  cloud.comments = {"Vertical Axis: z", Cat(kEnhancedMark, "filter, 4 times closer"), "something else"};
  const std::vector<std::string> mark = {cloud.comments[1], "world up: 0 0 1"};
  EXPECT_TRUE(WriteLosses(*FormatOfExtension("a.glb"), cloud).empty());
  ASSERT_TRUE(WriteGlb(folder / "a.glb", cloud).ok());
  Glb glb = Glb::Of(FileBytes(folder / "a.glb"));
  EXPECT_EQ(Read(glb.bytes())->comments, mark);
  // Of another program.
  nlohmann::json& extras = glb.json["asset"]["extras"];
  extras["comments"] = {7, "hello", mark[0], mark[1], std::string(kEnhancedMark) + std::string(2000, 'x')};
  EXPECT_EQ(Read(glb.bytes())->comments, mark);
  extras["comments"] = "hello";
  EXPECT_TRUE(Read(glb.bytes())->comments.empty());
  extras = 3;
  EXPECT_TRUE(Read(glb.bytes())->comments.empty());
}

TEST(Gltf, WhatIsNoNumberStaysNone) {
  for (const char* name : {kGltfScales, kGltfOpacities}) {
    Glb glb = Example(2, 0);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const bool is_scale = name == kGltfScales;
    SetAttribute(glb, name, is_scale ? std::vector{nan, 0.5f, 0.5f, 1.0f, 1.0f, 1.0f} : std::vector{nan, 0.5f});
    const auto read = Read(glb.bytes());
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_FALSE(IsUsable(*read, 0)) << name;
    EXPECT_TRUE(IsUsable(*read, 1)) << name;
  }
}

TEST(Gltf, NodesMoveAndScale) {
  Glb glb = Example(10, 1);
  const GaussianCloud plain = *Read(glb.bytes());
  glb.json["nodes"] = Json::parse(R"([{"children":[1,2],"translation":[1,0,0],"scale":[2,2,2]},{"mesh":0},
                                      {"mesh":0,"matrix":[3,0,0,0, 0,3,0,0, 0,0,3,0, 0,1,0,1]}])");
  const auto moved = Read(glb.bytes());
  ASSERT_TRUE(moved.ok()) << moved.error().message;
  ASSERT_EQ(moved->size(), 20);
  for (size_t i = 0; i < 10; ++i) {
    EXPECT_NEAR(moved->means[3 * i], 2 * plain.means[3 * i] - 1, 1e-5);
    EXPECT_NEAR(moved->means[30 + 3 * i + 1], 6 * plain.means[3 * i + 1] - 2, 1e-5);
    EXPECT_NEAR(moved->log_scales[30 + 3 * i], plain.log_scales[3 * i] + std::log(6), 1e-5);
  }
}

// Blocks that begin in one primitive and end in another, with logarithms in one of them.
TEST(Gltf, PrimitivesOfAnyLengthSideBySide) {
  Glb glb = Example(5'000, 1);
  const Json attributes = glb.json["meshes"][0]["primitives"][0]["attributes"];
  for (const int count : {1, 4'096, 17, 4'999}) {
    Json primitive = glb.json["meshes"][0]["primitives"][0];
    for (auto& [name, index] : primitive["attributes"].items()) {
      Json accessor = glb.json["accessors"][index.get<size_t>()];
      accessor["count"] = count;
      if (name.ends_with(":SCALE") && count == 17) accessor["bufferView"] = attributes["POSITION"];
      index = glb.json["accessors"].size();
      glb.json["accessors"].push_back(accessor);
    }
    glb.json["meshes"][0]["primitives"].push_back(primitive);
  }
  glb.json["nodes"] = Json::parse(R"([{"mesh":0},{"mesh":0,"translation":[1,2,3]}])");
  const auto cloud = Read(glb.bytes());
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  EXPECT_EQ(cloud->size(), 2 * (5'000 + 1 + 4'096 + 17 + 4'999));
}

TEST(Gltf, SmallIntegersBesideAndInside) {
  const TestFolder folder;
  Glb glb = Example(2, 0);
  // ROTATION as normalised shorts with a stride of 12, in a buffer of its own.
  const int16_t quats[2][6] = {{32767, 0, 0, 0, 0, 0}, {0, 0, 0, -32768, 0, 0}};
  const std::string buffer(reinterpret_cast<const char*>(quats), 20);
  ASSERT_TRUE(WriteWholeFile(folder / "quats.bin", buffer, false).ok());
  ASSERT_TRUE(WriteWholeFile(folder / "rest.bin", glb.binary, false).ok());
  const int rotation = glb.json["meshes"][0]["primitives"][0]["attributes"]["KHR_gaussian_splatting:ROTATION"];
  glb.json["accessors"][rotation]["componentType"] = 5122;
  glb.json["accessors"][rotation]["normalized"] = true;
  glb.json["bufferViews"][rotation] = {{"buffer", 1}, {"byteLength", 20}, {"byteStride", 12}};
  for (const char* uri : {"quats.bin", "data:application/octet-stream;base64,/38AAAAAAAAAAAAAAAAAAAAAAIA="}) {
    glb.json["buffers"] = {{{"byteLength", glb.binary.size()}, {"uri", "rest.bin"}},
                           {{"byteLength", 20}, {"uri", uri}}};
    ASSERT_TRUE(WriteWholeFile(folder / "a.gltf", glb.json.dump(), true).ok());
    const InputFile file = *InputFile::Open(folder / "a.gltf");
    const auto cloud = ReadBothWays(ReadGltf, BlocksOfGltf, file);
    ASSERT_TRUE(cloud.ok()) << cloud.error().message;
    EXPECT_THAT(cloud->quats, testing::ElementsAre(0, -1, 0, 0, -1, 0, 0, 0));
  }
  for (const char* uri : {"../rest.bin", "/etc/passwd", "a%2fb", "", "data:nothing", "data:;base64,%%", "..", "%2e%2e",
                          "a%", "a%2", "a%zz", "a%00", "http:quats.bin"}) {
    glb.json["buffers"][1]["uri"] = uri;
    ASSERT_TRUE(WriteWholeFile(folder / "a.gltf", glb.json.dump(), true).ok());
    const InputFile file = *InputFile::Open(folder / "a.gltf");
    EXPECT_EQ(ReadBothWays(ReadGltf, BlocksOfGltf, file).error().code, ErrorCode::kBadFile) << uri;
  }
}

TEST(Gltf, JsonWithItsNumbersBesideIt) {
  const TestFolder folder;
  const GaussianCloud cloud = RandomCloud(2'001, 2, 3);
  for (const char* name : {"scan.gltf", "a scan %2f é.GLTF", ".hidden.gltf", "a:b.gltf"}) {
    ASSERT_TRUE(WriteGltf(folder / name, cloud).ok()) << name;
    const InputFile file = *InputFile::Open(folder / name);
    const auto read = ReadBothWays(ReadGltf, BlocksOfGltf, file);
    ASSERT_TRUE(read.ok()) << read.error().message;
    const auto error = CompareAttributes(*read, cloud);
    EXPECT_EQ(error->compared, 2'001);
    EXPECT_EQ(error->means.max, 0);
    EXPECT_EQ(error->harmonics.max, 0);
    EXPECT_LT(error->rotations.max, 1e-5);
    const auto binary = std::filesystem::path(folder / name).replace_extension(".bin");
    EXPECT_EQ(GltfSize(file), file.size() + std::filesystem::file_size(binary));
    EXPECT_NEAR(static_cast<double>(EstimatedGltfSize(2'001, 2)), static_cast<double>(GltfSize(file)), 300.0);
    // Either of them is in the way of another.
    EXPECT_EQ(WriteGltf(folder / name, cloud).error().code, ErrorCode::kExists);
    std::filesystem::remove(folder / name);
    EXPECT_EQ(WriteGltf(folder / name, cloud).error().code, ErrorCode::kExists);
    EXPECT_FALSE(std::filesystem::exists(folder / name));
    ASSERT_TRUE(WriteGltf(folder / name, cloud, {.overwrite = true}).ok());
    std::filesystem::remove(binary);
    EXPECT_EQ(WriteGltf(folder / name, cloud).error().code, ErrorCode::kExists);
    const InputFile alone = *InputFile::Open(folder / name);
    EXPECT_NE(ReadBothWays(ReadGltf, BlocksOfGltf, alone).error().message.find("buffers[0].uri"), std::string::npos);
    std::filesystem::remove(folder / name);
  }
  EXPECT_EQ(folder.Entries(), 0);
}

// 200,000 nodes, one below the other and side by side, and meshes with many primitives: a fraction of a second, not
// the minutes of anything that looks at all of them for each.
TEST(Gltf, CrowdsOfNodes) {
  size_t many = 200'000;
  Glb glb = Example(10, 0);
  const GaussianCloud plain = *Read(glb.bytes());
  const auto nodes = [&](auto&& node) {
    Json list = Json::array();
    for (size_t k = 0; k < many; ++k) list.push_back(node(k));
    list.push_back({{"mesh", 0}});
    glb.json["nodes"] = std::move(list);
  };
  nodes([](size_t k) { return Json{{"children", {k + 1}}, {"translation", {0, 0, 1}}}; });
  const auto chain = Read(glb.bytes());
  ASSERT_TRUE(chain.ok()) << chain.error().message;
  EXPECT_NEAR(ToWorld(chain->means.data(), chain->origin)[2] - double{plain.means[2]}, static_cast<double>(many), 1e-6);
  nodes([](size_t) { return Json{{"translation", {0, 0, 1}}}; });
  ASSERT_TRUE(Read(glb.bytes()).ok());
  // Every node shows another mesh, none of them a splat. Fewer, as a mesh is many values.
  many = 50'000;
  Json meshes = Json::array({glb.json["meshes"][0]});
  for (size_t k = 0; k < many; ++k) meshes.push_back({{"primitives", {Json::object()}}});
  Json own = glb.json["meshes"];
  glb.json["meshes"] = std::move(meshes);
  nodes([](size_t k) { return Json{{"mesh", k + 1}}; });
  ASSERT_TRUE(Read(glb.bytes()).ok());
  // All nodes show one mesh with as many primitives.
  own.push_back({{"primitives", Json(many, Json::object())}});
  glb.json["meshes"] = std::move(own);
  nodes([](size_t) { return Json{{"mesh", 1}}; });
  ASSERT_TRUE(Read(glb.bytes()).ok());
}

TEST(Gltf, RefusesLiesAndCircles) {
  const Glb good = Example(100, 1);
  EXPECT_TRUE(Read(good.bytes()).ok());
  const auto error_with = [&good](const char* pointer, const Json& value) {
    Glb changed = good;
    changed.json[Json::json_pointer(pointer)] = value;
    const auto cloud = Read(changed.bytes());
    return cloud.ok() ? std::string("accepted") : cloud.error().message;
  };
  const auto expect = [](const std::string& message, const char* part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  const std::string extension = "/meshes/0/primitives/0/extensions/KHR_gaussian_splatting";
  expect(error_with((extension + "/kernel").c_str(), "box"), "expected \"ellipse\"");
  expect(error_with((extension + "/extensions").c_str(), {{"KHR_spz", Json::object()}}), "KHR_spz");
  expect(error_with("/meshes/0/primitives/0/extensions", Json::object()), "without splats");
  expect(error_with("/nodes", Json::parse(R"([{"children":[1]},{"children":[0]}])")), "their own ancestors");
  expect(error_with("/nodes", Json::parse(R"([{"children":[2]},{"children":[2]},{"mesh":0}])")), "shares a child");
  expect(error_with("/nodes", Json::parse(R"([{"children":[7]}])")), "is not a node");
  expect(error_with("/nodes/0/rotation", {0, 0, 0, 0}), "is zero");
  expect(error_with("/nodes/0/scale", {0, 0, 0}), "stretches");
  expect(error_with("/nodes/0/matrix", {1, 0, 0, 0, 0.5, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}), "shears");
  expect(error_with("/nodes/0/matrix", {1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}), "last row");
  expect(error_with("/nodes/0/extensions", {{"EXT_mesh_gpu_instancing", Json::object()}}), "EXT_mesh_gpu_instancing");
  expect(error_with("/extensionsRequired", {"KHR_gaussian_splatting", "EXT_meshopt_compression"}),
         "extensionsRequired[1]: is EXT_meshopt_compression");
  expect(error_with("/bufferViews/0/extensions", {{"EXT_meshopt_compression", Json::object()}}), "EXT_meshopt");
  expect(error_with((extension + "/projection").c_str(), "orthographic"), "expected \"perspective\"");
  expect(error_with((extension + "/colorSpace").c_str(), "rec2020_pq"), "rec2020_pq");
  expect(error_with((extension + "/kernel").c_str(), 7), "kernel");
  expect(error_with("/meshes/0/primitives/0/targets", Json::array({Json::object()})), "morphs");
  expect(error_with("/extensionsUsed", {"KHR_spz_gaussian_splats_compression"}), "accepted");
  expect(error_with("/scenes", Json::array({Json::object()})), "without splats");
  expect(error_with("/scenes", Json::parse(R"([{"nodes":[3]}])")), "is not a node");
  expect(error_with("/scene", 2), "accepted");
  expect(error_with("/nodes/0/scale", {1, 2, 1}), "stretches");
  expect(error_with("/nodes/0/mesh", 1), "there are 1 meshes");
  expect(error_with("/accessors/0/count", 101), "needs");
  expect(error_with("/accessors/2/count", 99), "accessors of 99 and 100");
  expect(error_with("/accessors/0/count", 2'000'000'000), "needs");
  expect(error_with("/accessors/0/byteOffset", 9e15), "needs");
  expect(error_with("/accessors/0/type", "MAT4"), "VEC3");
  expect(error_with("/accessors/0/type", "SCALAR"), "not of 3 floats");
  expect(error_with("/accessors/0/bufferView", 99), "bufferViews");
  expect(error_with("/bufferViews/0/buffer", 1), "there are 1 buffers");
  expect(error_with("/bufferViews/0/byteOffset", 1e9), "needs");
  expect(error_with("/bufferViews/0/byteOffset", -4), "whole number");
  expect(error_with("/bufferViews/0/byteStride", 4), "byteStride");
  expect(error_with("/buffers/0/byteLength", 1e9), "there are");
  expect(error_with("/accessors/0/sparse", Json::object()), "sparse");
  EXPECT_FALSE(Read(good.bytes(), {.max_gaussians = 99}).ok());
  const std::string bytes = good.bytes();
  const auto with_word = [&bytes](size_t at, uint32_t value) {
    std::string changed = bytes;
    std::memcpy(changed.data() + at, &value, sizeof value);
    const auto cloud = Read(changed);
    return cloud.ok() ? std::string("accepted") : cloud.error().message;
  };
  expect(with_word(8, 0xffffffff), "the header says 4294967295 bytes");
  expect(with_word(8, 100), "the header says 100 bytes");
  expect(Read(bytes + "tail").error().message, "truncated or extended");
  expect(with_word(bytes.size() - good.binary.size() - 8, static_cast<uint32_t>(good.binary.size() + 1)),
         "a binary chunk of");
  for (const size_t size : {size_t{4}, size_t{19}, size_t{100}, bytes.size() - 1}) {
    EXPECT_FALSE(Read(bytes.substr(0, size)).ok()) << size;
  }
  // One mesh, shown by two thousand nodes.
  Glb crowd = good;
  crowd.json["nodes"] = Json::array();
  for (int k = 0; k < 2000; ++k) crowd.json["nodes"].push_back({{"mesh", 0}});
  expect(Read(crowd.bytes()).error().message, "the limit of 1024 splat");
}

}  // namespace
}  // namespace anchorsplat
