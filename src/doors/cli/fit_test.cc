#include "cli/run_for_test.h"
#include "cli/small_scan_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class FitVerb : public testing::Test {
 protected:
  // `fit project -o out WORDS` of a few steps, unless the words say how many.
  std::vector<std::string> Fit(const std::string& out, const std::vector<std::string>& words, bool few = true) {
    std::vector<std::string> all = {"fit", project_, "-o", folder_ / out, "--init-points", "200"};
    if (few) all.insert(all.end(), {"--steps", "12"});
    all.insert(all.end(), words.begin(), words.end());
    return all;
  }

  TestFolder folder_;
  std::string project_ = WriteProject(folder_ / "project");
};

TEST_F(FitVerb, MakesASplat) {
  const nlohmann::json json =
      ExpectJson(Fit("fit.ply", {"--hold-out", "5", "--gsplat-checkpoint", folder_ / "ckpt_11_rank0.pt"}));
  EXPECT_EQ(json["steps"], 12);
  EXPECT_EQ(json["resumed_at"], 0);
  EXPECT_EQ(json["initial_points"], "view");
  EXPECT_EQ(json["settings"]["mode"], "classic");
  EXPECT_EQ(json["settings"]["pixel"], "point");
  EXPECT_EQ(json["settings"]["strategy"], "default");
  EXPECT_EQ(json["train"]["views"], 8);
  EXPECT_EQ(json["held_out"]["views"], 2);
  EXPECT_EQ(json["gaussians"]["in"], 200);
  EXPECT_EQ(ExpectJson({"info", folder_ / "fit.ply"})["gaussians"], json["gaussians"]["out"]);
  EXPECT_FALSE(fs::exists(folder_ / "fit.ply.checkpoint"));  // it is finished
  // Both files hold the same splat.
  EXPECT_EQ(ExpectJson({"compare", folder_ / "fit.ply", folder_ / "ckpt_11_rank0.pt", "--orbit", "1", "--size",
                        "48x48"})["mean"]["psnr"],
            nullptr);
  EXPECT_EQ(ExpectJson({"compare", folder_ / "fit.ply", project_ + "/views", "--cameras", project_})["views"].size(),
            10u);
}

TEST_F(FitVerb, SaysWhatItDid) {
  const ProgramRun run = ExpectDone(Fit("fit.ply", {"--hold-out", "0"}));
  EXPECT_THAT(run.err, HasSubstr("10 training views, 0 held out"));
  EXPECT_THAT(run.out, AllOf(HasSubstr("Gaussians after 12 steps"), HasSubstr("training views: 10, ")));
  EXPECT_THAT(ExpectDone(Fit("quiet.ply", {"-q"})).err, IsEmpty());
  EXPECT_THAT(ExpectDone({"fit", project_, "-o", folder_ / "one.ply", "--init-points", "200", "--steps", "1"}).out,
              HasSubstr("Gaussians after 1 step in"));
  ExpectRefused({"fit", folder_ / "fit.ply", "-o", folder_ / "bad.ply"}, ErrorCode::kBadFile,
                {"fit.ply", "a splat or a point cloud, not cameras"});
}

TEST_F(FitVerb, SaysWhereNothingIsLeft) {
  const ProgramRun run = ExpectDone(Fit(
      "faded.ply", {"--strategy", "mcmc", "--max-gaussians", "200", "--opacity-reg", "1000", "--rate-opacities", "1"}));
  EXPECT_THAT(run.err, HasSubstr("the fit failed: only 0 of "));
  EXPECT_THAT(ExpectDone(Fit("fit.ply", {})).err, Not(HasSubstr("the fit failed")));
}

TEST_F(FitVerb, BeginsWhereItIsTold) {
  // Longer, and all would be pruned: few of so few are seen.
  EXPECT_EQ(ExpectJson(Fit("random.ply", {"--init", "random", "--steps", "2"}, /*few=*/false))["initial_points"],
            "random");
  const std::string scan = WriteScan(folder_ / "scan.ply", 50);
  const nlohmann::json json = ExpectJson(Fit("again.ply", {"--init-splat", scan}));
  EXPECT_EQ(json["initial_points"], "splat");
  EXPECT_EQ(json["gaussians"]["in"], 50);
  ExpectDone(Fit("area.ply", {"--pixel", "area", "--upscale", "2"}));
}

TEST_F(FitVerb, SaysWhatBecameOfItsShell) {
  const ProgramRun automatic = ExpectDone(Fit("auto.ply", {}));
  EXPECT_THAT(automatic.err, HasSubstr("far shell: none, as the start is not the project's points"));
  EXPECT_THAT(ExpectDone(Fit("none.ply", {"--shell", "0"})).err, Not(HasSubstr("far shell")));
  EXPECT_EQ(FileBytes(folder_ / "auto.ply"), FileBytes(folder_ / "none.ply"));
  const nlohmann::json json = ExpectJson(Fit("shell.ply", {"--shell", "300"}));
  const int64_t made = json["shell"]["gaussians"];
  EXPECT_GT(made, 50);
  EXPECT_LE(made, 300);
  EXPECT_EQ(json["shell"]["on_sphere"], 300);
  EXPECT_EQ(json["gaussians"]["in"], 200 + made);
  EXPECT_GT(json["settings"]["far_radius"], 0);
  EXPECT_FALSE(ExpectJson(Fit("plain.ply", {"--shell", "auto"}))["settings"].contains("far_radius"));
  for (const char* wrong : {"-1", "some", "1.5", "1048577", ""}) {
    ExpectRefused(Fit("x.ply", {"--shell", wrong}), ErrorCode::kBadArgument, {"--shell"});
  }
}

TEST_F(FitVerb, KnowsItsStrategies) {
  const nlohmann::json mcmc =
      ExpectJson(Fit("mcmc.ply", {"--strategy", "mcmc", "--max-gaussians", "230"}))["gaussians"];
  EXPECT_EQ(mcmc["out"], 230);
  EXPECT_EQ(mcmc["added"], 30);
  EXPECT_EQ(mcmc["pruned"], 0);
  EXPECT_EQ(ExpectJson(Fit("absgrad.ply", {"--strategy", "absgrad"}))["gaussians"]["added"], 0);
  EXPECT_THAT(ExpectDone(Fit("mip.ply", {"--mip-filter", "--gsplat-checkpoint", folder_ / "mip.pt"})).err,
              AllOf(HasSubstr("mip.pt: a gsplat checkpoint file cannot store the render mode mip")));
  EXPECT_EQ(ExpectJson({"info", folder_ / "mip.ply"})["render_mode"], "mip");
  ExpectRefused(Fit("x.ply", {"--strategy", "best"}), ErrorCode::kBadArgument, {"--strategy"});
}

TEST_F(FitVerb, TheSameSeedMakesTheSameSplat) {
  ExpectDone(Fit("a.ply", {"--seed", "7"}));
  ExpectDone(Fit("b.ply", {"--seed", "7", "--threads", "1"}));
  ExpectDone(Fit("c.ply", {"--seed", "8"}));
  EXPECT_EQ(FileBytes(folder_ / "a.ply"), FileBytes(folder_ / "b.ply"));
  EXPECT_NE(FileBytes(folder_ / "a.ply"), FileBytes(folder_ / "c.ply"));
}

TEST_F(FitVerb, RefusesWhatMakesNoSense) {
  const auto refused = [&](const std::vector<std::string>& words, const std::string& why) {
    ExpectRefused(Fit("x.ply", words, /*few=*/false), ErrorCode::kBadArgument, {why});
  };
  refused({"--steps", "0"}, "--steps");
  refused({"--refine-every", "0"}, "--refine-every");
  refused({"--hold-out", "1"}, "");
  refused({"--init", "points"}, "has no points for --init points");
  refused({"--upscale", "2"}, "--pixel");
  refused({"--init-extent", "0.3"}, "--init random");
  refused({"--init", "random", "--init-extent", "0"}, "--init-extent");
  refused({"--init", "view", "--init-splat", "x.ply"}, "--init");
  refused({"--background", "1"}, "--background");
  ExpectRefused(Fit("x.xyz", {}), ErrorCode::kBadArgument, {"not a format that is written"});
  ExpectRefused(Fit("x.ply", {"--checkpoint", folder_ / "x.ply"}), ErrorCode::kBadArgument, {"is also the output"});
  ExpectRefused(Fit("x.ply", {"--checkpoint", folder_ / "none/state"}), ErrorCode::kNotFound);
  ExpectRefused({"fit", folder_ / "none", "-o", folder_ / "x.ply"}, ErrorCode::kNotFound, {"none"});
  fs::create_directory(folder_ / "empty");
  ExpectRefused({"fit", folder_ / "empty", "-o", folder_ / "x.ply"}, ErrorCode::kNotFound);
  EXPECT_EQ(folder_.Entries(), 2);
}

TEST_F(FitVerb, OverwritesOnlyWhenTold) {
  WriteText(folder_ / "mine.ply", "mine");
  ExpectRefused(Fit("mine.ply", {}), ErrorCode::kExists, {"mine.ply"});
  ExpectRefused(Fit("x.ply", {"--gsplat-checkpoint", folder_ / "mine.ply"}), ErrorCode::kExists, {"mine.ply"});
  EXPECT_EQ(FileBytes(folder_ / "mine.ply"), "mine");
  ExpectDone(Fit("mine.ply", {"-w"}));
  EXPECT_NE(FileBytes(folder_ / "mine.ply"), "mine");
}

}  // namespace
}  // namespace anchorsplat
