#include "cli/run_for_test.h"
#include "core/companion.h"
#include "core/file_system.h"
#include "io/folder_for_test.h"
#include "train/train_request.h"

namespace anchorsplat {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// The training itself is in train/ and needs LibTorch; here another function takes its place.
class TrainVerb : public testing::Test {
 protected:
  void SetUp() override {
    asked = {};
    answer = TrainReport{};
    WriteText(config_, "[optimizer]\n");
  }
  static Result<TrainReport> Train(const TrainRequest& request) {
    asked = request;
    return answer;
  }
  std::vector<std::string> Words(const std::vector<std::string>& words) {
    std::vector<std::string> all = {"train", "chairs", "tables", "--config", config_, "-o", "run"};
    all.insert(all.end(), words.begin(), words.end());
    return all;
  }

  inline static TrainRequest asked;
  inline static Result<TrainReport> answer = TrainReport{};
  TestFolder folder_;
  std::string config_ = folder_ / "recipe.toml";
};

TEST_F(TrainVerb, AsksForWhatTheWordsSay) {
  ASSERT_EQ(
      RunWords(Words({"--validation", "lamps", "--steps", "50", "--resume", "--cache", "kept", "--split", "test"}),
               {Train})
          .code,
      0);
  EXPECT_THAT(asked.datasets, testing::ElementsAre("chairs", "tables"));
  EXPECT_THAT(asked.validation, testing::ElementsAre("lamps"));
  EXPECT_EQ(asked.config, config_);
  EXPECT_EQ(asked.out, "run");
  EXPECT_EQ(asked.cache, "kept");
  EXPECT_EQ(asked.split, "test");
  EXPECT_EQ(asked.steps, 50);
  EXPECT_TRUE(asked.resume);
  EXPECT_FALSE(asked.overwrite);
  EXPECT_FALSE(asked.minutes);
  EXPECT_FALSE(asked.seed);  // the recipe's
  ASSERT_EQ(RunWords(Words({"--seed", "0", "-w", "--minutes", "2.5"}), {Train}).code, 0);
  EXPECT_EQ(asked.seed, 0u);
  EXPECT_TRUE(asked.overwrite);
  EXPECT_EQ(asked.minutes, 2.5);
}

TEST_F(TrainVerb, SaysWhatItDid) {
  TrainReport report;
  report.steps = 1200;
  report.parameters = 4675;
  report.objects = 30;
  report.file = "run/network.safetensors";
  report.raw = {20.5, 0.5, {}};
  report.filter = {21.5, 0.6, {}};
  report.model = {23.25, 0.75, 0.125};
  answer = report;
  EXPECT_THAT(RunWords(Words({}), {Train}).out,
              AllOf(HasSubstr("run/network.safetensors: 4,675 parameters after 1,200 steps on 30 objects"),
                    HasSubstr("23.250  0.7500  0.1250")));
  EXPECT_THAT(RunWords(Words({"-q"}), {Train}).out, IsEmpty());
  const nlohmann::json json = RunWords(Words({"--json"}), {Train}).json();
  EXPECT_EQ(json["steps"], 1200);
  EXPECT_EQ(json["validation"]["model"], nlohmann::json({{"psnr", 23.25}, {"ssim", 0.75}, {"lpips", 0.125}}));
  EXPECT_EQ(json["validation"]["raw"]["lpips"], nullptr);
}

TEST_F(TrainVerb, TakesCapturesAlone) {
  const std::string captures = folder_.path().string();
  ASSERT_EQ(RunWords({"train", "--captures", captures, "--config", config_, "-o", "run"}, {Train}).code, 0);
  EXPECT_EQ(asked.captures, captures);
  EXPECT_TRUE(asked.datasets.empty());
}

TEST_F(TrainVerb, PassesFailuresOn) {
  answer = Error{ErrorCode::kBadFile, "recipe.toml: line 2: no"};
  const ProgramRun run = RunWords(Words({}), {Train});
  EXPECT_EQ(run.code, ExitCode(ErrorCode::kBadFile));
  EXPECT_THAT(run.err, HasSubstr("recipe.toml: line 2: no"));
  TrainReport stopped;
  stopped.steps = 7;
  stopped.interrupted = true;
  answer = stopped;
  const ProgramRun interrupted = RunWords(Words({}), {Train});
  EXPECT_EQ(interrupted.code, ExitCode(ErrorCode::kInterrupted));
  EXPECT_THAT(interrupted.err, HasSubstr("stopped after step 7"));
}

TEST_F(TrainVerb, RefusesWhatMakesNoSense) {
  ExpectRefused({"train", "chairs", "-o", "run"}, ErrorCode::kBadArgument, {"--config"});
  ExpectRefused({"train", "chairs", "--config", folder_ / "none.toml", "-o", "run"}, ErrorCode::kBadArgument,
                {"none.toml"});
  ExpectRefused({"train", "--config", config_, "-o", "run"}, ErrorCode::kBadArgument, {"nothing to train on"});
  ExpectRefused(Words({"--steps", "0"}), ErrorCode::kBadArgument, {"--steps"});
  ExpectRefused(Words({"--minutes", "0"}), ErrorCode::kBadArgument, {"--minutes"});
}

TEST_F(TrainVerb, NeedsTheProgramWithTheTraining) {
  ASSERT_FALSE(Exists(CompanionFile("anchorsplat-train"))) << "beside the tests, which it would replace";
  const ProgramRun run =
      ExpectRefused(Words({"--json"}), ErrorCode::kNotFound, {"this program was built without LibTorch"});
  EXPECT_EQ(run.json()["error"]["code"], "not_found");
}

}  // namespace
}  // namespace anchorsplat
