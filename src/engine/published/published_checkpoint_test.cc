#include "published/published_checkpoint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "tensors/safetensors.h"

namespace anchorsplat {
namespace {

using testing::AllOf;
using testing::HasSubstr;

PublishedConfig SmallConfig() {
  PublishedConfig config;
  config.copies = 3;
  config.encoder_channels = {8, 12};
  config.encoder_blocks = {1, 1};
  config.encoder_heads = {2, 4};
  config.decoder_channels = {8};
  config.decoder_blocks = {1};
  config.decoder_heads = {4};
  config.strides = {1};
  config.head_hidden = 16;
  return config;
}

// A checkpoint of SmallConfig with hash weights, to be damaged before it is written.
class CheckpointTest : public testing::Test {
 protected:
  CheckpointTest() {
    const WeightSource hash = HashWeights();
    for (const TensorSpec& tensor : PublishedTensors(SmallConfig())) {
      int64_t count = 1;
      for (const int64_t d : tensor.shape) count *= d;
      std::vector<float> values(static_cast<size_t>(count));
      if (!tensor.counter) {
        EXPECT_TRUE(hash(tensor, values).ok());
      }
      specs.push_back(tensor);
      arrays.push_back(std::move(values));
    }
    std::filesystem::create_directories(path.parent_path());
  }
  ~CheckpointTest() override { std::filesystem::remove(path); }

  size_t IndexOf(const std::string& name) const {
    const auto at = std::find_if(specs.begin(), specs.end(), [&](const TensorSpec& s) { return s.name == name; });
    EXPECT_NE(at, specs.end()) << name;
    return static_cast<size_t>(at - specs.begin());
  }

  void Write() const {
    std::vector<TensorEntry> entries;
    for (size_t i = 0; i < specs.size(); ++i) entries.push_back(MakeEntry(specs[i].name, specs[i].shape, arrays[i]));
    const Status written = WriteSafetensors(path, entries, {}, {.overwrite = true});
    ASSERT_TRUE(written.ok()) << written.error().message;
  }

  std::string ErrorOfLoading() const {
    Write();
    const auto network = LoadPublishedNetwork(path);
    EXPECT_FALSE(network.ok());
    if (network.ok()) return "";
    EXPECT_THAT(network.error().message, HasSubstr(path.filename().string()));
    return network.error().message;
  }

  std::vector<TensorSpec> specs;
  std::vector<std::vector<float>> arrays;
  const std::filesystem::path path =
      std::filesystem::path(testing::TempDir()) / "anchorsplat_checkpoint_test" /
      (std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".safetensors");
  const std::string qkv = "backbone.backbone.enc.enc1.block0.attn.qkv.weight";
};

TEST_F(CheckpointTest, ShapeAndWeightsComeFromTheFile) {
  Write();
  const auto loaded = LoadPublishedNetwork(path);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_EQ(loaded->config().copies, 3);
  EXPECT_EQ(loaded->config().encoder_channels, SmallConfig().encoder_channels);
  EXPECT_EQ(loaded->config().head_hidden, 16);

  const auto direct = PublishedNetwork::Load(SmallConfig(), HashWeights());
  Buffer<float> features;
  for (int i = 0; i < 5 * kFeatures; ++i) features.push_back(0.5f + 0.4f * std::sin(static_cast<float>(i)));
  const auto levels = BuildHierarchy(GridVoxels(features.data(), 5, kFeatures), HierarchyOptionsFor(SmallConfig()));
  ASSERT_TRUE(levels.ok());
  EXPECT_EQ(loaded->Context(features.data(), *levels), direct->Context(features.data(), *levels));
}

TEST_F(CheckpointTest, CountersMayBeAbsent) {
  for (size_t i = specs.size(); i-- > 0;) {
    if (!specs[i].counter) continue;
    specs.erase(specs.begin() + static_cast<std::ptrdiff_t>(i));
    arrays.erase(arrays.begin() + static_cast<std::ptrdiff_t>(i));
  }
  Write();
  EXPECT_TRUE(LoadPublishedNetwork(path).ok());
}

TEST_F(CheckpointTest, AnotherShapeIsNamedWithBoth) {
  const size_t i = IndexOf(qkv);
  ASSERT_EQ(specs[i].shape, (std::vector<int64_t>{36, 12}));
  specs[i].shape = {12, 36};
  EXPECT_THAT(ErrorOfLoading(), AllOf(HasSubstr(qkv), HasSubstr("[12, 36]"), HasSubstr("[36, 12]")));
}

TEST_F(CheckpointTest, MissingAndUnknownTensorsAreNamed) {
  specs[IndexOf(qkv)].name = "backbone.backbone.surplus";
  EXPECT_THAT(ErrorOfLoading(), AllOf(HasSubstr("missing"), HasSubstr(qkv)));
  specs[IndexOf("backbone.backbone.surplus")].name = qkv;
  specs.push_back({"backbone.extra", {2}});
  arrays.push_back({1, 2});
  EXPECT_THAT(ErrorOfLoading(), AllOf(HasSubstr("belong to no part"), HasSubstr("backbone.extra")));
}

TEST_F(CheckpointTest, OtherNetworksAreRefused) {
  specs = {{"conv1.weight", {2}}};
  arrays = {{1, 2}};
  EXPECT_THAT(ErrorOfLoading(), HasSubstr("not a checkpoint of AnchorSplat"));
}

TEST_F(CheckpointTest, BrokenWeightsAreRefused) {
  arrays[IndexOf(qkv)][5] = std::numeric_limits<float>::infinity();
  EXPECT_THAT(ErrorOfLoading(), AllOf(HasSubstr(qkv), HasSubstr("infinity at element 5")));
}

TEST_F(CheckpointTest, NoFile) { EXPECT_EQ(LoadPublishedNetwork(path / "nowhere").error().code, ErrorCode::kNotFound); }

}  // namespace
}  // namespace anchorsplat
