#include <anchorsplat/anchorsplat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "api/small_splat_for_test.h"
#include "core/source_dir_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

using ::testing::HasSubstr;

std::filesystem::path Biplane() { return SourceDirForTest() / "examples/biplane/input.ply"; }

// A project with `views` pictures of the splat.
void WriteProject(const std::filesystem::path& folder, const SplatView& splat, int views, int side) {
  const auto cameras = OrbitAround(splat, views, side, side);
  std::ofstream json(folder / "transforms.json");
  json.precision(17);
  json << "{\"w\": " << side << ", \"h\": " << side << ", \"frames\": [";
  for (const PinholeCamera& camera : *cameras) {
    ASSERT_TRUE(WritePicture(folder / (camera.name + ".png"), Render(splat, camera)->color).ok());
    // Camera to world, OpenGL axes: the columns of Rᵀ with y and z turned round, and −Rᵀt.
    const auto& r = camera.rotation;
    json << (&camera == cameras->data() ? "" : ",") << "{\"file_path\": \"" << camera.name
         << ".png\", \"fl_x\": " << camera.fx << ", \"fl_y\": " << camera.fy << ", \"cx\": " << camera.cx
         << ", \"cy\": " << camera.cy << ", \"transform_matrix\": [";
    for (size_t a = 0; a < 3; ++a) {
      double center = 0;
      for (size_t b = 0; b < 3; ++b) center -= r[3 * b + a] * camera.translation[b];
      json << "[" << r[a] << "," << -r[3 + a] << "," << -r[6 + a] << "," << center << "],";
    }
    json << "[0,0,0,1]]}";
  }
  json << "]}";
}

TEST(Enhance, FilterAndDefault) {
  const auto splat = ReadSplat(Biplane());
  ASSERT_TRUE(splat.ok()) << splat.failure().message;
  const auto filtered = Enhance(*splat, {.method = "filter", .upscale = 4, .pixel_size = 0.0055});
  ASSERT_TRUE(filtered.ok()) << filtered.failure().message;
  EXPECT_EQ(filtered->method, "filter");
  EXPECT_EQ(filtered->gaussians_out, splat->size());
  EXPECT_EQ(filtered->pixel_size_source, "given");
  EXPECT_FALSE(SameBits(filtered->splat, *splat));
  EXPECT_TRUE(SameBits(filtered->splat.view().means, splat->view().means));
  // Fits with antialiasing have lost less.
  const auto less =
      Enhance(*splat, {.method = "filter", .pixel_size = 0.0055, .rasterization = Rasterization::kAntialiased});
  ASSERT_TRUE(less.ok()) << less.failure().message;
  EXPECT_EQ(less->splat.view().rasterization, Rasterization::kAntialiased);
  EXPECT_GT(less->filter_strength, 0);
  EXPECT_LT(less->filter_strength, filtered->filter_strength);

  std::vector<std::string> said;
  const RunSettings run{.message = [&](MessageLevel, const std::string& sentence) { said.push_back(sentence); }};
  const auto enhanced = Enhance(*splat, {}, run);
  ASSERT_TRUE(enhanced.ok()) << enhanced.failure().message;
  EXPECT_EQ(enhanced->method, "model");
  EXPECT_GT(enhanced->gaussians_out, splat->size());
  EXPECT_EQ(enhanced->splat.size(), enhanced->gaussians_out);
  ASSERT_EQ(enhanced->steps.size(), 1u);
  EXPECT_EQ(enhanced->steps[0].method, "model");
  EXPECT_FALSE(enhanced->steps[0].facts.empty());
  EXPECT_THAT(said, testing::Contains(HasSubstr("looks like a classic 3DGS fit")));

  // The owner may be given away; what comes of it is the same.
  auto given = Enhance(*Splat::CopyOf(*splat));
  ASSERT_TRUE(given.ok());
  EXPECT_TRUE(SameBits(given->splat, enhanced->splat));
}

TEST(Enhance, RefinementTellsWhatItDid) {
  const Splat splat = SmallSplat(60, 0, 3);
  // So that there is something to do.
  EnhanceSettings settings{
      .method = "refine", .upscale = 2, .pixel_size = 0.2, .rasterization = Rasterization::kClassic};
  settings.refine = {{"steps", "3"}, {"poses", "4"}, {"k", "2"}};
  const auto refined = Enhance(splat, settings);
  ASSERT_TRUE(refined.ok()) << refined.failure().message;
  ASSERT_FALSE(refined->steps.empty());
  const auto& facts = refined->steps.back().facts;
  const auto steps = std::find_if(facts.begin(), facts.end(), [](const auto& fact) { return fact.first == "steps"; });
  ASSERT_NE(steps, facts.end());
  EXPECT_EQ(std::get<int64_t>(steps->second), 3);

  settings.refine["no-such-thing"] = "1";
  EXPECT_EQ(Enhance(splat, settings).failure().kind, FailureKind::kBadArgument);
}

// Rows of `splat` from `first` on, as bits.
std::vector<float> MeansFrom(const SplatView& splat, int64_t first) {
  const std::span<const float> means = splat.means;
  return {means.begin() + 3 * first, means.end()};
}

TEST(Enhance, OfARegionOnly) {
  const Splat splat = SmallSplat(300, 1, 4);
  int64_t inside = 0;
  std::vector<float> outside;
  for (int64_t i = 0; i < splat.size(); ++i) {
    const float* p = SplatView(splat).means.data() + 3 * i;
    const bool in = p[2] <= 0;
    inside += in ? 1 : 0;
    if (!in) outside.insert(outside.end(), p, p + 3);
  }
  ASSERT_GT(inside, 0);
  ASSERT_GT(splat.size() - inside, 0);
  EnhanceSettings settings{
      .method = "model", .pixel_size = 0.02, .rasterization = Rasterization::kClassic, .region = {9, 9, 0, -9, -9, -9}};
  const auto made = Enhance(splat, settings);
  ASSERT_TRUE(made.ok()) << made.failure().message;
  EXPECT_EQ(made->kept_outside, splat.size() - inside);
  EXPECT_EQ(MeansFrom(made->splat, made->gaussians_out - *made->kept_outside), outside);

  // The budget is of all that there is, also where it is said among refinement's options.
  settings.max_gaussians = splat.size() + 10;
  const auto bounded = Enhance(splat, settings);
  ASSERT_TRUE(bounded.ok()) << bounded.failure().message;
  EXPECT_LE(bounded->gaussians_out, splat.size() + 10);
  EXPECT_EQ(bounded->kept_outside, splat.size() - inside);

  settings.max_gaussians = 0;
  for (const std::vector<double>& none : {std::vector<double>{0, 0, 0}, {0, 0, 0, -1}, {100, 100, 100, 1}}) {
    settings.region = none;
    const auto refused = Enhance(splat, settings);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.failure().kind, FailureKind::kBadArgument);
    EXPECT_THAT(refused.failure().message, HasSubstr("region"));
  }
  EXPECT_FALSE(Enhance(splat, {.method = "filter", .pixel_size = 0.02})->kept_outside);
}

TEST(Enhance, OneBudgetWhereverItIsSaid) {
  const Splat splat = SmallSplat(300, 1, 4);
  EnhanceSettings settings{.method = "model+refine", .pixel_size = 0.02};
  settings.refine = {{"steps", "2"}, {"poses", "4"}, {"max-gaussians", "320"}};
  const auto made = Enhance(splat, settings);
  ASSERT_TRUE(made.ok()) << made.failure().message;
  EXPECT_LE(made->gaussians_out, 320);
  settings.refine.erase("max-gaussians");
  settings.refine["most-gaussians"] = "320";  // its old name
  const auto old = Enhance(splat, settings);
  ASSERT_TRUE(old.ok()) << old.failure().message;
  EXPECT_TRUE(SameBits(old->splat, made->splat));
}

TEST(Enhance, RefusesWhatItCannotDo) {
  EXPECT_EQ(Enhance(Splat()).failure().kind, FailureKind::kBadArgument);
  const Splat splat = SmallSplat(50, 0, 1);
  EXPECT_EQ(Enhance(splat, {.upscale = 0.5}).failure().kind, FailureKind::kBadArgument);
  EXPECT_EQ(Enhance(splat, {.method = "wishes"}).failure().kind, FailureKind::kBadArgument);
  EXPECT_EQ(Enhance(splat, {.method = "model", .model = "/there/is/no.safetensors"}).failure().kind,
            FailureKind::kNotFound);
  Splat bad = SmallSplat(50, 0, 1);
  for (float& x : bad.means()) x = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(Enhance(bad, {.method = "filter", .pixel_size = 0.01}).failure().kind, FailureKind::kBadFile);
  Splat one = SmallSplat(50, 0, 1);
  one.means()[0] = std::numeric_limits<float>::quiet_NaN();
  const auto rest = Enhance(one, {.method = "filter", .pixel_size = 0.01});
  ASSERT_TRUE(rest.ok()) << rest.failure().message;
  EXPECT_EQ(rest->dropped, 1);
  EXPECT_EQ(rest->splat.size(), 49);
  std::vector<std::string> methods;
  for (const EnhanceMethodName& method : ListEnhanceMethods()) methods.push_back(method.name);
  EXPECT_THAT(methods, testing::IsSupersetOf({"filter", "model", "refine"}));
}

TEST(Render, DrawsWithoutACopy) {
  const Splat splat = SmallSplat(400, 1, 2);
  const auto cameras = OrbitAround(splat, 3, 65, 43);
  ASSERT_TRUE(cameras.ok());
  ASSERT_EQ(cameras->size(), 3u);
  const auto all = RenderViews(splat, *cameras, {.background = {0.2f, 0.4f, 0.6f}, .depth = true}, {.threads = 1});
  ASSERT_TRUE(all.ok()) << all.failure().message;
  const Rendering& first = all->front();
  EXPECT_EQ(first.color.pixels.size(), 3u * 65 * 43);
  EXPECT_EQ(first.alpha.pixels.size(), 65u * 43);
  EXPECT_EQ(first.depth.pixels.size(), 65u * 43);
  EXPECT_GT(first.visible, 300);
  EXPECT_NEAR(first.color.pixels[0], 0.2f, 0.02);  // a corner that next to nothing covers
  EXPECT_GT(first.alpha.pixels[21 * 65 + 32], 0.5f);
  const auto one = Render(splat, (*cameras)[0], {.background = {0.2f, 0.4f, 0.6f}});
  ASSERT_TRUE(one.ok());
  EXPECT_TRUE(SameBits(one->color.pixels, first.color.pixels));  // for any number of threads
  EXPECT_TRUE(one->depth.pixels.empty());

  PinholeCamera blind = (*cameras)[0];
  blind.fx = 0;
  EXPECT_EQ(Render(splat, blind).failure().kind, FailureKind::kBadArgument);
  EXPECT_EQ(OrbitAround(splat, 1, 0, 5).failure().kind, FailureKind::kBadArgument);
  EXPECT_EQ(OrbitAround(splat, 0, 5, 5).failure().kind, FailureKind::kBadArgument);
  EXPECT_EQ(OrbitAround(splat, 1, 5, 5, 180).failure().kind, FailureKind::kBadArgument);
  EXPECT_EQ(ReadCameraFile("/there/is/none.json").failure().kind, FailureKind::kNotFound);
  const std::atomic<bool> stop = true;
  EXPECT_EQ(RenderViews(splat, *cameras, {}, {.stop = &stop}).failure().kind, FailureKind::kStopped);
}

TEST(Compare, MeasuresAndShows) {
  const Splat splat = SmallSplat(300, 0, 4);
  const PinholeCamera camera = OrbitAround(splat, 1, 64, 64)->front();
  const Picture a = Render(splat, camera)->color, b = Render(splat, camera, {.background = {0.1f, 0.1f, 0.1f}})->color;
  EXPECT_TRUE(std::isinf(*Psnr(a, a)));
  EXPECT_NEAR(*Ssim(a, a), 1, 1e-6);
  EXPECT_GT(*Psnr(a, b), 20 - 1e-3);  // at most 0.1 everywhere
  EXPECT_LT(*Ssim(a, b), 1);
  Picture small = a;
  small.pixels.pop_back();
  EXPECT_EQ(Psnr(a, small).failure().kind, FailureKind::kBadArgument);
  EXPECT_EQ(Psnr(Picture(), Picture()).failure().kind, FailureKind::kBadArgument);
  const CaptionedPicture columns[] = {{"before", &a}, {"after", &b}};
  const auto sheet = ComparisonSheet(columns);
  ASSERT_TRUE(sheet.ok()) << sheet.failure().message;
  EXPECT_GT(sheet->width, 2 * 64);
  EXPECT_EQ(ComparisonSheet({}).failure().kind, FailureKind::kBadArgument);

  const TestFolder folder;
  ASSERT_TRUE(WritePicture(folder / "a.png", a).ok());
  EXPECT_EQ(WritePicture(folder / "a.png", a).failure().kind, FailureKind::kExists);
  const auto back = ReadPicture(folder / "a.png");
  ASSERT_TRUE(back.ok());
  EXPECT_GT(*Psnr(a, *back), 45);
}

TEST(Fit, ComesCloserToThePictures) {
  const TestFolder folder;
  WriteProject(folder.path(), SmallSplat(80, 0, 5), 9, 40);
  const auto begun = FitProject(folder.path(), {.steps = 1, .initial_points = 400});
  ASSERT_TRUE(begun.ok()) << begun.failure().message;
  const auto fitted = FitProject(folder.path(), {.steps = 60, .initial_points = 400});
  ASSERT_TRUE(fitted.ok()) << fitted.failure().message;
  EXPECT_EQ(fitted->steps, 60);
  EXPECT_EQ(fitted->gaussians_in, 400);
  EXPECT_EQ(fitted->held_out.views, 2);
  EXPECT_GT(fitted->train.psnr, begun->train.psnr + 1);
  const auto again = FitProject(folder.path(), fitted->splat, {.steps = 1});
  ASSERT_TRUE(again.ok()) << again.failure().message;
  EXPECT_EQ(again->gaussians_in, fitted->splat.size());
  EXPECT_EQ(FitProject(folder.path(), {.steps = 0}).failure().kind, FailureKind::kBadArgument);
  const auto mcmc = FitProject(
      folder.path(), {.steps = 60, .strategy = FitStrategy::kMcmc, .max_gaussians = 420, .initial_points = 400});
  ASSERT_TRUE(mcmc.ok()) << mcmc.failure().message;
  EXPECT_EQ(mcmc->splat.size(), 420);
  EXPECT_TRUE(FitProject(folder.path(), {.steps = 2, .mip_filter = true, .initial_points = 400}).ok());
  EXPECT_TRUE(FitProject(folder.path(), {.steps = 2, .exposure = true, .initial_points = 400}).ok());
  const auto shelled = FitProject(folder.path(), {.steps = 2, .initial_points = 400, .far_shell = 300});
  ASSERT_TRUE(shelled.ok());
  EXPECT_GT(shelled->gaussians_in, 400);
  EXPECT_FALSE(FitProject(folder.path(), {.steps = 2, .initial_points = 400, .far_shell = -1}).ok());
  EXPECT_EQ(FitProject("/there/is/none").failure().kind, FailureKind::kNotFound);
}

TEST(Fit, HasItsModePixelsAndStart) {
  const TestFolder folder;
  WriteProject(folder.path(), SmallSplat(80, 0, 5), 6, 40);
  const FitSettings plain{.steps = 3, .hold_out = 0, .initial_points = 60};
  const auto means_of = [&](const FitSettings& settings) {
    const auto fitted = FitProject(folder.path(), settings);
    EXPECT_TRUE(fitted.ok()) << fitted.failure().message;
    const SplatView view = fitted->splat.view();
    EXPECT_EQ(view.rasterization, settings.rasterization);
    return std::vector<float>(view.means.begin(), view.means.end());
  };
  const std::vector<float> classic = means_of(plain);
  EXPECT_EQ(means_of(plain), classic);
  FitSettings other = plain;
  other.rasterization = Rasterization::kAntialiased;
  EXPECT_NE(means_of(other), classic);
  other = plain;
  other.area_pixels = 4;
  EXPECT_NE(means_of(other), classic);
  other.mip_filter = true;
  EXPECT_EQ(FitProject(folder.path(), other).failure().kind, FailureKind::kBadArgument);
  other = plain;
  other.starting_points = StartingPoints::kRandom;
  const std::vector<float> random = means_of(other);
  EXPECT_NE(random, classic);
  other.initial_extent = 3;
  EXPECT_EQ(means_of(other), random);
  other.initial_extent = 0.3;
  EXPECT_NE(means_of(other), random);
  other.initial_extent = 0;
  EXPECT_EQ(FitProject(folder.path(), other).failure().kind, FailureKind::kBadArgument);
  other = plain;
  other.initial_extent = 0.3;
  EXPECT_THAT(FitProject(folder.path(), other).failure().message, testing::HasSubstr("no effect"));
  other.initial_extent.reset();
  other.starting_points = StartingPoints::kProject;
  EXPECT_THAT(FitProject(folder.path(), other).failure().message, testing::HasSubstr("no points to start from"));
}

// A name given for the state of a fit by mistake costs nothing.
TEST(Fit, TakesNoForeignFileForItsState) {
  const TestFolder folder;
  WriteProject(folder.path(), SmallSplat(80, 0, 5), 6, 40);
  const auto scan = folder / "scan.ply";
  ASSERT_TRUE(WriteSplat(scan, SmallSplat(20, 0, 1)).ok());
  const auto size = std::filesystem::file_size(scan);
  std::atomic<bool> stop = true;
  const auto fitted =
      FitProject(folder.path(), {.steps = 2, .initial_points = 50, .checkpoint = scan}, {.stop = &stop});
  ASSERT_FALSE(fitted.ok());
  EXPECT_EQ(fitted.failure().kind, FailureKind::kExists);
  EXPECT_EQ(std::filesystem::file_size(scan), size);
}

// One is stopped half-way, the other one is not, and each hears of itself only.
TEST(RunSettings, TwoLongCallsSideBySide) {
  const TestFolder folder;
  WriteProject(folder.path(), SmallSplat(80, 0, 5), 6, 40);
  const FitSettings settings{.steps = 80, .hold_out = 0, .initial_points = 300};
  const auto alone = FitProject(folder.path(), settings, {.threads = 2});
  ASSERT_TRUE(alone.ok()) << alone.failure().message;

  std::atomic<bool> stop = false;
  int64_t heard_of_stopped = 0, heard_of_whole = 0;
  FitOutcome stopped, whole;
  std::thread first([&] {
    const RunSettings run{.threads = 1,
                          .progress =
                              [&](const TaskProgress& progress) {
                                if (progress.task == "fit")
                                  heard_of_stopped = std::max(heard_of_stopped, progress.done);
                                if (progress.done >= 20) stop = true;
                              },
                          .stop = &stop};
    stopped = *FitProject(folder.path(), settings, run);
  });
  std::thread second([&] {
    const RunSettings run{.threads = 1, .progress = [&](const TaskProgress& progress) {
                            if (progress.task == "fit") heard_of_whole = std::max(heard_of_whole, progress.done);
                          }};
    whole = *FitProject(folder.path(), settings, run);
  });
  first.join();
  second.join();
  EXPECT_TRUE(stopped.stopped);
  EXPECT_LT(stopped.steps, 80);
  EXPECT_EQ(heard_of_stopped, 20);
  EXPECT_FALSE(whole.stopped);
  EXPECT_EQ(heard_of_whole, 80);
  EXPECT_TRUE(SameBits(whole.splat, alone->splat));  // neither threads nor neighbours change a bit
}

TEST(RunSettings, TheDeviceIsThereBeforeTheWorkBegins) {
  const Splat splat = SmallSplat(50, 0, 1);
  const auto cameras = OrbitAround(splat, 1, 16, 16);
  ASSERT_TRUE(cameras.ok());
  const auto rendered = [&](const std::string& device) {
    return RenderViews(splat, *cameras, {}, {.device = device, .max_gpu_memory = 500'000'000});
  };
  const auto wrong = rendered("tpu");
  ASSERT_FALSE(wrong.ok());
  EXPECT_EQ(wrong.failure().kind, FailureKind::kBadArgument);
  EXPECT_THAT(wrong.failure().message, testing::HasSubstr("'tpu' is not cpu, gpu, auto or the number"));
  const auto none = rendered("1000");
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.failure().kind, FailureKind::kNotFound);
  EXPECT_TRUE(rendered("cpu").ok());
  EXPECT_TRUE(rendered("auto").ok());
}

TEST(RunSettings, AnAbandonedCallHasNoResult) {
  const std::atomic<bool> abandon{true};
  const auto splat = ReadSplat(Biplane());
  ASSERT_TRUE(splat.ok()) << splat.failure().message;
  const RunSettings run{.abandon = &abandon};
  const auto enhanced = Enhance(*splat, {.method = "filter", .pixel_size = 0.005}, run);
  ASSERT_FALSE(enhanced.ok());
  EXPECT_EQ(enhanced.failure().kind, FailureKind::kStopped);
  EXPECT_EQ(ReadSplat(Biplane(), run).failure().kind, FailureKind::kStopped);
}

TEST(Library, SaysItsVersion) { EXPECT_THAT(LibraryVersion(), testing::MatchesRegex("[0-9]+\\.[0-9]+\\.[0-9]+")); }

}  // namespace
}  // namespace anchorsplat
