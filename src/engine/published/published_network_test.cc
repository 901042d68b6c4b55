#include "published/published_network.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "core/parallel.h"
#include "core/source_dir_for_test.h"
#include "core/text.h"
#include "published/golden_run_for_test.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;

// Made once: 48 million weights take their time.
const PublishedNetwork& GoldenNetwork(const GoldenRun& golden) {
  static const PublishedNetwork network = *PublishedNetwork::Load(golden.config, HashWeights());
  return network;
}

Buffer<float> RunNetwork(const GoldenRun& golden, Rounding rounding = Rounding::kNone,
                         const PublishedNetwork* network = nullptr) {
  if (network == nullptr) network = &GoldenNetwork(golden);
  const Buffer<float> context = network->Context(golden.features.data(), golden.Levels(), rounding);
  Buffer<float> out(golden.expected.size());
  network->Gaussians(context.data(), golden.features.data(), golden.count, out.data());
  return out;
}

double LargestDifference(const Buffer<float>& a, const Buffer<float>& b, int64_t offset = 0,
                         int64_t channels = kFeatures) {
  double largest = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    const int64_t column = static_cast<int64_t>(i) % kFeatures;
    if (column < offset || column >= offset + channels) continue;
    const double difference = std::fabs(double{a[i]} - b[i]);
    if (!(difference <= largest)) largest = difference;  // NaN stays
  }
  return largest;
}

const Buffer<float>& GoldenOutput(const GoldenRun& golden) {
  static const Buffer<float> output = RunNetwork(golden);
  return output;
}

TEST(PublishedNetwork, MatchesThePublishedNetwork) {
  const GoldenRun golden;
  const double error = LargestDifference(GoldenOutput(golden), golden.expected);
  EXPECT_LE(error, 2e-5);
  RecordProperty("max_abs_error", std::to_string(error));
}

TEST(PublishedNetwork, RoundedAttentionStaysAsCloseAsThePublishedOne) {
  const GoldenRun golden;
  for (const auto& [rounding, key] : {std::pair{Rounding::kHalf, "max_abs_diff_fp16_vs_fp32"},
                                      std::pair{Rounding::kBFloat16, "max_abs_diff_bf16_vs_fp32"}}) {
    const Buffer<float> out = RunNetwork(golden, rounding);
    for (const Attribute& a : kAttributes) {
      const double published = golden.manifest[key][a.name].get<double>();
      const double ours = LargestDifference(out, golden.expected, a.offset, a.channels);
      // Flash attention rounds probabilities that depend on its tiling, so the same size is all there is to ask.
      EXPECT_LT(ours, 2 * published) << key << " " << a.name;
      EXPECT_GT(ours, published / 8) << key << " " << a.name;
    }
  }
}

TEST(PublishedNetwork, BFloat16StaysWithinItsRoundings) {
  const GoldenRun golden;
  const auto network = PublishedNetwork::Load(golden.config, HashWeights(), WeightPrecision::kBFloat16);
  ASSERT_TRUE(network.ok());
  const Buffer<float> out = RunNetwork(golden, Rounding::kNone, &*network);
  const double error = LargestDifference(out, golden.expected);
  // Eight bits of mantissa through 22 blocks; the attributes' changes are of size 1.
  EXPECT_LT(error, 0.1);
  EXPECT_GT(error, 1e-3) << "nothing was rounded";
  RecordProperty("max_abs_error", std::to_string(error));
  double difference = 0, change = 0;  // sums of squares
  for (size_t i = 0; i < out.size(); ++i) {
    const double expected = golden.expected[i];
    difference += (out[i] - expected) * (out[i] - expected);
    const double anchor = golden.features[i % golden.features.size()];  // copy after copy
    change += (expected - anchor) * (expected - anchor);
  }
  const double relative = std::sqrt(difference / change);
  EXPECT_LT(relative, 0.03);
  RecordProperty("rms_of_change", std::to_string(relative));
  EXPECT_TRUE(out == RunNetwork(golden, Rounding::kBFloat16, &*network))
      << "the attention is of the weights' precision";
}

TEST(PublishedNetwork, SameBitsForAnyNumberOfThreads) {
  const GoldenRun golden;
  SetThreadCount(1);
  const Buffer<float> one = RunNetwork(golden);
  SetThreadCount(0);
  EXPECT_TRUE(one == GoldenOutput(golden));
}

PublishedConfig SmallConfig(int64_t copies) {
  PublishedConfig config;
  config.copies = copies;
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

TEST(PublishedNetwork, RefusesBrokenWeights) {
  const PublishedConfig config = SmallConfig(1);
  const WeightSource hash = HashWeights();
  const auto with = [&](const std::string& name, float value) {
    return PublishedNetwork::Load(config, [&](const TensorSpec& tensor, std::span<float> values) -> Status {
      ANCHORSPLAT_RETURN_IF_ERROR(hash(tensor, values));
      if (tensor.name == name) values[3] = value;
      return {};
    });
  };
  const std::string weight = "backbone.backbone.enc.enc1.block0.attn.qkv.weight";
  const auto broken = with(weight, std::numeric_limits<float>::quiet_NaN());
  ASSERT_FALSE(broken.ok());
  EXPECT_THAT(broken.error().message, HasSubstr(weight));
  EXPECT_THAT(broken.error().message, HasSubstr("NaN at element 3"));
  EXPECT_THAT(with("backbone.backbone.embedding.1.running_var", -1).error().message, HasSubstr("variance"));
  EXPECT_TRUE(with(weight, 1).ok());
}

TEST(PublishedNetwork, OneAnchor) {
  const PublishedConfig config = SmallConfig(3);
  const auto network = PublishedNetwork::Load(config, HashWeights());
  ASSERT_TRUE(network.ok());
  Buffer<float> features;
  features.assign(kFeatures, 0.25f);
  const auto levels = BuildHierarchy(GridVoxels(features.data(), 1, kFeatures), HierarchyOptionsFor(config));
  ASSERT_TRUE(levels.ok());
  const Buffer<float> context = network->Context(features.data(), *levels);
  ASSERT_EQ(context.size(), 8u);
  Buffer<float> out(3 * kFeatures);
  network->Gaussians(context.data(), features.data(), 1, out.data());
  for (const float v : out) EXPECT_TRUE(std::isfinite(v));
  for (size_t k = 0; k < 3; ++k) EXPECT_LE(std::fabs(out[k * kFeatures] - 0.25f), 0.01501f);
}

TEST(PublishedConfig, TensorsAreThoseOfPublishedCheckpoints) {
  for (const int copies : {20, 1}) {
    PublishedConfig config;
    config.copies = copies;
    std::ifstream listing(SourceDirForTest().string() + Cat("/testdata/network/state_dict_", copies, "x.txt"));
    const auto tensors = PublishedTensors(config);
    size_t i = 0;
    for (std::string line; std::getline(listing, line); ++i) {
      ASSERT_LT(i, tensors.size());
      std::string shape;
      for (const int64_t d : tensors[i].shape) shape += Cat(shape.empty() ? "" : ", ", d);
      if (tensors[i].shape.size() == 1) shape += ",";
      EXPECT_EQ(Cat(tensors[i].name, " (", shape, ") ", tensors[i].counter ? "int64" : "float32"), line);
    }
    EXPECT_EQ(i, 541u);
    EXPECT_EQ(tensors.size(), 541u);
  }
}

TEST(PublishedConfig, IsReadFromTensors) {
  PublishedConfig config;
  config.copies = 7;
  config.encoder_channels = {32, 48, 64};
  config.encoder_blocks = {1, 2, 3};
  config.encoder_heads = {2, 4, 8};
  config.decoder_channels = {16, 24};
  config.decoder_blocks = {2, 1};
  config.decoder_heads = {4, 4};
  config.strides = {1, 2};
  config.head_hidden = 40;
  const auto tensors = PublishedTensors(config);
  const auto read = ConfigOfTensors(tensors);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->copies, 7);
  EXPECT_EQ(read->encoder_channels, config.encoder_channels);
  EXPECT_EQ(read->encoder_blocks, config.encoder_blocks);
  EXPECT_EQ(read->encoder_heads, config.encoder_heads);
  EXPECT_EQ(read->decoder_channels, config.decoder_channels);
  EXPECT_EQ(read->decoder_blocks, config.decoder_blocks);
  EXPECT_EQ(read->strides, config.strides);
  EXPECT_EQ(read->head_hidden, 40);

  EXPECT_THAT(ConfigOfTensors({}).error().message, HasSubstr("point_embeddings.means"));
  config.encoder_channels[2] = 65;
  EXPECT_THAT(ConfigOfTensors(PublishedTensors(config)).error().message, HasSubstr("65 channels wide"));
}

}  // namespace
}  // namespace anchorsplat
