#include <map>

#include "cli/run_for_test.h"
#include "cli/small_scan_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

// `eval examples -o out --objects biplane WORDS`
class EvalVerb : public testing::Test {
 protected:
  std::vector<std::string> Eval(const std::vector<std::string>& words) {
    std::vector<std::string> all = {"eval",   SourceDirForTest() / "examples", "-o", folder_ / "out", "--objects",
                                    "biplane"};
    all.insert(all.end(), words.begin(), words.end());
    return all;
  }

  TestFolder folder_;
};

TEST_F(EvalVerb, WritesTablesAndGoesOn) {
  const nlohmann::json json = ExpectJson(Eval({"--max-views", "1", "--methods", "raw,upsample,filter"}));
  EXPECT_EQ(json["methods"].size(), 3u);
  EXPECT_THAT(json.dump(), HasSubstr("gain_over_raw"));
  for (const char* file : {"table.md", "table.csv", "results.json", "contact_sheet.png"}) {
    EXPECT_GT(fs::file_size(folder_ / "out" / file), 0u) << file;
  }
  // What is there is not measured again.
  const nlohmann::json again = ExpectJson(Eval({"--max-views", "1", "--methods", "raw,filter"}));
  EXPECT_EQ(again["resumed"], 2);
  EXPECT_EQ(ExpectJson(Eval({"--max-views", "1", "--methods", "raw", "-w"}))["resumed"], 0);
  // Another seed has other intervals of the same results.
  EXPECT_THAT(ExpectDone(Eval({"--max-views", "1", "--methods", "raw,filter", "--seed", "2"})).out,
              AllOf(HasSubstr("Evaluation of examples"), HasSubstr("Written: ")));
}

// What another scheduler needs: every object, and every method with the name of its file.
TEST_F(EvalVerb, Plan) {
  const nlohmann::json plan = ExpectJson(
      {"eval", SourceDirForTest() / "examples", "-o", folder_ / "out", "--methods", "raw,filter@0.15", "--plan"});
  EXPECT_THAT(plan["objects"].get<std::vector<std::string>>(), testing::IsSupersetOf({"biplane", "stone_lantern"}));
  ASSERT_EQ(plan["methods"].size(), 2u);
  EXPECT_EQ(plan["methods"][0], nlohmann::json({{"word", "raw"}, {"file", "raw"}}));
  EXPECT_EQ(plan["methods"][1]["word"], "filter@0.15");
  EXPECT_EQ(plan["methods"][1]["file"].get<std::string>().find_first_of("/ "), std::string::npos);
  EXPECT_FALSE(fs::exists(folder_ / "out")) << "a plan measures nothing";
}

// By 0.5 dB in every example: what a change of the program or of the weights must not lose.
TEST_F(EvalVerb, ShippedNetworkBeatsTheFilter) {
  const nlohmann::json json = ExpectJson({"eval", SourceDirForTest() / "examples", "-o", folder_ / "out", "--max-views",
                                          "1", "--methods", "filter,model"});
  std::ifstream table(folder_ / "out/table.csv");
  std::map<std::string, std::map<std::string, std::pair<double, double>>> scores;  // PSNR and SSIM by object, method
  std::string line;
  std::getline(table, line);
  EXPECT_THAT(line, testing::StartsWith("object,method,"));
  while (std::getline(table, line)) {
    const std::vector<std::string> cells = CLI::detail::split(line, ',');
    ASSERT_GE(cells.size(), 5u) << line;
    scores[cells[0]][cells[1]] = {std::stod(cells[3]), std::stod(cells[4])};
  }
  ASSERT_EQ(scores.count("biplane") + scores.count("stone_lantern"), 2u);
  for (const std::string object : {"biplane", "stone_lantern"}) {
    EXPECT_GT(scores[object]["model"].first, scores[object]["filter"].first + 0.5) << object;
    EXPECT_GT(scores[object]["model"].second, scores[object]["filter"].second) << object;
  }
}

TEST_F(EvalVerb, ChoosesF) {
  const nlohmann::json json = ExpectJson(Eval({"--max-views", "1", "--choose-f"}));
  EXPECT_GT(json["chosen_f"], 0);
  EXPECT_LE(json["chosen_f"], 1);
  EXPECT_THAT(ExpectDone(Eval({"--max-views", "1", "--choose-f"})).out, HasSubstr("Best strength over all objects: "));
}

TEST_F(EvalVerb, OneBadObjectDoesNotStopTheOthers) {
  fs::create_directories(folder_ / "objects/bad");
  fs::copy(Biplane(), folder_ / "objects/good", fs::copy_options::recursive);
  fs::copy_file(Biplane() / "transforms_hr.json", folder_ / "objects/bad/transforms_hr.json");
  const ProgramRun run =
      RunWords({"eval", folder_ / "objects", "-o", folder_ / "out", "--max-views", "1", "--methods", "raw", "--json"});
  EXPECT_EQ(run.code, kPartialExitCode);
  EXPECT_THAT(run.err, HasSubstr("bad"));
  EXPECT_EQ(run.json()["failures"].size(), 1u);
}

// A capture beside an object that has its splat; what is there is not measured again, and a method added later is.
TEST_F(EvalVerb, RealCaptures) {
  const fs::path captures = folder_ / "captures";
  WriteProject(captures / "ball");
  fs::copy(Biplane(), captures / "biplane", fs::copy_options::recursive);
  const auto eval = [&](const std::string& methods) {
    return std::vector<std::string>{"eval",        captures, "-o",        folder_ / "out", "--recipe",    "real",
                                    "--fit-steps", "2",      "--methods", methods,         "--max-views", "1"};
  };
  const nlohmann::json json = ExpectJson(eval("raw,upsample"));
  EXPECT_EQ(json["objects"], nlohmann::json({"ball", "biplane"}));
  EXPECT_EQ(json["results"].size(), 4u);
  EXPECT_TRUE(fs::exists(folder_ / "out/objects/ball/fit/splat.ply"));
  EXPECT_FALSE(fs::exists(folder_ / "out/objects/biplane/fit"));
  EXPECT_EQ(ExpectJson(eval("raw,filter,upsample"))["resumed"], 4);
  EXPECT_THAT(ExpectDone(eval("raw,filter,upsample")).out, HasSubstr("Seconds of a method per object"));
  std::vector<std::string> plan = eval("raw");
  plan.emplace_back("--plan");
  ExpectRefused(plan, ErrorCode::kBadArgument, {"--recipe real"});
  std::vector<std::string> split = eval("raw");
  split.insert(split.end(), {"--split", "test"});
  ExpectRefused(split, ErrorCode::kBadArgument, {"--split"});
}

TEST_F(EvalVerb, RefusesWhatMakesNoSense) {
  ExpectRefused(Eval({"--methods", "magic"}), ErrorCode::kBadArgument, {"filter-auto"});
  ExpectRefused(Eval({"--methods", "none.safetensors"}), ErrorCode::kNotFound, {"none.safetensors"});
  ExpectRefused(Eval({"--choose-f", "--methods", "raw"}), ErrorCode::kBadArgument, {"--choose-f"});
  ExpectRefused(Eval({"--protocol", "mine"}), ErrorCode::kBadArgument, {"--protocol"});
  const std::string examples = SourceDirForTest() / "examples";
  ExpectRefused({"eval", examples, "-o", folder_ / "out", "--objects", "triplane"}, ErrorCode::kBadArgument,
                {"triplane"});
  ExpectRefused({"eval", examples}, ErrorCode::kBadArgument, {"--output"});
  fs::create_directory(folder_ / "empty");
  ExpectRefused({"eval", folder_ / "empty", "-o", folder_ / "out"}, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace anchorsplat
