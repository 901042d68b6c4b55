#include "enhance/enlarged_targets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>

#include "core/parallel.h"
#include "core/random.h"
#include "enhance/enhance.h"
#include "enhance/refinement_for_test.h"
#include "formats/random_cloud_for_test.h"
#include "upscale/small_upscaler_for_test.h"

namespace anchorsplat {
namespace {

constexpr PixelBox kWhole = {0, 0, 40, 30};

// Three views of a ball, and the same `factor` times larger by a network that repeats pixels.
struct BallViews {
  std::shared_ptr<const GaussianCloud> ball = std::make_shared<const GaussianCloud>(orbit_scene::Ball(60, 2));
  std::vector<Camera> cameras = orbit_scene::Cameras(3, kWhole.x1, kWhole.y1).cameras;

  RefineTargets Low() const { return {ball, {}, cameras}; }
  EnlargedTargets Enlarged(int factor) const {
    return {Low(), std::make_shared<Upscaler>(OpenedForTest(RepeatingForTest())), factor, ball, {}};
  }
};

double MeanDifference(const Image& a, const Image& b) {
  double sum = 0;
  for (size_t i = 0; i < a.pixels.size(); ++i) sum += std::abs(double{a.pixels[i]} - double{b.pixels[i]});
  return sum / static_cast<double>(a.pixels.size());
}

TEST(ProjectBack, BringsAveragesNearerToTheLowPicture) {
  Random random(5);
  Image low(9, 7, 3), enlarged(27, 21, 3), averages;
  for (float& value : low.pixels) value = static_cast<float>(0.3 + 0.4 * random.Uniform());
  for (float& value : enlarged.pixels) value = static_cast<float>(0.3 + 0.4 * random.Uniform());
  AverageRays(enlarged, 3, averages);
  const double before = MeanDifference(averages, low);
  ASSERT_TRUE(ProjectBack(low, enlarged).ok());
  AverageRays(enlarged, 3, averages);
  EXPECT_LT(MeanDifference(averages, low), before / 3);
  for (const float value : enlarged.pixels) EXPECT_TRUE(value >= 0 && value <= 1);
}

TEST(EnlargedTargets, AreTheViewsAtTheirOwnResolution) {
  const BallViews views;
  RefineTargets low = views.Low();
  RefineTarget expected, target;
  ASSERT_TRUE(low.Load(1, kWhole, expected).ok());
  for (const int factor : {1, 2, 3, 4, 5}) {
    EnlargedTargets enlarged = views.Enlarged(factor);
    ASSERT_EQ(enlarged.views().size(), 3u);
    ASSERT_TRUE(enlarged.Load(1, {0, 0, kWhole.x1 * factor, kWhole.y1 * factor}, target).ok());
    ASSERT_EQ(target.picture.width, enlarged.views()[1].intrinsics.width);
    Image averages;
    AverageRays(target.picture, factor, averages);
    EXPECT_LT(MeanDifference(averages, expected.picture), 0.01) << factor;
  }
}

TEST(EnlargedTargets, WindowsArePartsOfTheView) {
  const BallViews views;
  EnlargedTargets enlarged = views.Enlarged(2);
  RefineTarget whole, part;
  ASSERT_TRUE(enlarged.Load(2, {0, 0, 80, 60}, whole).ok());
  ASSERT_TRUE(enlarged.Load(2, {13, 6, 70, 45}, part).ok());
  ASSERT_EQ(part.picture.width, 57);
  ASSERT_EQ(part.ignored.size(), whole.ignored.empty() ? 0u : 57u * 39u);
  for (int y = 0; y < 39; ++y) {
    for (int x = 0; x < 57; ++x) ASSERT_EQ(part.picture.at(1, y, x), whole.picture.at(1, y + 6, x + 13));
  }
}

// A view for which there is no room is enlarged around the window that is asked for.
TEST(EnlargedTargets, LargeViewsGiveTheSameWindows) {
  BallViews views;
  views.cameras.assign(1, orbit_scene::Cameras(3, 17000, 17000).cameras[0]);
  const Camera camera = views.cameras[0];
  const PixelBox window = {8400, 8400, 8480, 8440};
  EnlargedTargets large = views.Enlarged(2);
  RefineTarget there, here;
  const PixelBox doubled = {2 * window.x0, 2 * window.y0, 2 * window.x1, 2 * window.y1};
  ASSERT_TRUE(large.Load(0, doubled, there).ok());
  // The same part as a view of its own, with more around it.
  const PixelBox around = {window.x0 - 40, window.y0 - 40, window.x1 + 40, window.y1 + 40};
  views.cameras[0] = Crop(camera, around);
  EnlargedTargets cut = views.Enlarged(2);
  ASSERT_TRUE(cut.Load(0, {80, 80, 240, 160}, here).ok());
  EXPECT_LT(MeanDifference(there.picture, here.picture), 0.005);
}

TEST(EnlargedTargets, WithoutANetworkAreTheSplatsOwnViewProjectedBack) {
  const BallViews views;
  RefineTarget low, target;
  RefineTargets own = views.Low();
  ASSERT_TRUE(own.Load(1, kWhole, low).ok());
  EnlargedTargets enlarged(views.Low(), nullptr, 3, views.ball, {});
  ASSERT_TRUE(enlarged.Load(1, {0, 0, 3 * kWhole.x1, 3 * kWhole.y1}, target).ok());
  Rasterizer rasterizer;
  RenderOutput output;
  ASSERT_TRUE(rasterizer.Render(*views.ball, RaysOf(PixelModel{3}, views.cameras[1]), {}, output).ok());
  Clamp01(output.color);
  ASSERT_TRUE(ProjectBack(low.picture, output.color).ok());
  EXPECT_LT(MeanDifference(output.color, target.picture), 0.003) << "rounded to bytes";
}

TEST(CheckFactor, NamesWhatANetworkCannot) {
  for (const auto& [factor, scale] : {std::pair(1, 4), std::pair(2, 4), std::pair(4, 4), std::pair(6, 4)}) {
    EXPECT_TRUE(CheckFactor(factor, scale).ok()) << factor;
  }
  EXPECT_FALSE(CheckFactor(3, 4).ok());
  EXPECT_FALSE(CheckFactor(0, 4).ok());
  EXPECT_FALSE(CheckFactor(kMostSamples + 1, 4).ok());
}

class Detail : public Refinement {
 protected:
  void SetUp() override {
    Refinement::SetUp();
    options_.images.clear();
    options_.hold_out.reset();
    options_.steps = 30;
    options_.enlarged = true;
    options_.enlarge_with = folder_ / "network.safetensors";
    ASSERT_TRUE(RepeatingForTest().Write(options_.enlarge_with).ok());
    input_.cameras = cameras_;
  }
};

TEST_F(Detail, ComesNearerToTheEnlargedViews) {
  const auto refined = Refine(input_, options_, {});
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  EXPECT_FALSE(refined->report.kept_start);
  EXPECT_GT(refined->report.after, refined->report.before + 0.5);
  EXPECT_EQ(refined->cloud.size(), input_.cloud.size()) << "nothing is split";
}

TEST_F(Detail, TakesPicturesInPlaceOfTheSplatsOwn) {
  options_.images = project();
  const auto refined = Refine(input_, options_, {});
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  EXPECT_GT(refined->report.after, refined->report.before);
  EXPECT_TRUE(refined->report.input_psnr.has_value());
}

TEST_F(Detail, SameBitsForAnyNumberOfThreads) {
  options_.steps = 8;
  GaussianCloud expected;
  for (const int threads : {1, 3}) {
    SetThreadCount(threads);
    const auto refined = Refine(input_, options_, {});
    ASSERT_TRUE(refined.ok());
    if (threads == 1) expected = refined->cloud;
    ExpectSameCloud(refined->cloud, expected);
  }
  SetThreadCount(0);
}

TEST_F(Detail, GoesOnWithTheSameNetworkOnly) {
  RefineControl control;
  control.checkpoint = folder_ / "run.checkpoint";
  control.checkpoint_every = 5;
  options_.steps = 8;
  ASSERT_TRUE(Refine(input_, options_, control).ok());
  control.resume = true;
  const auto same = Refine(input_, options_, control);
  ASSERT_TRUE(same.ok()) << same.error().message;
  EXPECT_EQ(same->report.resumed_at, 5);
  options_.enlarge_with = folder_ / "other.safetensors";
  SmallUpscaler other = RepeatingForTest();
  other.metadata["source"] = "another test";
  ASSERT_TRUE(other.Write(options_.enlarge_with).ok());
  const auto refused = Refine(input_, options_, control);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, testing::HasSubstr("network that enlarges differs"));
  options_.enlarge_with.clear();
  EXPECT_FALSE(Refine(input_, options_, control).ok());
}

TEST_F(Detail, SaysThatItIsInvented) {
  EnhanceOptions options;
  options.method = "detail";
  options.cameras = cameras_;
  options.upscale = kUpscale;
  options.refine = options_;
  options.filter_strength = 0;  // there is no width to give back, and yet something to do
  const auto enhanced = Enhance(input_.cloud, options);
  ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
  EXPECT_TRUE(IsInvented(enhanced->report));
  ASSERT_FALSE(enhanced->cloud.comments.empty());
  EXPECT_TRUE(enhanced->cloud.comments.back().ends_with("detail, 3 times closer, detail invented"))
      << enhanced->cloud.comments.back();

  options.upscale = 2.5;
  EXPECT_FALSE(Enhance(input_.cloud, options).ok());
  options.upscale = kUpscale;
  options.refine.enlarge_with = folder_ / "none.safetensors";
  EXPECT_EQ(Enhance(input_.cloud, options).error().code, ErrorCode::kNotFound);
}

TEST_F(Detail, InventsNothingWithoutANetwork) {
  options_.enlarge_with.clear();
  const auto refined = Refine(input_, options_, {});
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  EXPECT_GT(refined->report.after, refined->report.before);
  EXPECT_EQ(refined->cloud.size(), input_.cloud.size());

  EnhanceOptions options;
  options.method = "detail";
  options.cameras = cameras_;
  options.upscale = kUpscale;
  options.refine = options_;
  const auto enhanced = Enhance(input_.cloud, options);
  ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
  EXPECT_FALSE(IsInvented(enhanced->report));
  options.filter_strength = 0;
  const auto kept = Enhance(input_.cloud, options);
  ASSERT_TRUE(kept.ok()) << kept.error().message;
  ExpectSameCloud(kept->cloud, input_.cloud);
}

}  // namespace
}  // namespace anchorsplat
