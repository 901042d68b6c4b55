// What would have no effect is refused, with the words for where it would have one.

#include "cli/run_for_test.h"
#include "cli/small_scan_for_test.h"
#include "io/file_lock.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;
using testing::Not;

class Effects : public testing::Test {
 protected:
  void ExpectNoEffect(std::vector<std::string> words, const std::string& says) {
    ExpectRefused(words, ErrorCode::kBadArgument, {says});
  }

  TestFolder folder_;
  std::string scan_ = WriteScan(folder_ / "scan.ply");
};

TEST_F(Effects, OfRenderingOnPictures) {
  const std::string views = folder_ / "views";
  ExpectDone({"render", scan_, "-o", views, "--orbit", "1", "--size", "48x48", "-q"});
  for (const std::vector<std::string>& option :
       {std::vector<std::string>{"--near", "100"}, {"--size", "64x64"}, {"--orbit", "5"}, {"--mode", "classic"}}) {
    ExpectNoEffect({"compare", views, views, option[0], option[1]}, option[0] + " has no effect on pictures");
  }
  ExpectDone({"compare", views, views});
  ExpectNoEffect({"compare", scan_, scan_, "--orbit", "1", "--color-correct"}, "--color-correct has no effect");
  ExpectNoEffect({"compare", views, views, "--truth", scan_, "--orbit", "1", "--size", "48x48", "--color-correct"},
                 "it works only against pictures");
  ExpectRefused({"render", scan_, "-o", folder_ / "one.png", "--orbit", "1", "--transparent", "--background", "1,1,1"},
                ErrorCode::kBadArgument, {"--transparent"});
}

TEST_F(Effects, OfReportsAndFormats) {
  ExpectRefused({"convert", scan_, folder_ / "o.spz", "--report-views", "3"}, ErrorCode::kBadArgument, {"--report"});
  ExpectNoEffect({"convert", scan_, folder_ / "o.ply", "--spz-version", "3"}, "with a .spz output");
  ExpectDone({"convert", scan_, folder_ / "o.spz", "--spz-version", "3", "-q"});
  ExpectNoEffect({"convert", scan_, folder_ / "o.ply", "--lod-levels", "3"}, "with a lod-meta.json output");
  ExpectNoEffect({"convert", scan_, folder_ / "o.ply", "--lod-level", "1"}, "with a lod-meta.json input");
  ExpectNoEffect({"convert", scan_, "--lod", folder_ / "o", "--sort", "keep"}, "--sort has no effect here");
  ExpectNoEffect({"convert", scan_, folder_ / "o.splat", "--mode", "mip"}, "--mode has no effect here");
  ExpectRefused({"view", scan_, "-o", folder_ / "o.html", "--views", "3"}, ErrorCode::kBadArgument, {"--cameras"});
}

TEST_F(Effects, OfTheScheduleOfAFit) {
  const std::string project = WriteProject(folder_ / "project");
  const auto fit = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"fit", project, "-o", folder_ / "fit.ply", "--steps", "2", "--init-points", "50"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  ExpectNoEffect(fit({"--pixel", "point", "--upscale", "3"}), "--pixel area");
  ExpectNoEffect(fit({"--sh-degree", "0", "--rate-sh-rest", "1"}), "--sh-degree above 0");
  ExpectNoEffect(fit({"--sh-degree", "0", "--sh-degree-interval", "3"}), "--sh-degree above 0");
  ExpectNoEffect(fit({"--opacity-reset", "never", "--reset-every", "3"}), "--opacity-reset positive or from-zero");
  ExpectNoEffect(fit({"--refine-stop", "1", "--refine-start", "5"}), "--refine-start has no effect here");
}

TEST_F(Effects, OfTheStrategyOfAFit) {
  const std::string project = WriteProject(folder_ / "project");
  const auto fit = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"fit", project, "-o", folder_ / "fit.ply", "--steps", "2", "--init-points", "50"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  for (const std::vector<std::string>& option : {std::vector<std::string>{"--grow-grad2d", "1"},
                                                 {"--grow-scale3d", "1"},
                                                 {"--prune-opa", "0.1"},
                                                 {"--prune-scale3d", "1"},
                                                 {"--reset-every", "3"},
                                                 {"--opacity-reset", "never"},
                                                 {"--revised-opacity"}}) {
    std::vector<std::string> words = {"--strategy", "mcmc"};
    words.insert(words.end(), option.begin(), option.end());
    ExpectNoEffect(fit(words), option[0] + " has no effect here; it works only with --strategy default or absgrad");
  }
  ExpectNoEffect(fit({"--noise-lr", "1"}), "--noise-lr has no effect here; it works only with --strategy mcmc");
  ExpectNoEffect(fit({"--strategy", "absgrad", "--min-opacity", "0.1"}), "it works only with --strategy mcmc");
  ExpectNoEffect(fit({"--mip-filter", "--mode", "antialiased"}), "--mode has no effect here; it works only without");
  ExpectNoEffect(fit({"--strategy", "mcmc", "--max-gaussians", "0"}), "needs a number to grow to");
  ExpectNoEffect(fit({"--mip-filter", "--pixel", "area"}), "--mip-filter and --pixel area");
  // What has no meaning names the option as it is written.
  for (const char* option : {"--prune-opa", "--grow-scale3d", "--prune-scale3d", "--rate-means-decay"}) {
    ExpectNoEffect(fit({option, "0"}), option);
  }
  ExpectNoEffect(fit({"--prune-opa", "0"}), "above 0 and below 0.5");
  ExpectNoEffect(fit({"--strategy", "mcmc", "--min-opacity", "0"}), "--min-opacity");
  ExpectNoEffect(fit({"--rate-means-decay", "2"}), "--rate-means-decay");
}

TEST_F(Effects, OfCamerasThatSeeNothing) {
  const std::string cameras = folder_ / "away.json";
  WriteText(cameras, R"({"w": 64, "h": 64, "fl_x": 60, "fl_y": 60, "cx": 32, "cy": 32, "frames": [{"file_path": "a",
      "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,-50],[0,0,0,1]]}]})");
  ExpectRefused({"enhance", scan_, "-o", folder_ / "o.ply", "--method", "filter", "--cameras", cameras},
                ErrorCode::kBadArgument, {"no camera sees any of the Gaussians"});
  const ProgramRun page = ExpectDone({"view", scan_, "-o", folder_ / "o.html", "--cameras", cameras});
  EXPECT_THAT(page.err, HasSubstr("behind the camera"));
  WriteProject(folder_ / "project");
  ExpectRefused({"enhance", scan_, "-o", folder_ / "o.ply", "--method", "filter", "--train-width", "1000", "--cameras",
                 folder_ / "project"},
                ErrorCode::kBadArgument, {"--train-width 1000 has no effect"});
}

// Two runs that keep their state in one place would take it away from each other.
TEST_F(Effects, OneRunForACheckpoint) {
  const std::string project = WriteProject(folder_ / "project");
  const std::vector<std::string> words = {"fit", project,         "-o", folder_ / "fit.ply", "--steps",
                                          "2",   "--init-points", "50"};
  {
    const auto other = FileLock::TakeAndRemove(folder_ / "fit.ply.checkpoint.lock");
    ASSERT_TRUE(other.ok());
    ExpectRefused(words, ErrorCode::kExists, {"in use by another run"});
  }
  const ProgramRun run = ExpectDone(words);
  EXPECT_THAT(run.err, Not(HasSubstr("warning")));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "fit.ply.checkpoint.lock"));
}

}  // namespace
}  // namespace anchorsplat
