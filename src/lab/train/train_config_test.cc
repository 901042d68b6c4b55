#include "train/train_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/source_dir_for_test.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;

TEST(TrainConfig, ReadsEveryTable) {
  const auto config = ParseTrainConfig(R"(
seed = 7
steps = 1234
precision = "bf16"
[network]
kind = "compact"
copies = 4
prior = true
widths = [32, 64]
[loss]
l1 = 0.5
lpips = 0.25
lpips_net = "alex"
[optimizer]
learning_rate = 1e-4
schedule = "constant"
ema = 0
[optimizer.groups]
means = 3e-7
[data]
crop = 256
fixed_views = true
least_upscale = 2
greatest_upscale = 8
least_merge_cost = 1e-4
greatest_merge_cost = 1e-3
[augmentation]
rotate = true
[validation]
every = 100
)",
                                       "x.toml");
  ASSERT_TRUE(config.ok()) << config.error().message;
  EXPECT_EQ(config->seed, 7u);
  EXPECT_EQ(config->steps, 1234);
  EXPECT_EQ(config->precision, Precision::kBf16);
  EXPECT_EQ(std::get<double>(config->network.at("copies")), 4);
  EXPECT_EQ(std::get<bool>(config->network.at("prior")), true);
  EXPECT_EQ(std::get<std::vector<double>>(config->network.at("widths")), (std::vector<double>{32, 64}));
  EXPECT_FALSE(config->network.contains("kind"));
  EXPECT_EQ(config->loss.lpips_net, LpipsNet::kAlex);
  EXPECT_EQ(config->optimizer.groups.at("means"), 3e-7);
  EXPECT_EQ(config->optimizer.schedule, Schedule::kConstant);
  EXPECT_EQ(config->data.greatest_upscale, 8);
  EXPECT_EQ(Settings(*config)["data.least_upscale"], 2.0);
  EXPECT_EQ(config->data.least_merge_cost, 1e-4);
  EXPECT_EQ(Settings(*config)["data.greatest_merge_cost"], 1e-3);
  EXPECT_TRUE(config->augmentation.geometry());
  EXPECT_EQ(Settings(*config)["network.copies"], 4.0);
  const Error located = InNetworkTable(*config, {ErrorCode::kBadArgument, "copies: bad"});
  EXPECT_EQ(located.message, "x.toml: line 7: network.copies: bad");
  EXPECT_EQ(located.code, ErrorCode::kBadFile) << "as for the other tables";
}

TEST(TrainConfig, ComplaintsNameFileLineAndKey) {
  const auto complaint = [](const std::string& text) {
    const auto config = ParseTrainConfig(text, "x.toml");
    return config.ok() ? std::string("no complaint") : config.error().message;
  };
  EXPECT_EQ(complaint("\nstep = 3\n"), "x.toml: line 2: step: unknown setting");
  EXPECT_EQ(complaint("[optimizer]\nclip = -1\n"), "x.toml: line 2: optimizer.clip: expected a number from 0 to 1e+09");
  EXPECT_EQ(complaint("[data]\ncrop = 2.5\n"), "x.toml: line 2: data.crop: expected a whole number from 0 to 16384");
  EXPECT_EQ(complaint("[loss]\nlpips_net = \"resnet\"\n"),
            "x.toml: line 2: loss.lpips_net: expected one of \"alex\", \"vgg\", \"squeeze\", not \"resnet\"");
  EXPECT_EQ(complaint("[optimizer.groups]\nmeans = \"fast\"\n"),
            "x.toml: line 2: optimizer.groups.means: expected a number from 0 to 10");
  EXPECT_EQ(complaint("[captures]\nfit_steps = [1000, 0]\n"),
            "x.toml: line 2: captures.fit_steps: expected a list of whole numbers from 1 to 1000000");
  EXPECT_EQ(complaint("[captures]\nhold_out = 1\n"),
            "x.toml: line 2: captures.hold_out: expected a whole number from 2 to 1000");
  EXPECT_THAT(complaint("[data]\npart = 100\n[augmentation]\ndrop = 0.1\n"),
              HasSubstr("x.toml: data.part: cannot be used with augmentation.drop"));
  for (const char* range : {"least_upscale = 2", "greatest_upscale = 4", "least_upscale = 4\ngreatest_upscale = 2",
                            "least_upscale = 0.5\ngreatest_upscale = 2"}) {
    EXPECT_THAT(complaint(std::string("[data]\n") + range + "\n"), HasSubstr("x.toml: data.least_upscale and"))
        << range;
  }
  for (const char* range : {"least_merge_cost = 1e-4", "greatest_merge_cost = 1e-4",
                            "least_merge_cost = 1e-3\ngreatest_merge_cost = 1e-4"}) {
    EXPECT_THAT(complaint(std::string("[data]\n") + range + "\n"), HasSubstr("x.toml: data.least_merge_cost and"))
        << range;
  }
  EXPECT_EQ(complaint("[loss]\nl1 = 0\n"), "x.toml: loss: all weights are 0, so there is nothing to learn");
  EXPECT_EQ(complaint("loss = 3\n"), "x.toml: line 1: loss: expected a table [loss]");
  EXPECT_THAT(complaint("steps = \n"), HasSubstr("x.toml: line 1: not TOML"));
  EXPECT_THAT(complaint("[network]\nwidths = [1, \"two\"]\n"), HasSubstr("line 2: network.widths: expected numbers"));
  EXPECT_THAT(complaint("[network]\nwidths = {a = 1}\n"), HasSubstr("network.widths: expected a number, a string"));
}

TEST(TrainConfig, TheRecipesOfTheRepositoryAreRight) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(SourceDirForTest() / "configs")) {
    const auto config = ReadTrainConfig(entry.path());
    EXPECT_TRUE(config.ok()) << config.error().message;
    ++count;
  }
  EXPECT_GE(count, 2);
}

}  // namespace
}  // namespace anchorsplat
