#include "compact/compact_network.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "compact/compact_residual.h"
#include "compact/sheet_cloud_for_test.h"
#include "core/memory_limit.h"
#include "core/parallel.h"
#include "enhance/filter.h"
#include "io/folder_for_test.h"
#include "tensors/safetensors.h"

namespace anchorsplat {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
const float kPixel = kSheetPixel;

CompactNetwork Network(const CompactConfig& config = {}, const WeightSource& source = OpenDomain()) {
  auto network = CompactNetwork::Load(config, source);
  EXPECT_TRUE(network.ok()) << network.error().message;
  return *std::move(network);
}

CompactTask Task() { return {.pixel_sizes = {&kPixel, 1}, .upscale = 4, .strength = DefaultFilterStrength(4)}; }

bool SameValues(const GaussianCloud& a, const GaussianCloud& b) {
  return a.means == b.means && a.log_scales == b.log_scales && a.quats == b.quats &&
         a.opacity_logits == b.opacity_logits && a.sh == b.sh;
}

TEST(CompactNetwork, SameBitsForAnyNumberOfThreads) {
  const GaussianCloud cloud = SheetCloud(1500);
  const CompactNetwork network = Network();
  SetThreadCount(1);
  const auto one = network.Apply(cloud, Task());
  SetThreadCount(3);
  const auto three = network.Apply(cloud, Task());
  SetThreadCount(0);
  ASSERT_TRUE(one.ok() && three.ok());
  EXPECT_EQ(one->cloud.size(), 4 * 1500);
  EXPECT_TRUE(SameValues(one->cloud, three->cloud));
}

// What a Gaussian becomes depends on its neighbours' neighbours and no others, whatever chunk it is in.
TEST(CompactNetwork, FarAwayGaussiansMakeNoDifference) {
  GaussianCloud near = SheetCloud(200), far = SheetCloud(333, 3, 9);
  for (int64_t i = 0; i < far.size(); ++i) far.means[static_cast<size_t>(3 * i)] += 100;
  GaussianCloud both = far;
  ASSERT_TRUE(Append(both, near).ok());
  const CompactNetwork network = Network();
  const auto alone = network.Apply(near, Task()), together = network.Apply(both, Task());
  ASSERT_TRUE(alone.ok() && together.ok());
  for (int64_t k = 0; k < 4; ++k) {
    for (int64_t c = 0; c < 3 * near.size(); ++c) {
      ASSERT_EQ(alone->cloud.means[static_cast<size_t>(k * 3 * near.size() + c)],
                together->cloud.means[static_cast<size_t>(k * 3 * both.size() + 3 * far.size() + c)]);
    }
  }
}

void ExpectSameBits(const CompactResult& a, const CompactResult& b) {
  EXPECT_EQ(a.made, b.made);
  EXPECT_EQ(a.chosen.merged, b.chosen.merged);
  EXPECT_EQ(a.chosen.left_out, b.chosen.left_out);
  EXPECT_EQ(a.cloud.means, b.cloud.means);
  EXPECT_EQ(a.cloud.log_scales, b.cloud.log_scales);
  EXPECT_EQ(a.cloud.quats, b.cloud.quats);
  EXPECT_EQ(a.cloud.opacity_logits, b.cloud.opacity_logits);
  EXPECT_EQ(a.cloud.sh, b.cloud.sh);
}

TEST(CompactNetwork, BlocksOfAnySizeSayTheSameBits) {
  const GaussianCloud cloud = SheetCloud(1500);
  for (const CompactConfig& config : {CompactConfig{}, CompactConfig{.rounds = 3, .neighbours = 5},
                                      CompactConfig{.rounds = 0}, CompactConfig{.context = CompactContext::kPatches}}) {
    const CompactNetwork network = Network(config);
    const auto whole = network.Apply(cloud, Task());
    ASSERT_TRUE(whole.ok());
    for (const int64_t block : {1, 37, 128, 1000, 1499}) {
      if (block == 1 && config.rounds != 0) continue;  // takes long
      CompactTask task = Task();
      task.block_gaussians = block;
      const auto cut = network.Apply(cloud, task);
      ASSERT_TRUE(cut.ok());
      SCOPED_TRACE(block);
      ExpectSameBits(*whole, *cut);
    }
  }
  CompactTask none = Task();
  none.block_gaussians = 0;
  EXPECT_FALSE(Network({}).Apply(cloud, none).ok());
}

TEST(CompactNetwork, ArraysOnDiskSayTheSameBits) {
  const GaussianCloud cloud = SheetCloud(12'000);
  const CompactNetwork network = Network({});
  const auto in_memory = network.Apply(cloud, Task());
  ASSERT_TRUE(in_memory.ok());
  const TestFolder folder;
  const MemoryLimit limit(0, folder.path());
  const auto on_disk = network.Apply(cloud, Task());
  ASSERT_TRUE(on_disk.ok());
  EXPECT_GT(limit.most_on_disk(), 9'000'000u);
  EXPECT_EQ(folder.Entries(), 0);
  ExpectSameBits(*in_memory, *on_disk);
}

TEST(CompactNetwork, OddCloudsStayFinite) {
  GaussianCloud hostile = SheetCloud(300);
  std::fill(hostile.means.begin(), hostile.means.begin() + 300, 0.25f);  // a hundred at one place
  hostile.means[900 - 1] = 3e38f;
  hostile.means[900 - 2] = -3e38f;
  hostile.log_scales[0] = -kInfinity;
  hostile.log_scales[3] = 40;
  hostile.log_scales[6] = -200;
  hostile.opacity_logits[0] = -kInfinity;
  hostile.opacity_logits[1] = 1e30f;
  hostile.opacity_logits[2] = -1e30f;
  hostile.opacity_logits[3] = -3e38f;
  std::fill_n(hostile.quats.begin(), 4, 0.0f);
  std::fill_n(hostile.quats.begin() + 4, 4, 1e-30f);
  hostile.sh[5] = 1e38f;
  for (const CompactConfig& config : {CompactConfig{}, CompactConfig{.copies = 3, .prior = false, .anchors = false}}) {
    const CompactNetwork network = Network(config);
    for (const GaussianCloud& cloud : {SheetCloud(1), SheetCloud(2), SheetCloud(8, 0), hostile}) {
      for (const float pixel : {kPixel, 1e-38f, 1e15f}) {
        CompactTask task = Task();
        task.pixel_sizes = {&pixel, 1};
        const auto result = network.Apply(cloud, task);
        ASSERT_TRUE(result.ok()) << result.error().message;
        const bool wider = pixel < kPixel;  // all of them, by far, and stay one
        EXPECT_EQ(result->cloud.size(), (wider ? 1 : config.copies) * cloud.size());
        for (int64_t i = 0; i < result->cloud.size(); ++i) EXPECT_TRUE(IsUsable(result->cloud, i)) << i;
      }
    }
  }
}

TEST(CompactNetwork, GaussiansUnlikeTheTrainingDataAreFilteredAndStayAlone) {
  GaussianCloud cloud = SheetCloud(100);
  for (size_t c = 0; c < 3; ++c) {
    cloud.log_scales[3 * 10 + c] = std::log(kPixel) + 2 * (c == 0 ? 1.0f : -2.0f);         // at the limit
    cloud.log_scales[3 * 20 + c] = std::log(kPixel) + 2 * (c == 0 ? 1.0f + 0.5f : -2.0f);  // half-way
    cloud.log_scales[3 * 30 + c] = std::log(kPixel) + 2 * (c == 0 ? 1.0f + 0.9f : -2.0f);  // outside
  }
  const auto domain = [](const TensorSpec& tensor, std::span<float> values) -> Status {
    const Status status = OpenDomain()(tensor, values);
    if (tensor.name == "domain.high") values[0] = 1;
    return status;
  };
  const auto result = Network({}, domain).Apply(cloud, Task());
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->unlike_training, 1);
  EXPECT_EQ(result->partly_unlike_training, 1);
  ASSERT_EQ(result->cloud.size(), 4 * 99 + 1);
  ASSERT_TRUE(ApplyFilter(cloud, {&kPixel, 1}, {.upscale = 4, .strength = {}}).ok());
  const size_t last = 4 * 99;
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(result->cloud.means[3 * last + c], cloud.means[90 + c]);
    EXPECT_NEAR(result->cloud.log_scales[3 * last + c], cloud.log_scales[90 + c], 1e-6);
  }
  EXPECT_EQ(result->cloud.opacity_logits[last], cloud.opacity_logits[30]);
}

// The features of widths end where training data do not reach; what lies beyond must not look like the end.
TEST(CompactNetwork, WidthsBeyondTheFeaturesBoundsAreUnlikeTheTrainingData) {
  const auto range = [](float low, float high) {
    return [=](const TensorSpec& tensor, std::span<float> values) -> Status {
      const Status status = OpenDomain()(tensor, values);
      for (size_t a = 0; a < 3; ++a) {
        if (tensor.name == "domain.low") values[a] = low;
        if (tensor.name == "domain.high") values[a] = high;
      }
      return status;
    };
  };
  const CompactNetwork network = Network({}, range(-2.9f, 1.9f));
  for (const float width : {std::exp(8.0f), std::exp(-12.0f), 0.0f}) {
    GaussianCloud cloud = SheetCloud(60);
    for (float& s : cloud.log_scales) s = std::log(kPixel * width);
    const auto result = network.Apply(cloud, Task());
    ASSERT_TRUE(result.ok());
    EXPECT_EQ(result->unlike_training, 60) << width;
  }
  // Trained up to the bounds: nobody knows how far beyond.
  const CompactNetwork wide = Network({}, range(kLowestWidth, kHighestWidth));
  GaussianCloud cloud = SheetCloud(60);
  for (float& s : cloud.log_scales) s = std::log(kPixel) - 12;
  EXPECT_EQ(wide.Apply(cloud, Task())->unlike_training, 0);
}

// Their copies might come before what was in front of them.
TEST(CompactNetwork, WhatIsWiderThanPixelsStaysOne) {
  const CompactNetwork network = Network({});
  const auto made = [&](float middle) {
    GaussianCloud cloud = SheetCloud(60);
    for (size_t i = 0; i < 60; ++i) {
      for (size_t a = 0; a < 3; ++a) {
        cloud.log_scales[3 * i + a] = std::log(kPixel * (a == 0 ? 12.0f : a == 1 ? middle : 0.1f));
      }
    }
    const auto result = network.Apply(cloud, Task());
    EXPECT_TRUE(result.ok());
    EXPECT_EQ(result->unlike_training + result->partly_unlike_training, 0) << "it is nothing that training had not";
    return result.ok() ? result->cloud : GaussianCloud{};
  };
  EXPECT_EQ(made(kLargeFadeBegin - 1).size(), 4 * 60);
  EXPECT_EQ(made(kLargeFadeEnd + 1).size(), 60);
  const GaussianCloud half = made(0.5f * (kLargeFadeBegin + kLargeFadeEnd));
  EXPECT_EQ(half.size(), 4 * 60) << "copies that have hardly moved";
  // One of several copies only: what makes one of each moves nothing apart.
  const CompactNetwork single = Network({.copies = 1});
  GaussianCloud cloud = SheetCloud(60);
  for (float& s : cloud.log_scales) s = std::log(kPixel * 10);
  const auto same = single.Apply(cloud, Task());
  ASSERT_TRUE(same.ok());
  EXPECT_EQ(same->unlike_training, 0);
  EXPECT_NE(std::vector<float>(same->cloud.sh.begin(), same->cloud.sh.end()),
            std::vector<float>(cloud.sh.begin(), cloud.sh.end()));
}

TEST(CompactNetwork, SaysWhenItsOutputIsNotFinite) {
  const auto damaged = [](const TensorSpec& tensor, std::span<float> values) -> Status {
    const Status status = OpenDomain()(tensor, values);
    if (tensor.name.starts_with("head.") && tensor.name.ends_with(".weight")) {
      std::fill(values.begin(), values.end(), 3e38f);
    }
    return status;
  };
  const GaussianCloud cloud = SheetCloud(60);
  const auto result = Network({}, damaged).Apply(cloud, Task());
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->not_finite, 60);
  for (int64_t i = 0; i < result->cloud.size(); ++i) EXPECT_TRUE(IsUsable(result->cloud, i)) << i;
  EXPECT_EQ(Network().Apply(cloud, Task())->not_finite, 0);
}

TEST(CompactNetwork, RefusesBadTasks) {
  const CompactNetwork network = Network();
  const GaussianCloud cloud = SheetCloud(5);
  const float wrong[] = {0.0f, -1.0f, kInfinity, std::nanf("")};
  for (const float& p : wrong) {
    CompactTask task = Task();
    task.pixel_sizes = {&p, 1};
    EXPECT_FALSE(network.Apply(cloud, task).ok()) << p;
  }
  CompactTask task = Task();
  task.pixel_sizes = {wrong, 3};
  EXPECT_THAT(network.Apply(cloud, task).error().message, testing::HasSubstr("3 pixel sizes for 5"));
  task = Task();
  task.upscale = 0.5;
  EXPECT_FALSE(network.Apply(cloud, task).ok());
  task = Task();
  task.strength = -1;
  EXPECT_FALSE(network.Apply(cloud, task).ok());
  EXPECT_FALSE(network.Apply(SheetCloud(0), Task()).ok());
}

// A file as training writes it, with one thing changed.
class CompactFile {
 public:
  explicit CompactFile(const CompactConfig& config = {.hidden = 16, .head_hidden = 16}) : metadata(ToMetadata(config)) {
    for (const TensorSpec& spec : CompactTensors(config)) {
      int64_t count = 1;
      for (const int64_t side : spec.shape) count *= side;
      auto& array = values[spec.name];
      array.resize(static_cast<size_t>(count));
      EXPECT_TRUE(OpenDomain()(spec, array).ok());
      shapes[spec.name] = spec.shape;
    }
  }
  // The message of opening it; empty when that worked.
  std::string Open() const {
    const TestFolder folder;
    const auto path = folder / "anchorsplat_compact.safetensors";
    std::vector<TensorEntry> entries;
    for (const auto& [name, array] : values) entries.push_back(MakeEntry(name, shapes.at(name), array));
    EXPECT_TRUE(WriteSafetensors(path, entries, metadata, {.overwrite = true}).ok());
    const auto file = TensorFile::Open(path);
    EXPECT_TRUE(file.ok());
    EXPECT_EQ(IsCompactNetwork(*file), metadata.contains("format"));
    const auto network = LoadCompactNetwork(*file);
    if (network.ok()) {
      knows_its_domain_ = network->HasTrainingRange();
      return "";
    }
    EXPECT_EQ(network.error().code, ErrorCode::kBadFile);
    EXPECT_THAT(network.error().message, testing::HasSubstr("anchorsplat_compact.safetensors: "));
    return network.error().message;
  }

  bool knows_its_domain() const {
    EXPECT_EQ(Open(), "");
    return knows_its_domain_;
  }

  std::map<std::string, std::string> metadata;
  std::map<std::string, std::vector<float>> values;
  std::map<std::string, std::vector<int64_t>> shapes;

 private:
  mutable bool knows_its_domain_ = false;
};

TEST(CompactNetworkFile, OpensWhatWasWritten) {
  EXPECT_EQ(CompactFile().Open(), "");
  EXPECT_EQ(CompactFile({.copies = 1, .hidden = 32, .rounds = 0, .head_hidden = 16, .sh = false}).Open(), "");
  CompactFile more;
  more.metadata["licence"] = "Apache-2.0";
  EXPECT_EQ(more.Open(), "");
}

TEST(CompactNetworkFile, SaysWhenItDoesNotKnowItsDomain) {
  CompactFile file;
  EXPECT_TRUE(file.knows_its_domain());
  file.values["domain.low"][7] = 2;
  file.values["domain.high"][7] = 1;
  EXPECT_FALSE(file.knows_its_domain());
}

TEST(CompactNetworkFile, RefusesDamage) {
  using testing::HasSubstr;
  CompactFile file;
  file.metadata["option.wings"] = "2";
  EXPECT_THAT(file.Open(), HasSubstr("option.wings"));
  file = CompactFile();
  file.metadata["option.copies"] = "1000000000";
  EXPECT_THAT(file.Open(), HasSubstr("a whole number from 1 to 64"));
  file = CompactFile();
  file.metadata["option.offset_unit"] = "mile";
  EXPECT_THAT(file.Open(), HasSubstr("one of scale, pixel, cube"));
  file = CompactFile();
  file.metadata["option.prior"] = "perhaps";
  EXPECT_THAT(file.Open(), HasSubstr("true or false"));
  file = CompactFile();
  file.metadata["option.epsilon"] = "nan";
  EXPECT_THAT(file.Open(), HasSubstr("a number from"));
  file = CompactFile();
  file.metadata["option.hidden"] = "40";
  EXPECT_THAT(file.Open(), HasSubstr("multiple of 16"));
  file = CompactFile();
  file.metadata["option.hidden"] = "32";
  EXPECT_THAT(file.Open(), HasSubstr("embed.first"));
  file = CompactFile();
  file.values.erase("rounds.1.edge.weight");
  EXPECT_THAT(file.Open(), HasSubstr("rounds.1.edge.weight"));
  file = CompactFile();
  file.values["extra"] = {1};
  file.shapes["extra"] = {1};
  EXPECT_THAT(file.Open(), HasSubstr("\"extra\""));
  file = CompactFile();
  file.values["out.means.bias"][3] = kInfinity;
  EXPECT_THAT(file.Open(), HasSubstr("out.means.bias"));
}

}  // namespace
}  // namespace anchorsplat
