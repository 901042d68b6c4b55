#include "compact/compact_checkpoint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "compact/compact_network.h"
#include "compact/sheet_cloud_for_test.h"
#include "core/log.h"
#include "core/run_context.h"
#include "enhance/filter.h"
#include "fit/checkpoint_guard.h"
#include "io/flip_bit_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr int64_t kGaussians = 900, kBlock = 128, kBlocks = 8;
const float kPixel = kSheetPixel;

const CompactNetwork& Network() {
  static const CompactNetwork network = *CompactNetwork::Load({}, OpenDomain());
  return network;
}

// Stops a run when it has reached a number of Gaussians, and hears what it says.
class StoppingSink : public LogSink {
 public:
  explicit StoppingSink(int64_t at) : at_(at) {}
  void Message(LogLevel level, const std::string& text) override {
    if (level == LogLevel::kWarning) warnings.push_back(text);
  }
  void TaskBegin(const std::string& /*name*/, int64_t /*total*/) override {}
  void TaskProgress(int64_t done, const std::string& /*note*/) override {
    if (done >= at_) stop = true;
  }
  void TaskEnd() override {}

  std::atomic<bool> stop = false;
  std::vector<std::string> warnings;

 private:
  int64_t at_;
};

class CompactCheckpointTest : public testing::Test {
 protected:
  CompactTask Task() const {
    return {.pixel_sizes = {&kPixel, 1},
            .upscale = 4,
            .strength = DefaultFilterStrength(4),
            .block_gaussians = kBlock,
            .choice = CopyChoice{.merge_cost = 1e-3}};
  }
  Result<CompactResult> Run(CompactTask task, bool resume, int64_t stop_at = std::numeric_limits<int64_t>::max()) {
    task.checkpoint = path_;
    task.resume = resume;
    sink_ = std::make_shared<StoppingSink>(stop_at);
    const RunScope run({.sink = sink_, .stop = &sink_->stop});
    return Network().Apply(cloud_, task);
  }
  // Of a run that is stopped after three blocks; its checkpoint.
  std::string Interrupt(const CompactTask& task) {
    const auto stopped = Run(task, /*resume=*/true, 3 * kBlock);
    EXPECT_FALSE(stopped.ok());
    if (!stopped.ok()) {
      EXPECT_EQ(stopped.error().code, ErrorCode::kInterrupted);
    }
    return Bytes();
  }
  std::string Bytes() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void Put(const std::string& bytes) const { std::ofstream(path_, std::ios::binary) << bytes; }

  const TestFolder folder_;
  const fs::path path_ = folder_ / "state";
  GaussianCloud cloud_ = SheetCloud(kGaussians);
  std::shared_ptr<StoppingSink> sink_;
};

void ExpectSameBits(const CompactResult& a, const CompactResult& b) {
  EXPECT_EQ(a.made, b.made);
  EXPECT_EQ(a.unlike_training, b.unlike_training);
  EXPECT_EQ(a.partly_unlike_training, b.partly_unlike_training);
  EXPECT_EQ(a.not_finite, b.not_finite);
  EXPECT_EQ(a.chosen.merged, b.chosen.merged);
  EXPECT_EQ(a.chosen.left_out, b.chosen.left_out);
  EXPECT_EQ(a.cloud.means, b.cloud.means);
  EXPECT_EQ(a.cloud.log_scales, b.cloud.log_scales);
  EXPECT_EQ(a.cloud.quats, b.cloud.quats);
  EXPECT_EQ(a.cloud.opacity_logits, b.cloud.opacity_logits);
  EXPECT_EQ(a.cloud.sh, b.cloud.sh);
}

TEST_F(CompactCheckpointTest, AnInterruptedRunGoesOnToTheSameBits) {
  CompactTask bounded = Task();
  bounded.choice->max_gaussians = 2000;  // all copies wait for the last block
  const std::vector<int64_t> dust = {3, 5, 200, 899};
  CompactTask within = Task();
  within.single = dust;
  std::vector<char> inside(kGaussians, 1);
  for (size_t i = 0; i < inside.size(); i += 3) inside[i] = 0;
  within.in_region = inside;
  const auto one = CompactNetwork::Load({.copies = 1}, OpenDomain());
  ASSERT_TRUE(one.ok());
  CompactTask with_stand_ins = Task(), bounded_with = bounded;
  with_stand_ins.stand_in = bounded_with.stand_in = &*one;
  for (const CompactTask& task : {Task(), bounded, within, with_stand_ins, bounded_with}) {
    fs::remove(path_);
    const auto whole = Network().Apply(cloud_, task);
    ASSERT_TRUE(whole.ok()) << whole.error().message;
    Interrupt(task);
    const auto resumed = Run(task, /*resume=*/true);
    ASSERT_TRUE(resumed.ok()) << resumed.error().message;
    EXPECT_EQ(resumed->resumed, 3);
    ExpectSameBits(*resumed, *whole);
    // It holds all blocks now.
    const auto again = Run(task, /*resume=*/true);
    ASSERT_TRUE(again.ok());
    EXPECT_EQ(again->resumed, kBlocks);
    ExpectSameBits(*again, *whole);
  }
}

TEST_F(CompactCheckpointTest, ATornTailIsOnlyLostWork) {
  const auto whole = Network().Apply(cloud_, Task());
  ASSERT_TRUE(whole.ok());
  const std::string bytes = Interrupt(Task());
  const size_t written = bytes.size() - bytes.find('\n', bytes.find('\n') + 1) - 1, block = written / 3;
  for (const size_t lost : {size_t{1}, size_t{64}, block, 2 * block, written}) {
    Put(bytes.substr(0, bytes.size() - lost));
    const auto resumed = Run(Task(), /*resume=*/true);
    ASSERT_TRUE(resumed.ok()) << resumed.error().message;
    EXPECT_LT(resumed->resumed, 3) << lost;
    ExpectSameBits(*resumed, *whole);
  }
  // As a machine leaves it that has lost its power: the file is long enough, its end was never written.
  std::string hollow = bytes;
  std::fill(hollow.end() - 5000, hollow.end(), '\0');
  Put(hollow);
  EXPECT_EQ(Run(Task(), /*resume=*/true)->resumed, 2);
  for (const int from_end : {100, static_cast<int>(block) + 20}) {
    Put(bytes);
    FlipBit(path_, from_end);
    const auto resumed = Run(Task(), /*resume=*/true);
    ASSERT_TRUE(resumed.ok()) << resumed.error().message;
    EXPECT_LT(resumed->resumed, 3);
    ExpectSameBits(*resumed, *whole);
  }
}

TEST_F(CompactCheckpointTest, OfAnotherRunItIsRefusedByName) {
  const std::string bytes = Interrupt(Task());
  const auto refused = [&](const CompactTask& task) {
    Put(bytes);
    const auto resumed = Run(task, /*resume=*/true);
    EXPECT_FALSE(resumed.ok());
    EXPECT_EQ(Bytes(), bytes);
    return resumed.ok() ? "" : resumed.error().message;
  };
  CompactTask task = Task();
  task.upscale = 3;
  EXPECT_THAT(refused(task), HasSubstr("its upscale is 4.0, here 3.0"));
  task = Task();
  const float other_pixel = 2 * kPixel;
  task.pixel_sizes = {&other_pixel, 1};
  EXPECT_THAT(refused(task), HasSubstr("its pixel size differs"));
  task = Task();
  task.choice->merge_cost = 1;
  EXPECT_THAT(refused(task), HasSubstr("merge cost"));
  cloud_.means[30] += 1;
  EXPECT_THAT(refused(Task()), HasSubstr("its input differs"));
}

TEST_F(CompactCheckpointTest, WhatIsNoneIsRefusedAndStays) {
  for (const std::string& bytes : {std::string(), std::string("my notes"), std::string("anchorsplat network 1\n"),
                                   std::string("anchorsplat network 1\n0123456789abcdef {\"upscale\":4.0}\n")}) {
    Put(bytes);
    const auto resumed = Run(Task(), /*resume=*/true);
    ASSERT_FALSE(resumed.ok());
    EXPECT_EQ(resumed.error().code, ErrorCode::kBadFile);
    EXPECT_THAT(resumed.error().message, HasSubstr(path_.string()));
    EXPECT_EQ(Bytes(), bytes);
  }
  Put("my notes");
  EXPECT_FALSE(IsCompactCheckpoint(path_));
  RemoveCheckpoint(path_, IsCompactCheckpoint);
  EXPECT_TRUE(fs::exists(path_));
  const auto anew = Run(Task(), /*resume=*/false);
  ASSERT_FALSE(anew.ok());
  EXPECT_EQ(anew.error().code, ErrorCode::kExists);
  EXPECT_EQ(Bytes(), "my notes");
  fs::remove(path_);
  EXPECT_FALSE(IsCompactCheckpoint(path_));
  Interrupt(Task());
  EXPECT_TRUE(IsCompactCheckpoint(path_));
  RemoveCheckpoint(path_, IsCompactCheckpoint);
  EXPECT_FALSE(fs::exists(path_));
}

// Without --resume a run begins at its beginning; the guard has asked before whether it may.
TEST_F(CompactCheckpointTest, BeginsAnew) {
  Interrupt(Task());
  CompactTask task = Task();
  task.upscale = 3;
  const auto anew = Run(task, /*resume=*/false);
  ASSERT_TRUE(anew.ok()) << anew.error().message;
  EXPECT_EQ(anew->resumed, 0);
}

TEST_F(CompactCheckpointTest, BlocksOfAnotherRunAreNone) {
  Buffer<int32_t> places;
  for (int32_t i = 0; i < 10; ++i) places.push_back(i);
  CompactBlockResult result{.block = 1, .part = {.keys = {4, 5, 14, 15, 26}, .cloud = {}, .copied = 2, .made = 5}};
  bool stand_ins = false;
  const auto is = [&](bool merging_deferred) {
    return FitsBlock(result, places, /*block_gaussians=*/4, /*copies=*/2, merging_deferred, stand_ins);
  };
  EXPECT_TRUE(is(false));
  EXPECT_TRUE(is(true));
  const auto with = [&](const std::function<void(CompactPart&)>& change, bool merging_deferred) {
    const CompactPart before = result.part;
    change(result.part);
    const bool fits = is(merging_deferred);
    result.part = before;
    return fits;
  };
  EXPECT_FALSE(with([](CompactPart& p) { p.keys[0] = 3; }, false));  // of block 0
  EXPECT_FALSE(with([](CompactPart& p) { p.keys[0] = 8; }, false));  // of block 2
  EXPECT_FALSE(with([](CompactPart& p) { p.keys[0] = 5; }, false));  // twice
  EXPECT_FALSE(with([](CompactPart& p) { p.keys[0] = -1; }, false));
  EXPECT_FALSE(with([](CompactPart& p) { p.keys[0] = 30; }, false));
  EXPECT_FALSE(with([](CompactPart& p) { p.made = 4; }, false));
  EXPECT_FALSE(with([](CompactPart& p) { p.made = 9; }, false));
  EXPECT_FALSE(with([](CompactPart& p) { p.copied = 5; }, false));
  EXPECT_TRUE(with([](CompactPart& p) { p.made = 6; }, false));  // one was merged
  EXPECT_FALSE(with([](CompactPart& p) { p.made = 6; }, true));
  EXPECT_FALSE(with([](CompactPart& p) { p.copied = 3; }, true));
  EXPECT_FALSE(with([](CompactPart& p) { std::swap(p.keys[2], p.keys[3]); }, true));
  stand_ins = true;
  EXPECT_TRUE(is(false));  // of which none came
  EXPECT_FALSE(is(true));
  result.part.keys = {4, 5, 14, 15, 24, 25, 26};
  EXPECT_TRUE(is(true));
  EXPECT_FALSE(is(false));
  EXPECT_FALSE(with([](CompactPart& p) { std::swap(p.keys[4], p.keys[5]); }, true));
  EXPECT_FALSE(with([](CompactPart& p) { p.made = 7; }, true));
}

}  // namespace
}  // namespace anchorsplat
