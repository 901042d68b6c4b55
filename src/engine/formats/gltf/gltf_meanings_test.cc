#include "formats/gltf/gltf_meanings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "core/camera.h"
#include "core/messages_for_test.h"
#include "core/text.h"
#include "formats/gltf/gltf_blocks.h"
#include "formats/gltf/gltf_example_for_test.h"
#include "formats/gltf/gltf_reader.h"
#include "render/rasterizer.h"

namespace anchorsplat {
namespace {

TEST(Gltf, LogarithmsOfDraftsAreKnownByTheirSign) {
  Glb glb = Example(1, 0);
  SetAttribute(glb, kGltfScales, {-3, 0.5f, -2});
  Messages messages;
  EXPECT_THAT(Read(glb.bytes())->log_scales, testing::ElementsAre(-3, 0.5f, -2));
  EXPECT_THAT(messages.TakeWarnings(), testing::ElementsAre(testing::HasSubstr("read as logarithms")));
  SetAttribute(glb, kGltfScales, {-1e-8f, 1, 1});  // next to nothing
  EXPECT_TRUE(std::isinf(Read(glb.bytes())->log_scales[0]));
  EXPECT_THAT(messages.TakeWarnings(), testing::IsEmpty());
  // One of many is damage.
  Glb many = Example(400, 0);
  std::vector<float> lengths(1200, 0.1f);
  lengths[77] = -4;
  SetAttribute(many, kGltfScales, lengths);
  EXPECT_THAT(Read(many.bytes()).error().message, testing::HasSubstr("SCALE: has 1 of 1,200 values below 0"));
}

TEST(Gltf, LogitsOfDraftsAreKnownByTheirRange) {
  Glb glb = Example(400, 0);
  const auto error_of = [&glb](const std::vector<float>& values) {
    SetAttribute(glb, kGltfOpacities, values);
    const auto cloud = Read(glb.bytes());
    return cloud.ok() ? std::string("accepted") : cloud.error().message;
  };
  std::vector<float> values(400);
  Messages messages;
  for (const auto& [low, high] : {std::pair(-6.0f, 1.0f), std::pair(0.5f, 4.0f), std::pair(-200.0f, 20.0f)}) {
    for (size_t i = 0; i < 400; ++i) values[i] = low + (high - low) * static_cast<float>(i) / 399;
    SetAttribute(glb, kGltfOpacities, values);
    const auto cloud = Read(glb.bytes());
    ASSERT_TRUE(cloud.ok()) << cloud.error().message;
    EXPECT_EQ(cloud->opacity_logits[5], values[5]);
    EXPECT_THAT(messages.TakeWarnings(), testing::ElementsAre(testing::HasSubstr("read as logits")));
  }
  for (const float most : {1.0f, 1.0005f}) {
    for (size_t i = 0; i < 400; ++i) values[i] = most * static_cast<float>(i) / 399;
    EXPECT_EQ(error_of(values), "accepted");
    EXPECT_THAT(messages.TakeWarnings(), testing::IsEmpty());
  }
  for (const float most : {100.0f, 255.0f}) {
    for (size_t i = 0; i < 400; ++i) values[i] = most * static_cast<float>(i) / 399;
    EXPECT_THAT(error_of(values), testing::HasSubstr("nor logits"));
  }
  values.assign(400, 0.5f);
  values[3] = 1.2f;
  EXPECT_THAT(error_of(values), testing::HasSubstr("OPACITY: has 1 of 400 values outside of 0 to 1"));
  // Bytes that are not normalized.
  const int accessor = glb.json["meshes"][0]["primitives"][0]["attributes"][kGltfOpacities];
  glb.json["accessors"][accessor]["componentType"] = 5121;
  EXPECT_THAT(Read(glb.bytes()).error().message, testing::HasSubstr("not normalized"));
}

TEST(Gltf, LinearLightBecomesSrgb) {
  for (const int degree : {0, 2}) {
    Glb glb = Example(50, degree);
    const GaussianCloud plain = *Read(glb.bytes());
    glb.json["meshes"][0]["primitives"][0]["extensions"]["KHR_gaussian_splatting"]["colorSpace"] = "lin_rec709_display";
    std::vector<float> dc(150);
    for (size_t k = 0; k < 150; ++k) dc[k] = (static_cast<float>(k) / 149 - 0.5f) / 0.28209479f;
    SetAttribute(glb, "KHR_gaussian_splatting:SH_DEGREE_0_COEF_0", dc);
    for (int k = 1; k < ShCoefficients(degree); ++k) {
      const std::string name = k < 4 ? Cat("KHR_gaussian_splatting:SH_DEGREE_1_COEF_", k - 1)
                                     : Cat("KHR_gaussian_splatting:SH_DEGREE_2_COEF_", k - 4);
      SetAttribute(glb, name.c_str(), std::vector<float>(150, 0.0f));
    }
    const InputFile file = InputFile::FromBytes("a.glb", glb.bytes());
    EXPECT_EQ(*BlocksOfGltf(file, {}) == nullptr, degree > 0);  // colours depend on all harmonics
    Messages messages;
    const auto cloud = degree > 0 ? ReadGltf(file) : Read(glb.bytes());
    ASSERT_TRUE(cloud.ok()) << cloud.error().message;
    EXPECT_THAT(messages.TakeWarnings(), testing::ElementsAre(testing::HasSubstr("linear light; converted to sRGB")));
    for (size_t k = 0; k < 150; ++k) {
      const double light = static_cast<double>(k) / 149;
      const double srgb = light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
      const size_t at = k / 3 * static_cast<size_t>(cloud->sh_stride()) + k % 3;
      EXPECT_NEAR(0.5 + 0.28209479 * double{cloud->sh[at]}, srgb, 2e-6);
    }
  }
}

// x' = matrix·x in the file's axes, for the cloud as it is read.
GaussianCloud ReadWithNodes(Glb glb, const char* nodes) {
  glb.json["nodes"] = Json::parse(nodes);
  auto cloud = Read(glb.bytes());
  EXPECT_TRUE(cloud.ok()) << cloud.error().message;
  return cloud.ok() ? *std::move(cloud) : GaussianCloud();
}

// A splat that is moved is seen by a camera that is moved along as it was.
TEST(Gltf, TurnedMirroredAndScaledNodesLookAsTheyShould) {
  Glb glb = Example(300, 3);
  {
    const int scale = glb.json["meshes"][0]["primitives"][0]["attributes"][kGltfScales];
    std::vector<float> lengths(900);
    std::memcpy(lengths.data(), glb.binary.data() + glb.json["bufferViews"][scale]["byteOffset"].get<size_t>(), 3600);
    for (float& x : lengths) x = 0.1f * std::min(x, 3.0f);
    SetAttribute(glb, kGltfScales, lengths);
  }
  const GaussianCloud plain = *Read(glb.bytes());
  struct Case {
    const char* nodes;
    std::array<double, 9> turn;  // in the file's axes
    double scale;
    std::array<double, 3> move;
  };
  const double h = std::sqrt(0.5), q = std::sqrt(0.75);
  const std::vector<Case> cases = {
      {R"([{"mesh":0,"rotation":[0,0,1,0]}])", {-1, 0, 0, 0, -1, 0, 0, 0, 1}, 1, {}},
      {R"([{"mesh":0,"rotation":[-0.7071068,0,0,0.7071068]}])", {1, 0, 0, 0, 0, 1, 0, -1, 0}, 1, {}},
      {R"([{"mesh":0,"matrix":[1,0,0,0, 0,0,-1,0, 0,1,0,0, 5,6,7,1]}])", {1, 0, 0, 0, 0, 1, 0, -1, 0}, 1, {5, 6, 7}},
      {R"([{"mesh":0,"scale":[1,1,-1]}])", {1, 0, 0, 0, 1, 0, 0, 0, -1}, 1, {}},
      {R"([{"mesh":0,"scale":[-2,-2,-2]}])", {-1, 0, 0, 0, -1, 0, 0, 0, -1}, 2, {}},
      {R"([{"mesh":0,"rotation":[0,0.5,0,0.8660254037844386]}])", {0.5, 0, q, 0, 1, 0, -q, 0, 0.5}, 1, {}},
      {R"([{"children":[1],"rotation":[0,0,0.3826834323650898,0.9238795325112867],"translation":[1,0,0]},
           {"children":[2],"scale":[3,3,-3]},{"mesh":0,"translation":[0,0,1]}])",
       {h, -h, 0, h, h, 0, 0, 0, -1},
       3,
       {1, 0, -3}},
      // Stretched and back again.
      {R"([{"children":[1],"scale":[4,1,1]},{"mesh":0,"scale":[0.25,1,1],"rotation":[0,0,0,1]}])",
       {1, 0, 0, 0, 1, 0, 0, 0, 1},
       1,
       {}}};
  const Pinhole intrinsics = PinholeFromFov(96, 80, 0.9);
  const CameraSet orbit = *OrbitCameras(3, 5, {0, 0, 0}, intrinsics);
  Rasterizer rasterizer;
  for (const Case& one : cases) {
    const GaussianCloud moved = ReadWithNodes(glb, one.nodes);
    ASSERT_EQ(moved.size(), 300) << one.nodes;
    // The file's x and y point the other way.
    const std::array<double, 3> flip = {-1, -1, 1};
    for (Camera camera : orbit.cameras) {
      RenderOutput before, after;
      ASSERT_TRUE(rasterizer.Render(plain, camera, {}, before).ok());
      // p = R x + t with x = Mᵀ(y − move)/scale: the same picture, all of it `scale` times as large.
      const Pose old = camera.world_to_camera;
      Pose& pose = camera.world_to_camera;
      for (size_t r = 0; r < 3; ++r) {
        double sum = 0;
        for (size_t c = 0; c < 3; ++c) {
          double value = 0;
          for (size_t k = 0; k < 3; ++k) value += old.rotation[3 * r + k] * flip[k] * one.turn[3 * c + k] * flip[c];
          pose.rotation[3 * r + c] = value;
          sum += value * flip[c] * one.move[c];
        }
        pose.translation[r] = one.scale * old.translation[r] - sum;
      }
      ASSERT_TRUE(rasterizer.Render(moved, camera, {}, after).ok());
      double squares = 0, brightness = 0;
      for (size_t k = 0; k < before.color.pixels.size(); ++k) {
        squares += std::pow(double{before.color.pixels[k]} - after.color.pixels[k], 2);
        brightness += before.color.pixels[k];
      }
      EXPECT_GT(brightness, 100);
      const double psnr = -10 * std::log10(squares / static_cast<double>(before.color.pixels.size()) + 1e-20);
      EXPECT_GT(psnr, 100) << one.nodes;
    }
  }
}

TEST(Gltf, AnotherOrderIsSaid) {
  Glb glb = Example(10, 0);
  glb.json["meshes"][0]["primitives"][0]["extensions"]["KHR_gaussian_splatting"]["sortingMethod"] = "byIndex";
  const Messages messages;
  EXPECT_TRUE(Read(glb.bytes()).ok());
  EXPECT_THAT(messages.warnings(), testing::ElementsAre(testing::HasSubstr("sortingMethod")));
}

TEST(Gltf, OnlyWhatTheSceneShows) {
  Glb glb = Example(10, 0);
  glb.json["nodes"] = Json::parse(R"([{"mesh":0},{"mesh":0,"translation":[9,0,0]},
      {"mesh":0,"translation":[20,0,0],"extensions":{"KHR_node_visibility":{"visible":false}}}])");
  Messages messages;
  EXPECT_EQ(Read(glb.bytes())->size(), 20);
  EXPECT_THAT(messages.TakeWarnings(), testing::ElementsAre(testing::HasSubstr("1 node with splats skipped: hidden")));
  glb.json["scenes"] = Json::parse(R"([{"nodes":[0,2]},{"nodes":[1]}])");
  const GaussianCloud first = *Read(glb.bytes());
  EXPECT_EQ(first.size(), 10);
  EXPECT_THAT(messages.TakeWarnings(), testing::ElementsAre(testing::HasSubstr("2 nodes with splats skipped: hidden")));
  glb.json["scene"] = 1;
  const GaussianCloud second = *Read(glb.bytes());
  EXPECT_NEAR(second.means[0], first.means[0] - 9, 1e-5);
  messages.TakeWarnings();
  glb.json["animations"] = Json::parse(R"([{"channels":[{"sampler":0,"target":{"node":1,"path":"translation"}}]}])");
  glb.json["nodes"][1]["skin"] = 0;
  EXPECT_TRUE(Read(glb.bytes()).ok());
  EXPECT_THAT(messages.TakeWarnings(), testing::Contains(testing::HasSubstr("animation ignored")));
}

}  // namespace
}  // namespace anchorsplat
