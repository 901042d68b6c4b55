#include "model/model_method.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "compact/sheet_cloud_for_test.h"
#include "compact/shipped_network.h"
#include "core/log.h"
#include "core/random.h"
#include "core/text.h"
#include "enhance/count_members_for_test.h"
#include "enhance/enhance.h"
#include "kernels/bfloat16_tile.h"
#include "model/network_options.h"
#include "published/published_checkpoint_writer.h"
#include "tensors/safetensors.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

PublishedConfig SmallConfig() {
  PublishedConfig config;
  config.copies = 2;
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

void WriteMadeUp(const fs::path& path, const std::vector<TensorSpec>& specs, const WeightSource& source,
                 const std::map<std::string, std::string>& metadata) {
  std::vector<std::vector<float>> values;
  std::vector<TensorEntry> entries;
  values.reserve(specs.size());
  for (const TensorSpec& spec : specs) {
    if (spec.counter) continue;
    int64_t count = 1;
    for (const int64_t side : spec.shape) count *= side;
    std::vector<float>& array = values.emplace_back(static_cast<size_t>(count));
    EXPECT_TRUE(source(spec, array).ok());
    entries.push_back(MakeEntry(spec.name, spec.shape, array));
  }
  EXPECT_TRUE(WriteSafetensors(path, entries, metadata).ok());
}

// A folder of its own with a small checkpoint of made-up weights, small.safetensors.
class SmallModel : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              (std::string("anchorsplat_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    WriteMadeUp(file(), PublishedTensors(SmallConfig()), HashWeights(), {{"licence", "CC0"}});
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path file() const { return folder_ / "small.safetensors"; }
  // Beside it a compact network of made-up weights.
  fs::path Compact(int64_t copies) const {
    const fs::path path = folder_ / Cat("compact-", copies, ".safetensors");
    const CompactConfig config{.copies = copies, .hidden = 16, .head_hidden = 16};
    WriteMadeUp(path, CompactTensors(config), OpenDomain(), ToMetadata(config));
    return path;
  }

  fs::path folder_;
};

GaussianCloud RandomCloud(int64_t n) {
  GaussianCloud cloud;
  cloud.Resize(n, 3);
  Random random(4);
  for (float& x : cloud.means) x = static_cast<float>(random.Uniform(-1, 1));
  for (float& x : cloud.log_scales) x = static_cast<float>(-4 + random.Normal());
  for (float& x : cloud.quats) x = static_cast<float>(random.Normal());
  for (float& x : cloud.opacity_logits) x = static_cast<float>(random.Normal());
  for (float& x : cloud.sh) x = static_cast<float>(0.2 * random.Normal());
  return cloud;
}

TEST_F(SmallModel, AutoPrefersTheModelOnceThereIsAFile) {
  EnhanceOptions options;
  options.methods = &AllMethods();
  options.mode = RenderMode::kClassic;
  options.pixel_size = 0.01;
  EXPECT_EQ(PlanEnhancement(options)->Name(), HasShippedNetwork() ? "model" : "filter");

  options.method = "model";
  auto enhanced = Enhance(RandomCloud(300), options);
  ASSERT_EQ(enhanced.ok(), HasShippedNetwork());
  if (!enhanced.ok()) {
    EXPECT_THAT(enhanced.error().message, testing::HasSubstr("--model"));
  }

  options.model.file = file();
  options.method = "auto";
  for (int repeat = 0; repeat < 2; ++repeat) {  // the second finds the network loaded
    enhanced = Enhance(RandomCloud(300), options);
    ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
    EXPECT_EQ(enhanced->report.method, "model");
    EXPECT_EQ(enhanced->report.gaussians_out, 600);
    EXPECT_EQ(enhanced->report.pixel_size_source, PixelSizeSource::kNone);
  }
}

class Warnings : public LogSink {
 public:
  void Message(LogLevel level, const std::string& text) override {
    if (level == LogLevel::kWarning) texts.push_back(text);
  }
  void TaskBegin(const std::string&, int64_t) override {}
  void TaskProgress(int64_t, const std::string&) override {}
  void TaskEnd() override {}
  std::vector<std::string> texts;
};

// On a processor without products of bfloat16 that precision is slower and less exact: nobody can have meant it.
TEST_F(SmallModel, BFloat16IsNeverChosenWhereItIsSlower) {
  EnhanceOptions options;
  options.model.file = file();
  const auto run = [&](WeightPrecision precision) {
    options.model.precision = precision;
    EnhanceInput input;
    input.cloud = RandomCloud(300);
    StepReport report;
    auto cloud = ModelMethod().run(std::move(input), options, report);  // anew: a network once loaded is kept
    return cloud.ok() ? cloud->means : Buffer<float>();
  };
  hwy::SetSupportedTargetsForTest(HWY_STATIC_TARGET);  // has none
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  const auto warnings = std::make_shared<Warnings>();
  const auto before = SetLogSink(warnings);
  const auto exact = run(WeightPrecision::kFloat);
  EXPECT_THAT(warnings->texts, testing::Not(testing::Contains(testing::HasSubstr("bf16"))));
  const auto instead = run(WeightPrecision::kBFloat16);
  EXPECT_THAT(warnings->texts, testing::Contains(testing::HasSubstr("bf16 would be slower")));
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  warnings->texts.clear();
  const auto exact_here = run(WeightPrecision::kFloat), rounded_here = run(WeightPrecision::kBFloat16);
  SetLogSink(before);

  EXPECT_FALSE(exact.empty());
  EXPECT_EQ(instead, exact);
  EXPECT_EQ(rounded_here == exact_here, !UsesBFloat16Dot());
  const auto warned = testing::Contains(testing::HasSubstr("bf16"));
  EXPECT_EQ(testing::Value(warnings->texts, warned), !UsesBFloat16Dot());
}

EnhanceInput SheetInput() {
  EnhanceInput input;
  input.cloud = SheetCloud(200);
  input.pixel_sizes = {kSheetPixel};
  input.filter_strength = 0.7;
  return input;
}

TEST_F(SmallModel, CompactNetworksGoThroughTheSameDoor) {
  EnhanceOptions options;
  options.model.file = Compact(3);
  const EnhanceMethod& method = AllMethods().back();
  EXPECT_TRUE(*method.needs_pixel_size(options));
  StepReport report;
  const EnhanceInput input = SheetInput();
  options.model.copies = 3;
  auto enhanced = method.run(input, options, report);
  ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
  EXPECT_EQ(enhanced->size(), 600);
  const std::map<std::string, FactValue> facts(report.facts.begin(), report.facts.end());
  EXPECT_EQ(std::get<int64_t>(facts.at("copies")), 3);
  EXPECT_EQ(std::get<int64_t>(facts.at("unlike_training")), 0);

  // No lost width, nothing to build on: fitted with antialiasing, or seen no closer.
  EnhanceInput without = input;
  without.filter_strength = 0;
  enhanced = method.run(without, options, report);
  ASSERT_TRUE(enhanced.ok());
  EXPECT_EQ(enhanced->log_scales, input.cloud.log_scales);
  options.upscale = 1;
  without.filter_strength = 1;
  enhanced = method.run(without, options, report);
  ASSERT_TRUE(enhanced.ok());
  EXPECT_EQ(enhanced->means, input.cloud.means);
  options.upscale = 4;

  options.model.options.prune_opacity = 0.3f;
  enhanced = method.run(input, options, report);
  ASSERT_TRUE(enhanced.ok());
  EXPECT_LT(enhanced->size(), 600);
  for (const float logit : enhanced->opacity_logits) EXPECT_GE(1 / (1 + std::exp(-logit)), 0.3f);
  options.model.file = file();
  EXPECT_FALSE(*method.needs_pixel_size(options));
}

TEST_F(SmallModel, CopiesAndBudgetAreCounted) {
  EnhanceOptions options;
  options.model.file = Compact(3);
  const EnhanceMethod& method = AllMethods().back();
  EnhanceInput input = SheetInput();
  input.pixel_sizes.assign(200, kSheetPixel);  // one each
  const auto run = [&](std::optional<int64_t> copies, int64_t most) {
    options.model.copies = copies;
    options.model.options.max_gaussians = most;
    StepReport report;
    const auto enhanced = method.run(input, options, report);
    if (!enhanced.ok()) return int64_t{-1};
    const std::map<std::string, FactValue> facts(report.facts.begin(), report.facts.end());
    const auto fact = [&](const char* name) { return std::get<int64_t>(facts.at(name)); };
    EXPECT_EQ(fact("copies_made"), 600);
    EXPECT_EQ(enhanced->size(), 600 - fact("merged") - fact("left_out") - fact("pruned"));
    return enhanced->size();
  };
  EXPECT_LT(run({}, 0), 600);
  EXPECT_EQ(run(3, 0), 600);
  EXPECT_LE(run(2, 0), 400);
  EXPECT_EQ(run(1, 0), 200);
  EXPECT_EQ(run(4, 0), -1);  // the network makes three
  EXPECT_EQ(run(3, 450), 450);
  EXPECT_EQ(run(3, 150), 150);
  EXPECT_EQ(method.expected_gaussians(200, options), 150);
}

// The last network is kept for the next call, and what asks for another one at the same time gets its own.
TEST_F(SmallModel, ChangedFilesAndRunsSideBySideGetTheirNetworks) {
  const fs::path two = Compact(2), three = Compact(3);
  const EnhanceMethod& method = AllMethods().back();
  const EnhanceInput input = SheetInput();
  const auto copies = [&](const fs::path& file) -> int64_t {
    EnhanceOptions options;
    options.model.file = file;
    StepReport report;
    const auto enhanced = method.run(input, options, report);
    if (!enhanced.ok()) return -1;
    const std::map<std::string, FactValue> facts(report.facts.begin(), report.facts.end());
    return std::get<int64_t>(facts.at("copies_made")) / input.cloud.size();
  };
  int wrong = 0;
  std::thread other([&] {
    for (int i = 0; i < 10; ++i) wrong += copies(two) == 2 ? 0 : 1;
  });
  for (int i = 0; i < 10; ++i) EXPECT_EQ(copies(three), 3);
  other.join();
  EXPECT_EQ(wrong, 0);

  fs::rename(two, three);
  EXPECT_EQ(copies(three), 2);
}

// A setting without a description fails here.
TEST(ModelSettings, EachIsDescribed) {
  constexpr size_t kOthers = 1 + 2;  // the published network's as a whole; its budget, profile
  EXPECT_EQ(NetworkOptions().size() + PublishedScriptOptions().size() + kOthers,
            CountMembers<ModelSettings>() + CountMembers<PublishedOptions>());
  EnhanceOptions options;
  EXPECT_TRUE(SetOption(NetworkOptions(), "copies", "3", options).ok());
  EXPECT_EQ(options.model.copies, 3);
  EXPECT_TRUE(SetOption(PublishedScriptOptions(), "curve-depth", "v1.6", options).ok());
  EXPECT_EQ(options.model.options.depth_rule, DepthRule::kLargestPlusOne);
  EXPECT_TRUE(SetOption(PublishedScriptOptions(), "shuffles", "918", options).ok());
  EXPECT_EQ(options.model.options.shuffles, ShufflesFromSeed(918));
  EXPECT_FALSE(SetOption(PublishedScriptOptions(), "shuffles", "12,3", options).ok());
}

// What would change nothing is refused, with the words for where it would.
TEST_F(SmallModel, EveryOptionBelongsToAnArchitecture) {
  const std::vector<MethodOption> options = AllMethods().back().options;
  EnhanceOptions enhance;
  const auto lacks = [&](const std::string& name) -> std::string {
    const auto found = std::find_if(options.begin(), options.end(), [&](const auto& o) { return o.name == name; });
    if (found == options.end()) return "no option";
    return found->lacks ? found->lacks({enhance}) : "";
  };
  const fs::path compact = Compact(3);
  for (const fs::path& weights : {fs::path(), compact, file()}) {
    enhance.model.file = weights;
    const bool published = weights == file();
    for (const char* name :
         {"compat", "normalisation", "precision", "curve-depth", "shuffles", "attention-rounding", "block-gaussians"}) {
      EXPECT_EQ(lacks(name), published ? "" : "with a network of the published architecture (--model FILE)") << name;
    }
    for (const char* name : {"upscale", "pixel-size", "cameras", "filter-strength"}) {
      EXPECT_EQ(lacks(name), published ? "with a compact network, --method filter or refine" : "") << name;
    }
    for (const char* name : {"copies", "merge-cost"}) {
      EXPECT_EQ(lacks(name), published ? "with a compact network" : "") << name;
    }
    EXPECT_EQ(lacks("prune-opacity"), "");
    EXPECT_EQ(lacks("max-gaussians"), "");
    EXPECT_EQ(lacks("steps"), "no option");
  }
  enhance.model.file = compact;
  enhance.model.copies = 2;
  EXPECT_EQ(lacks("merge-cost"), "with --copies auto");
  enhance.model.file = file();
  enhance.model.options.upstream = true;
  EXPECT_EQ(lacks("block-gaussians"), "without --compat upstream");
  enhance.model.precision = WeightPrecision::kBFloat16;
  EXPECT_EQ(lacks("attention-rounding"), "without --precision bf16");
  // Loading tells what is wrong with a file.
  enhance.model.file = folder_ / "none.pth";
  EXPECT_EQ(lacks("upscale"), "");
  EXPECT_EQ(lacks("normalisation"), "");
}

TEST_F(SmallModel, TheShippedNetworksOpen) {
  for (const Shipped which : kAllShipped) {
    const auto shipped = LoadShippedNetwork(which);
    EXPECT_EQ(shipped.ok(), HasShippedNetwork());
    if (shipped.ok()) {
      EXPECT_TRUE(shipped->config().knows_kind);
    } else {
      EXPECT_EQ(shipped.error().code, ErrorCode::kNotFound);
    }
  }
  EXPECT_EQ(ShippedNetworkIdentity().empty(), !HasShippedNetwork());
}

// A network that is not told the kind of splat knows classic ones only, and others are filtered.
TEST_F(SmallModel, AntialiasedSplatsGetTheirOwnShippedNetwork) {
  const EnhanceMethod& method = AllMethods().back();
  EnhanceInput input = SheetInput();
  input.cloud.render_mode = RenderMode::kAntialiased;
  input.filter_strength = 0.15;
  EnhanceOptions options;
  options.model.copies = 3;
  options.model.file = Compact(3);
  StepReport report;
  auto enhanced = method.run(input, options, report);
  ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
  EXPECT_EQ(enhanced->size(), input.cloud.size());
  if (!HasShippedNetwork()) return;
  options.model = {};
  options.model.copies = 4;
  // Between two classic ones: what is kept for the next call must not be taken for another.
  for (const RenderMode mode : {RenderMode::kClassic, RenderMode::kAntialiased, RenderMode::kClassic}) {
    EnhanceInput either = input;
    either.cloud.render_mode = mode;
    if (mode == RenderMode::kClassic) either.filter_strength = 0.74;
    report = {};
    enhanced = method.run(either, options, report);
    ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
    const std::map<std::string, FactValue> facts(report.facts.begin(), report.facts.end());
    ASSERT_TRUE(facts.contains("copies_made")) << static_cast<int>(mode);
    EXPECT_GT(std::get<int64_t>(facts.at("copies_made")), input.cloud.size());
    EXPECT_EQ(enhanced->render_mode, mode);
  }
}

// Merging four into one is worse than a network that makes one.
TEST_F(SmallModel, OneForOneComesFromANetworkOfItsOwn) {
  if (!HasShippedNetwork()) GTEST_SKIP() << "this program was built without weights";
  const EnhanceMethod& method = AllMethods().back();
  struct Case {
    std::optional<int64_t> copies;
    int64_t made;  // of each
  };
  for (const Case& c : {Case{{}, 4}, Case{1, 1}, Case{2, 4}, Case{4, 4}}) {
    EnhanceInput input = SheetInput();
    EnhanceOptions options;
    options.model.copies = c.copies;
    StepReport report;
    const auto enhanced = method.run(input, options, report);
    ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
    const std::map<std::string, FactValue> facts(report.facts.begin(), report.facts.end());
    EXPECT_EQ(std::get<int64_t>(facts.at("copies")), c.made);
    if (c.copies) {
      EXPECT_EQ(enhanced->size(), *c.copies * input.cloud.size());
    }
  }
}

// Little for what refinement begins with.
TEST_F(SmallModel, WhatAMergeMayCostDependsOnWhatFollows) {
  if (!HasShippedNetwork()) GTEST_SKIP() << "this program was built without weights";
  const auto made = [](bool is_refined, std::optional<double> cost) {
    EnhanceInput input = SheetInput();
    input.is_refined = is_refined;
    EnhanceOptions options;
    options.model.merge_cost = cost;
    StepReport report;
    const auto enhanced = AllMethods().back().run(input, options, report);
    EXPECT_TRUE(enhanced.ok());
    return enhanced.ok() ? enhanced->size() : 0;
  };
  EXPECT_EQ(made(false, {}), made(false, kMergeCost));
  EXPECT_EQ(made(true, {}), made(true, kMergeCostOfStart));
  EXPECT_LT(made(false, {}), made(true, {}));
}

// What was announced of a network is not said where the filter takes its place, as it does below 1.35 times.
TEST_F(SmallModel, NothingIsForecastOfANetworkThatTheFilterReplaces) {
  if (!HasShippedNetwork()) GTEST_SKIP() << "this program was built without weights";
  int starts = 0;
  EnhanceOptions options;
  options.methods = &AllMethods();
  options.mode = RenderMode::kClassic;
  options.pixel_size = 0.01;
  options.starting = [&starts] { ++starts; };
  options.upscale = 1.2;
  const auto filtered = Enhance(SheetInput().cloud, options);
  ASSERT_TRUE(filtered.ok()) << filtered.error().message;
  EXPECT_EQ(filtered->report.method, "filter");
  EXPECT_EQ(starts, 0);
  options.method = "model";
  const auto enhanced = Enhance(SheetInput().cloud, options);
  ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
  EXPECT_EQ(enhanced->report.method, "model");
  EXPECT_EQ(starts, 1);
}

TEST_F(SmallModel, ConvertKeepsTensorsAndTellsTheArchitecture) {
  const fs::path out = folder_ / "copy.safetensors";
  const Status converted = ConvertCheckpoint(file(), out, {});
  ASSERT_TRUE(converted.ok()) << converted.error().message;
  EXPECT_FALSE(ConvertCheckpoint(file(), out, {}).ok());  // exists
  const auto before = Checkpoint::Open(file()), after = Checkpoint::Open(out);
  ASSERT_TRUE(after.ok()) << after.error().message;
  EXPECT_EQ(after->file().metadata().at("licence"), "CC0");
  EXPECT_EQ(after->file().metadata().at("K"), "2");
  EXPECT_EQ(after->file().metadata().at("encoder_channels"), "8,12");
  ASSERT_EQ(after->file().tensors().size(), before->file().tensors().size());
  for (const TensorEntry& tensor : before->file().tensors()) {
    const TensorEntry* copy = after->file().Find(tensor.name);
    ASSERT_NE(copy, nullptr) << tensor.name;
    EXPECT_EQ(*CopyFloat32(*copy), *CopyFloat32(tensor)) << tensor.name;
  }
  EXPECT_FALSE(ConvertCheckpoint(folder_ / "none.pth", out, {.overwrite = true}).ok());
}

}  // namespace
}  // namespace anchorsplat
