#include "published/enhance_with_published.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include "core/log.h"
#include "core/parallel.h"
#include "core/random.h"

namespace anchorsplat {
namespace {

using testing::Contains;
using testing::HasSubstr;

// Narrow and shallow: the tests are about what stands around the network.
PublishedConfig SmallConfig(int64_t copies = 2) {
  PublishedConfig config;
  config.copies = copies;
  config.encoder_channels = {8, 12, 16};
  config.encoder_blocks = {1, 1, 1};
  config.encoder_heads = {2, 4, 8};
  config.decoder_channels = {8, 12};
  config.decoder_blocks = {1, 1};
  config.decoder_heads = {4, 4};
  config.strides = {1, 2};
  config.head_hidden = 16;
  config.patch_size = 64;
  return config;
}

PublishedNetwork SmallNetwork(int64_t copies = 2) {
  auto network = PublishedNetwork::Load(SmallConfig(copies), HashWeights());
  EXPECT_TRUE(network.ok());
  return *std::move(network);
}

// The same network with last layers of zero: every output is its anchor.
PublishedNetwork IdentityNetwork(int64_t copies = 2) {
  const WeightSource hash = HashWeights();
  auto network =
      PublishedNetwork::Load(SmallConfig(copies), [&](const TensorSpec& tensor, std::span<float> values) -> Status {
        ANCHORSPLAT_RETURN_IF_ERROR(hash(tensor, values));
        if (tensor.name.find(".6.") != std::string::npos || tensor.name.starts_with("point_embeddings")) {
          std::fill(values.begin(), values.end(), 0.0f);
        }
        return {};
      });
  EXPECT_TRUE(network.ok());
  return *std::move(network);
}

GaussianCloud RandomCloud(int64_t count, int degree = 3, uint64_t seed = 31) {
  Random random(seed);
  GaussianCloud cloud;
  cloud.Resize(count, degree);
  for (auto& v : cloud.means) v = static_cast<float>(random.Uniform(-1, 1));
  for (auto& v : cloud.log_scales) v = static_cast<float>(random.Uniform(-6, -3));
  for (auto& v : cloud.quats) v = static_cast<float>(random.Normal());
  for (auto& v : cloud.opacity_logits) v = static_cast<float>(random.Uniform(-4, 6));
  for (auto& v : cloud.sh) v = static_cast<float>(0.3 * random.Normal());
  return cloud;
}

class CollectingSink : public LogSink {
 public:
  void Message(LogLevel, const std::string& text) override { messages.push_back(text); }
  void TaskBegin(const std::string&, int64_t task_total) override { total = task_total; }
  void TaskProgress(int64_t steps, const std::string&) override { done = steps; }
  void TaskEnd() override {}
  std::vector<std::string> messages;
  int64_t total = -1, done = -1;
};

class EnhanceWithPublishedTest : public testing::Test {
 protected:
  void SetUp() override { before_ = SetLogSink(sink); }
  void TearDown() override { SetLogSink(before_); }
  std::shared_ptr<CollectingSink> sink = std::make_shared<CollectingSink>();

 private:
  std::shared_ptr<LogSink> before_;
};

TEST_F(EnhanceWithPublishedTest, CopiesOfTheAnchorsInOrderWhenTheHeadsSayNothing) {
  const GaussianCloud cloud = RandomCloud(300);
  const auto result = EnhanceWithPublishedNetwork(cloud, IdentityNetwork(3));
  ASSERT_TRUE(result.ok());
  ASSERT_EQ(result->cloud.size(), 900);
  for (int64_t k = 0; k < 3; ++k) {
    for (int64_t i = 0; i < 300; ++i) {
      const int64_t row = k * 300 + i;
      for (int64_t a = 0; a < 3; ++a) {
        ASSERT_NEAR(result->cloud.means.data()[3 * row + a], cloud.means.data()[3 * i + a], 1e-6);
        ASSERT_NEAR(result->cloud.log_scales.data()[3 * row + a], cloud.log_scales.data()[3 * i + a], 1e-5);
      }
      ASSERT_EQ(result->cloud.opacity_logits.data()[row], cloud.opacity_logits.data()[i]);
      const float* q = result->cloud.quats.data() + 4 * row;
      const float* anchor = cloud.quats.data() + 4 * i;
      ASSERT_NEAR(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], 1, 1e-5);
      ASSERT_NEAR(q[0] * anchor[1], q[1] * anchor[0], 1e-5) << "the same direction";
      for (int64_t c = 0; c < 48; ++c) ASSERT_EQ(result->cloud.sh.data()[48 * row + c], cloud.sh.data()[48 * i + c]);
    }
  }
  EXPECT_EQ(sink->total, 300);
  EXPECT_EQ(sink->done, 300);
}

TEST_F(EnhanceWithPublishedTest, UpstreamKeepsQuaternionsAndScramblesLowDegrees) {
  const GaussianCloud cloud = RandomCloud(100, 1);
  const auto upstream = EnhanceWithPublishedNetwork(cloud, IdentityNetwork(1), {.upstream = true});
  const auto corrected = EnhanceWithPublishedNetwork(cloud, IdentityNetwork(1));
  ASSERT_TRUE(upstream.ok() && corrected.ok());
  ASSERT_EQ(upstream->cloud.size(), 100);
  EXPECT_EQ(upstream->cloud.quats, cloud.quats);
  EXPECT_EQ(corrected->cloud.sh[48 * 7 + 4], cloud.sh[12 * 7 + 4]) << "coefficient 1, green";
  EXPECT_EQ(upstream->cloud.sh[48 * 7 + 4], 0) << "everything went to red";
  EXPECT_EQ(upstream->cloud.sh[48 * 7 + 3 * 4], cloud.sh[12 * 7 + 4]) << "green's first is red's fourth";
}

TEST_F(EnhanceWithPublishedTest, DropsWhatIsNotFiniteAndSaysSo) {
  GaussianCloud cloud = RandomCloud(50);
  cloud.sh[48 * 3 + 40] = std::numeric_limits<float>::quiet_NaN();
  cloud.log_scales[15] = std::numeric_limits<float>::infinity();
  const auto result = EnhanceWithPublishedNetwork(cloud, IdentityNetwork());
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->report.not_finite, 2);
  EXPECT_EQ(result->cloud.size(), 96);
  EXPECT_THAT(sink->messages, Contains(HasSubstr("dropped 2 of 50")));
  EXPECT_NEAR(result->cloud.means[3 * 3], cloud.means[3 * 4], 1e-6) << "rows close up";

  for (auto& v : cloud.means) v = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(EnhanceWithPublishedNetwork(cloud, IdentityNetwork()).ok());
  EXPECT_FALSE(EnhanceWithPublishedNetwork(GaussianCloud{}, IdentityNetwork()).ok());
}

TEST_F(EnhanceWithPublishedTest, ReadsWhatIsOpaqueOrFlat) {
  GaussianCloud cloud = RandomCloud(50);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  cloud.opacity_logits[5] = kInfinity;
  cloud.opacity_logits[6] = -kInfinity;
  cloud.log_scales[21] = -kInfinity;
  for (size_t k = 24; k < 27; ++k) cloud.log_scales[k] = -kInfinity;
  const auto result = EnhanceWithPublishedNetwork(cloud, IdentityNetwork(1));
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->report.not_finite, 0);
  ASSERT_EQ(result->cloud.size(), 50);
  for (int64_t i = 0; i < 50; ++i) EXPECT_TRUE(IsUsable(result->cloud, i)) << i;
  EXPECT_GT(result->cloud.opacity_logits[5], 10);
  EXPECT_LT(result->cloud.opacity_logits[6], -10);
  EXPECT_LT(result->cloud.log_scales[21], std::max(cloud.log_scales[22], cloud.log_scales[23]) - 9);
  // The published network's own program drops them.
  const auto upstream = EnhanceWithPublishedNetwork(cloud, IdentityNetwork(1), {.upstream = true});
  ASSERT_TRUE(upstream.ok());
  EXPECT_EQ(upstream->report.not_finite, 4);
}

TEST_F(EnhanceWithPublishedTest, OnlyUpstreamLosesExtremesToRounding) {
  const PublishedNetwork network = IdentityNetwork(1);
  int64_t lost = 0;
  for (uint64_t seed = 0; seed < 30; ++seed) {
    const GaussianCloud cloud = RandomCloud(20, 0, seed);
    const auto upstream =
        EnhanceWithPublishedNetwork(cloud, network, {.upstream = true, .normalisation = NormalisationMode::kBbox});
    const auto corrected = EnhanceWithPublishedNetwork(cloud, network, {.normalisation = NormalisationMode::kBbox});
    ASSERT_TRUE(upstream.ok() && corrected.ok());
    EXPECT_EQ(corrected->cloud.size(), 20);
    EXPECT_EQ(upstream->cloud.size(), 20 - upstream->report.outside);
    lost += upstream->report.outside;
  }
  EXPECT_GT(lost, 0);
  // A mode that truly leaves Gaussians outside drops them in both.
  GaussianCloud cloud = RandomCloud(20);
  cloud.means[0] = 1.5f;
  EXPECT_EQ(EnhanceWithPublishedNetwork(cloud, network, {.normalisation = NormalisationMode::kUnit})->cloud.size(), 19);
}

TEST_F(EnhanceWithPublishedTest, LimitKeepsTheMostVisible) {
  GaussianCloud cloud = RandomCloud(60);
  for (int64_t i = 0; i < 60; ++i) {
    cloud.opacity_logits.data()[i] = i % 2 == 0 ? 4 : -4;
    for (int64_t a = 0; a < 3; ++a) cloud.log_scales.data()[3 * i + a] = -4;
  }
  cloud.log_scales[3 * 1] = cloud.log_scales[3 * 1 + 1] = 0;  // faint but large
  const auto result = EnhanceWithPublishedNetwork(cloud, IdentityNetwork(1), {.max_gaussians = 10});
  ASSERT_TRUE(result.ok());
  ASSERT_EQ(result->cloud.size(), 10);
  EXPECT_EQ(result->report.over_limit, 50);
  EXPECT_THAT(sink->messages, Contains(HasSubstr("using 10 of 60")));
  EXPECT_NEAR(result->cloud.means[3], cloud.means[3], 1e-6) << "row 0 and then row 1";

  const auto upstream = EnhanceWithPublishedNetwork(cloud, IdentityNetwork(1), {.upstream = true, .max_gaussians = 10});
  ASSERT_EQ(upstream->cloud.size(), 10);
  EXPECT_FALSE(upstream->cloud.means == result->cloud.means);
}

TEST_F(EnhanceWithPublishedTest, PrunesWhatIsInvisible) {
  GaussianCloud cloud = RandomCloud(40);
  for (int64_t i = 0; i < 40; ++i) cloud.opacity_logits.data()[i] = i < 30 ? 0.0f : -7.0f;
  const auto result = EnhanceWithPublishedNetwork(cloud, IdentityNetwork(2), {.prune_opacity = 1.0f / 255});
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->cloud.size(), 60);
  EXPECT_EQ(result->report.pruned, 20);
}

TEST_F(EnhanceWithPublishedTest, ClampsAsTheReleaseDoes) {
  GaussianCloud cloud = RandomCloud(30);
  cloud.opacity_logits[0] = 50;
  cloud.sh[1] = -30;
  cloud.log_scales[2] = 6;
  const auto upstream = EnhanceWithPublishedNetwork(cloud, IdentityNetwork(1), {.upstream = true});
  EXPECT_EQ(upstream->cloud.opacity_logits[0], 20);
  EXPECT_EQ(upstream->cloud.sh[1], -10);
  EXPECT_EQ(upstream->cloud.log_scales[2], 5);
  const auto corrected = EnhanceWithPublishedNetwork(cloud, IdentityNetwork(1));
  EXPECT_NEAR(corrected->cloud.log_scales[2], 6, 1e-5) << "a large scene's units are no mistake";
}

TEST_F(EnhanceWithPublishedTest, SameBitsForAnyNumberOfThreadsAndOnEveryRun) {
  const GaussianCloud cloud = RandomCloud(3000);
  const PublishedNetwork network = SmallNetwork();
  const auto run = [&](int threads, int64_t block) {
    SetThreadCount(threads);
    auto result = EnhanceWithPublishedNetwork(cloud, network, {.block_gaussians = block});
    SetThreadCount(0);
    return std::move(result->cloud);
  };
  for (const int64_t block : {200000, 700}) {
    const GaussianCloud one = run(1, block), two = run(2, block), again = run(2, block);
    EXPECT_TRUE(one.means == two.means && one.sh == two.sh && one.quats == two.quats);
    EXPECT_TRUE(again.means == two.means && again.log_scales == two.log_scales);
  }
}

// Blocks see less of the cloud than the whole does, and each in its own coordinates, so their results differ. What must
// not be is a step where they meet: next to a cell's face, neighbours should differ as they do elsewhere.
TEST_F(EnhanceWithPublishedTest, BlocksMeetWithoutSeams) {
  // A smooth sheet of equal Gaussians: whatever structure the output has beside the sheet's own comes from the blocks.
  const int64_t side = 48;
  GaussianCloud cloud;
  cloud.Resize(side * side, 3);
  std::fill(cloud.sh.begin(), cloud.sh.end(), 0.1f);
  for (int64_t i = 0; i < cloud.size(); ++i) {
    const float x = static_cast<float>(i % side) / 24 - 1, y = static_cast<float>(i / side) / 24 - 1;
    float* mean = cloud.means.data() + 3 * i;
    mean[0] = x, mean[1] = y, mean[2] = 0.1f * x * y;
    for (int64_t a = 0; a < 3; ++a) cloud.log_scales.data()[3 * i + a] = -3;
    float* quat = cloud.quats.data() + 4 * i;
    quat[0] = 1, quat[1] = quat[2] = quat[3] = 0;
    cloud.opacity_logits.data()[i] = 1;
  }
  const auto whole = EnhanceWithPublishedNetwork(cloud, SmallNetwork(1));
  const auto blocks = EnhanceWithPublishedNetwork(cloud, SmallNetwork(1), {.block_gaussians = 700});
  ASSERT_TRUE(whole.ok() && blocks.ok());
  ASSERT_EQ(blocks->cloud.size(), cloud.size());
  EXPECT_EQ(whole->report.blocks, 1);
  EXPECT_GT(blocks->report.blocks, 3);
  EXPECT_THAT(sink->messages, Contains(HasSubstr("overlapping blocks")));
  EXPECT_EQ(sink->done, cloud.size());
  // Mean step of the opacity between horizontal neighbours: over the face between cells, and elsewhere.
  const auto steps = [&](const GaussianCloud& out) {
    double seam = 0, elsewhere = 0;
    int64_t others = 0;
    for (int64_t y = 0; y < side; ++y) {
      for (int64_t x = 0; x + 1 < side; ++x) {
        const double step =
            std::fabs(out.opacity_logits.data()[y * side + x + 1] - out.opacity_logits.data()[y * side + x]);
        if (x + 1 == side / 2) {
          seam += step / static_cast<double>(side);
        } else {
          elsewhere += step;
          ++others;
        }
      }
    }
    return seam / (elsewhere / static_cast<double>(others));
  };
  RecordProperty("seam_whole", std::to_string(steps(whole->cloud)));
  RecordProperty("seam_blocks", std::to_string(steps(blocks->cloud)));
  EXPECT_LT(steps(blocks->cloud), 3) << "whole: " << steps(whole->cloud);
}

}  // namespace
}  // namespace anchorsplat
