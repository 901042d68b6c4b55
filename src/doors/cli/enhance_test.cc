#include <algorithm>

#include "cli/run_for_test.h"
#include "cli/small_scan_for_test.h"
#include "core/spherical_harmonics.h"
#include "core/text.h"
#include "formats/cloud_io.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// `words` after `enhance scan -o out`, with the size of a pixel and as what it is enhanced: a made-up scan says
// neither.
class EnhanceVerb : public testing::Test {
 protected:
  std::vector<std::string> Enhance(const std::vector<std::string>& words, const std::string& out = "out.ply",
                                   const std::string& pixel_size = "0.02") {
    std::vector<std::string> all = {"enhance", scan_, "-o", folder_ / out};
    if (!pixel_size.empty()) all.insert(all.end(), {"--pixel-size", pixel_size, "--mode", "classic"});
    all.insert(all.end(), words.begin(), words.end());
    return all;
  }
  bool Exists(const std::string& name) const { return fs::exists(folder_ / name); }

  TestFolder folder_;
  std::string scan_ = WriteScan(folder_ / "scan.ply");
  std::string compact_ = SourceDirForTest() / "testdata/compact/small.safetensors";
};

TEST_F(EnhanceVerb, Filter) {
  const ProgramRun run = ExpectDone(Enhance({"--method", "filter"}));
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("scan.ply -> "), HasSubstr("200 Gaussians in, 200 out; filter 4x, filter strength "),
                    HasSubstr("pixel size 0.02 (given)")));
  EXPECT_THAT(run.err, HasSubstr("--pixel-size 0.02 is outside the splat's own estimate (0.0"));
  const nlohmann::json row =
      ExpectJson(Enhance({"--method", "filter", "--upscale", "2", "--filter-strength", "0.5"}, "two.ply"))[0];
  EXPECT_EQ(row["input"], scan_);
  EXPECT_EQ(row["output"], (folder_ / "two.ply").string());
  EXPECT_EQ(row["method"], "filter");
  EXPECT_EQ(row["gaussians"], nlohmann::json({{"in", 200}, {"dropped", 0}, {"out", 200}}));
  EXPECT_EQ(row["upscale"], 2);
  EXPECT_EQ(row["filter_strength"], 0.5);
  EXPECT_EQ(row["pixel_size"], nlohmann::json({{"value", 0.02}, {"source", "given"}}));
  EXPECT_EQ(folder_.Entries(), 3);
}

TEST_F(EnhanceVerb, AsksBeforeLargeFiles) {
  const std::string huge = WriteHugeScan(folder_ / "huge.ply", 10'000'000);
  const std::vector<std::string> enhance = {"enhance", huge, "-o", folder_ / "out.ply", "--model", compact_};
  ExpectRefused(enhance, ErrorCode::kBadArgument, {"10,000,000 Gaussians become up to 20,000,000", "5.0 GB", "--yes"});
  EXPECT_EQ(folder_.Entries(), 2);
}

TEST_F(EnhanceVerb, AsksBeforeManyFilesThatAreLargeTogether) {
  const std::string one = WriteHugeScan(folder_ / "one.ply", 6'000'000);
  const std::string two = WriteHugeScan(folder_ / "two.ply", 6'000'000);
  const std::string out = folder_ / "out";
  ExpectRefused({"enhance", one, two, "--out-dir", out, "--model", compact_}, ErrorCode::kBadArgument,
                {"all 2 together take 6.0 GB, more than 4.0 GB"});
}

TEST_F(EnhanceVerb, AnEmptyRegionIsNoRegion) {
  ExpectRefused(Enhance({"--method", "filter", "--region", ""}), ErrorCode::kBadArgument, {"--region"});
}

TEST_F(EnhanceVerb, OverwritesOnlyWhenTold) {
  ExpectDone(Enhance({"--method", "filter"}));
  const std::string before = FileBytes(folder_ / "out.ply");
  ExpectRefused(Enhance({"--method", "filter", "--upscale", "2"}), ErrorCode::kExists, {"out.ply: exists"});
  EXPECT_EQ(FileBytes(folder_ / "out.ply"), before);
  EXPECT_THAT(ExpectDone(Enhance({"--method", "filter", "--upscale", "2", "-w", "-q"})).out, IsEmpty());
  EXPECT_NE(FileBytes(folder_ / "out.ply"), before);
}

TEST_F(EnhanceVerb, UpscaleOfOneChangesNothing) {
  ExpectDone(Enhance({"--method", "filter", "--upscale", "1"}));
  EXPECT_EQ(ExpectJson({"compare", scan_, folder_ / "out.ply", "--orbit", "2", "--size", "64x64"})["mean"]["psnr"],
            nullptr);
}

TEST_F(EnhanceVerb, PixelSizeOfTheCamerasOrOfTheSplat) {
  const std::string input = Biplane() / "input.ply", cameras = Biplane() / "transforms_lr.json";
  const ProgramRun run =
      RunWords({"enhance", input, "-o", folder_ / "cameras.ply", "--method", "filter", "--cameras", cameras, "--json"});
  EXPECT_EQ(run.code, 0);
  EXPECT_THAT(run.err, HasSubstr("--camera-rule median, as the cameras surround the subject"));
  EXPECT_EQ(run.json()[0]["pixel_size"]["source"], "cameras");
  EXPECT_EQ(run.json()[0]["camera_rule"], "median");
  EXPECT_THAT(FileBytes(folder_ / "cameras.ply").substr(0, 500), HasSubstr("\ncomment world up: 0 "));
  const ProgramRun read = ExpectDone({"enhance", input, "-o", folder_ / "auto.ply", "--method", "filter"});
  EXPECT_THAT(read.err, AllOf(HasSubstr("looks like a classic 3DGS fit"), HasSubstr("Using ")));
  EXPECT_THAT(read.out, HasSubstr("(estimated)"));
  const ProgramRun given = ExpectDone({"enhance", input, "-o", folder_ / "given.ply", "--pixel-size", "5"});
  EXPECT_THAT(given.err, HasSubstr("--pixel-size 5 is outside the splat's own estimate (0.00"));

  WriteText(folder_ / "wide.json", R"([{"id":0,"img_name":"a","width":4096,"height":4096,"position":[0,0,-1.7],)"
                                   R"("rotation":[[1,0,0],[0,1,0],[0,0,1]],"fx":4944,"fy":4944}])");
  const ProgramRun wide = RunWords({"enhance", scan_, "-o", folder_ / "wide.ply", "--method", "filter", "--cameras",
                                    folder_ / "wide.json", "--mode", "classic", "--json"});
  EXPECT_EQ(wide.code, 0);
  EXPECT_THAT(wide.err, HasSubstr("1600"));
  EXPECT_EQ(wide.json()[0]["train_width"], 1600);
  ExpectRefused({"enhance", scan_, "-o", folder_ / "no.ply", "--cameras", folder_ / "wide.json", "--train-width", "0"},
                ErrorCode::kBadArgument, {"must be a number above 0, found '0'"});
}

TEST_F(EnhanceVerb, PageBesideTheResult) {
  const ProgramRun run = ExpectDone(Enhance({"--method", "filter", "--view"}));
  EXPECT_THAT(run.out, HasSubstr("out.html: "));
  EXPECT_THAT(FileBytes(folder_ / "out.html"), HasSubstr("<html"));
  ExpectRefused(Enhance({"--method", "filter", "--view"}, "out.splat"), ErrorCode::kExists, {"out.html"});
  // Known to be two before the work begins.
  const std::string other = WriteScan(folder_ / "scan.spz");
  ExpectRefused({"enhance", scan_, other, "--out-dir", folder_ / "pages", "--view", "--pixel-size", "0.02"},
                ErrorCode::kBadArgument, {"would both be"});
  EXPECT_FALSE(Exists("pages"));
  EXPECT_EQ(ExpectJson(Enhance({"--method", "filter", "--view", "-w"}))[0]["view"], (folder_ / "out.html").string());
}

TEST_F(EnhanceVerb, PageThatNoBrowserOpens) {
  // Of numbers that do not repeat themselves: what does would be packed away.
  ASSERT_TRUE(WriteCloud(folder_ / "large.ply", SmallScan(300'000, 0)).ok());
  ExpectRefused({"enhance", folder_ / "large.ply", "-o", folder_ / "huge.ply", "--view", "--pixel-size", "0.0055",
                 "--method", "refine", "--k", "64"},
                ErrorCode::kBadArgument, {"huge.html: the page of --view would have about", "enhance without --view"});
  EXPECT_FALSE(Exists("huge.ply"));
}

TEST_F(EnhanceVerb, NetworkThatIsPartOfTheProgram) {
  EXPECT_THAT(ExpectDone(Enhance({"--method", "model", "--copies", "4"})).out,
              HasSubstr("200 Gaussians in, 800 out; model"));
  const nlohmann::json by_default = ExpectJson(Enhance({"--method", "model", "-w"}))[0];
  EXPECT_EQ(by_default["model"]["copies_made"], 800);
  EXPECT_EQ(by_default["gaussians"]["out"], 800 - by_default["model"]["merged"].get<int64_t>());
  EXPECT_LT(by_default["model"]["merged"], 20);  // of which hardly any is alike
  const std::string real = folder_ / "real.ply";
  ExpectDone({"convert", Biplane() / "input.ply", real, "--max-gaussians", "200", "--sh-degree", "1", "-q"});
  const nlohmann::json pruned = ExpectJson({"enhance", real, "-o", folder_ / "pruned.ply", "--pixel-size", "0.02",
                                            "--method", "model", "--mode", "classic", "--prune-opacity", "0.9"})[0];
  EXPECT_EQ(pruned["method"], "model");
  EXPECT_GT(pruned["model"]["pruned"], 0);
  // What has been enhanced already stays as it is.
  const ProgramRun twice =
      RunWords({"enhance", folder_ / "pruned.ply", "-o", folder_ / "twice.ply", "--pixel-size", "0.02"});
  EXPECT_EQ(twice.code, 0);
  EXPECT_THAT(twice.err, HasSubstr("already enhanced"));
  EXPECT_EQ(FileBytes(folder_ / "twice.ply"), FileBytes(folder_ / "pruned.ply"));
}

TEST_F(EnhanceVerb, NetworkOfAFile) {
  EXPECT_THAT(ExpectDone(Enhance({"--model", compact_, "--method", "model"})).out,
              HasSubstr("200 Gaussians in, 400 out; model"));
  EXPECT_EQ(ExpectJson(Enhance({"--model", compact_, "--method", "model+refine", "--steps", "1", "--poses", "8"},
                               "refined.ply"))[0]["method"],
            "model+refine");
  ExpectRefused(Enhance({"--model", folder_ / "none.pth"}, "bad.ply"), ErrorCode::kNotFound, {"none.pth"});
  ExpectRefused(Enhance({"--model", scan_}, "bad.ply"), ErrorCode::kBadFile, {"scan.ply"});
  ExpectRefused(Enhance({"--model", ""}, "bad.ply"), ErrorCode::kBadArgument, {"--model"});
  WriteText(folder_ / "cut.safetensors", FileBytes(compact_).substr(0, 9000));
  ExpectRefused(Enhance({"--model", folder_ / "cut.safetensors"}, "bad.ply"), ErrorCode::kBadFile, {"cut.safetensors"});
  EXPECT_FALSE(Exists("bad.ply"));
}

// With the words for where they would have an effect.
TEST_F(EnhanceVerb, OptionsThatWouldChangeNothing) {
  const auto refused = [&](const std::vector<std::string>& words, const std::string& why) {
    ExpectRefused(Enhance(words, "bad.ply"), ErrorCode::kBadArgument, {why});
  };
  refused({"--model", compact_, "--normalisation", "bbox"},
          "--normalisation has no effect with --method model (chosen by auto); it works only with a network of the "
          "published architecture");
  refused({"--model", compact_, "--block-gaussians", "5000"}, "--block-gaussians has no effect");
  refused({"--model", compact_, "--method", "filter"},
          "--model has no effect with --method filter; it works only with --method model");
  refused({"--prune-opacity", "0.1", "--method", "filter"}, "--prune-opacity has no effect");
  refused({"--precision", "bf16", "--method", "filter"}, "--precision has no effect");
  refused({"--poses", "5"}, "(chosen by auto); it works only with --method refine, refine-images or detail");
  refused({"--steps", "5", "--method", "filter"}, "--steps has no effect");
  const std::string cameras = Biplane() / "transforms_hr.json";
  ExpectRefused(Enhance({"--poses", "5", "--method", "refine", "--cameras", cameras}, "bad.ply", ""),
                ErrorCode::kBadArgument, {"without --images and --cameras"});
  ExpectRefused(
      Enhance({"--prune-opacity", "0.1", "--method", "filter+refine-images", "--images", cameras, "--steps", "1"},
              "bad.ply", ""),
      ErrorCode::kBadArgument,
      {"--prune-opacity has no effect with --method filter+refine-images; it works only with --method model"});
  EXPECT_FALSE(Exists("bad.ply"));
}

TEST_F(EnhanceVerb, Qualities) {
  scan_ = Biplane() / "input.ply";  // one of which more is expected of the network
  const nlohmann::json fast = ExpectJson(Enhance({"--quality", "fast"}, "fast.ply", ""))[0];
  EXPECT_EQ(fast["quality"], "fast");
  EXPECT_EQ(fast["method"], "model");
  const nlohmann::json good =
      ExpectJson(Enhance({"--quality", "good", "--steps", "1", "--poses", "8"}, "good.ply", ""))[0];
  EXPECT_EQ(good["method"], "model+refine");
  EXPECT_THAT(ExpectDone(Enhance({"--quality", "best", "--steps", "1", "--poses", "8"}, "alone.ply", "")).err,
              HasSubstr("works better with the training pictures"));
  EXPECT_EQ(good["refine"]["k"], 1);
  ExpectRefused(Enhance({"--quality", "good", "--method", "filter"}, "bad.ply"), ErrorCode::kBadArgument,
                {"--quality good is --method model+refine, so it excludes --method filter"});
  ExpectRefused(Enhance({"--quality", "perfect"}, "bad.ply"), ErrorCode::kBadArgument, {"--quality"});
  ExpectRefused(Enhance({"--quality", "good", "--images", Biplane() / "transforms_lr.json"}, "bad.ply"),
                ErrorCode::kBadArgument, {"--quality best"});
}

TEST_F(EnhanceVerb, Refinement) {
  const nlohmann::json row = ExpectJson(Enhance(
      {"--method", "refine", "--upscale", "2", "--steps", "3", "--poses", "10", "--k", "2"}, "out.ply", "0.1"))[0];
  EXPECT_EQ(row["method"], "refine");
  EXPECT_TRUE(row["refine"].contains("consistency_after"));
  EXPECT_TRUE(row["refine"]["kept_start"].is_boolean());
  const nlohmann::json& plan = row["refine"]["plan"];
  EXPECT_EQ(plan["from_input"], false);
  EXPECT_EQ(plan["least_gain"], 0);
  EXPECT_EQ(plan["steps"], 3);
  EXPECT_EQ(plan["k"], 2);
  EXPECT_EQ(plan["gaussians"], 2 * row["gaussians"]["in"].get<int64_t>());
  EXPECT_EQ(ExpectJson({"info", folder_ / "out.ply"})["gaussians"], row["gaussians"]["out"]);
  EXPECT_FALSE(Exists("out.ply.checkpoint"));  // it is finished
}

TEST_F(EnhanceVerb, RefinementWithPictures) {
  const std::string project = WriteProject(folder_ / "project");
  const ProgramRun run = ExpectDone(Enhance(
      {"--method", "refine", "--upscale", "2", "--images", project, "--hold-out", "5", "--steps", "3", "--k", "1"}));
  EXPECT_THAT(run.err, HasSubstr("8 views with pictures"));
  EXPECT_EQ(ExpectJson(Enhance({"--quality", "best", "--upscale", "2", "--images", project, "--hold-out", "5",
                                "--steps", "2", "--k", "1"},
                               "best.ply"))[0]["quality"],
            "best");
  ExpectRefused({"enhance", Biplane() / "input.ply", "-o", folder_ / "x.ply", "--method", "refine", "--pixel-size",
                 "0.0055", "--images", project, "--steps", "2"},
                ErrorCode::kBadArgument, {"order of their cameras"});
  ExpectRefused(Enhance({"--method", "refine", "--images", folder_ / "none"}, "x.ply"), ErrorCode::kNotFound);
  ExpectRefused(Enhance({"--method", "filter", "--images", project}, "x.ply"), ErrorCode::kBadArgument);
  ExpectRefused(
      {"enhance", scan_, folder_ / "out.ply", "--method", "refine", "--out-dir", folder_ / "two", "--images", project},
      ErrorCode::kBadArgument, {"one input only"});
}

TEST_F(EnhanceVerb, RefinementsThatMakeNoSense) {
  const auto refused = [&](std::vector<std::string> words, ErrorCode code, const std::string& why = "") {
    words.insert(words.end(), {"--method", "refine"});
    ExpectRefused(Enhance(words, "x.ply"), code, {why});
  };
  refused({"--steps", "8", "--seconds", "1"}, ErrorCode::kBadArgument, "--seconds");
  refused({"--exposure"}, ErrorCode::kBadArgument, "--exposure");
  ExpectRefused(Enhance({"--method", "refine-images"}, "x.ply"), ErrorCode::kBadArgument, {"--images"});
  // No file is lost to a checkpoint.
  WriteText(folder_ / "mine", "mine");
  refused({"--steps", "2", "--checkpoint", scan_}, ErrorCode::kBadArgument);
  refused({"--steps", "2", "--checkpoint", folder_ / "x.ply"}, ErrorCode::kBadArgument, "is also the output");
  refused({"--steps", "2", "--checkpoint", folder_ / "mine", "-w"}, ErrorCode::kExists, "is not a checkpoint");
  EXPECT_EQ(FileBytes(folder_ / "mine"), "mine");
  ExpectRefused({"enhance", scan_, "-o", "/proc/x.ply", "--method", "refine", "--pixel-size", "0.02"}, ErrorCode::kIo);
  EXPECT_FALSE(Exists("x.ply"));
}

TEST_F(EnhanceVerb, Batches) {
  const std::string other = WriteScan(folder_ / "other.ply", 100);
  WriteText(folder_ / "broken.ply", "none\n");
  const std::vector<std::string> words = {"enhance",  scan_,    other,          "--out-dir", folder_ / "many",
                                          "--method", "filter", "--pixel-size", "0.02"};
  ExpectDone(words);
  EXPECT_TRUE(Exists("many/scan.ply"));
  EXPECT_TRUE(Exists("many/other.ply"));
  ExpectRefused(words, ErrorCode::kExists, {"many/scan.ply"});
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "many"), {}), 2);
  const ProgramRun run = RunWords({"enhance", folder_ / "broken.ply", scan_, "--out-dir", folder_ / "two", "--method",
                                   "filter", "--pixel-size", "0.02", "--json"});
  EXPECT_EQ(run.code, kPartialExitCode);
  EXPECT_THAT(run.err, HasSubstr("broken.ply"));
  EXPECT_EQ(run.json()[0]["failure"]["code"], "bad_file");
  EXPECT_EQ(run.json()[1]["method"], "filter");
  EXPECT_TRUE(Exists("two/scan.ply"));
  ExpectRefused({"enhance", scan_, Biplane() / "input.ply", Biplane() / "../stone_lantern/input.ply", "--out-dir",
                 folder_ / "same"},
                ErrorCode::kBadArgument, {"would both become"});
  ExpectRefused(Enhance({other}, "bad.ply"), ErrorCode::kBadArgument, {"2 inputs but one -o file"});
  ExpectRefused({"enhance", scan_}, ErrorCode::kBadArgument, {"no output"});
}

TEST_F(EnhanceVerb, Cleans) {
  GaussianCloud cloud = SmallScan(200, 0), dust = SmallScan(100, 0);
  std::ranges::fill(dust.sh, DcFromColor(0));  // black
  for (float& x : dust.means) x *= 2;
  ASSERT_TRUE(Append(cloud, dust).ok());
  ASSERT_TRUE(WriteCloud(folder_ / "dusty.ply", cloud).ok());
  const std::string project = WriteProject(folder_ / "project");
  const nlohmann::json json =
      ExpectJson({"enhance", folder_ / "dusty.ply", "-o", folder_ / "clean.ply", "--clean", "--method", "filter",
                  "--mode", "classic", "--cameras", project + "/transforms.json"})[0];
  const int64_t gone = json["cleaned"]["gaussians"];
  EXPECT_GT(gone, 3);
  EXPECT_LE(gone, 100);
  EXPECT_EQ(json["cleaned"]["views"], 10);
  EXPECT_GE(json["cleaned"]["psnr"].get<double>(), 50);
  EXPECT_EQ(ExpectJson({"info", folder_ / "clean.ply"})["gaussians"], 300 - gone);
}

TEST_F(EnhanceVerb, RefusesWhatMakesNoSense) {
  const auto refused = [&](const std::vector<std::string>& words, const std::string& why = "") {
    ExpectRefused(Enhance(words, "bad.ply", ""), ErrorCode::kBadArgument, {why});
  };
  refused({"--upscale", "0.5"}, "upscale");
  refused({"--pixel-size", "big"}, "--pixel-size: 'big'");
  refused({"--filter-strength", "-1"});
  refused({"--filter-strength", "1e300"});
  refused({"--method", "magic"}, "filter");
  refused({"--cameras", ""}, "--cameras");
  refused({"--shuffles", "0123"}, "--shuffles");
  refused({"--camera-rule", "median"}, "--cameras");
  refused({"--background", "1,1,1"}, "--clean");
  refused({"--clean", "--background", "white"}, "--background");
  ExpectRefused({"enhance", folder_ / "nothing.ply", "-o", folder_ / "bad.ply"}, ErrorCode::kNotFound, {"nothing.ply"});
  // Before anything is read.
  ExpectRefused({"enhance", folder_ / "nothing.ply", "-o", folder_ / "bad.xyz"}, ErrorCode::kBadArgument, {"bad.xyz"});
  ExpectRefused(Enhance({}, "nowhere/out.ply"), ErrorCode::kNotFound, {"nowhere"});
  EXPECT_EQ(folder_.Entries(), 1);
}

}  // namespace
}  // namespace anchorsplat
