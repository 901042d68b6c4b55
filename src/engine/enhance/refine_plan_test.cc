#include "enhance/refine_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>

#include "core/random.h"
#include "core/splat_comments.h"
#include "enhance/enhance.h"
#include "enhance/refinement_for_test.h"
#include "fit/orbit_scene_for_test.h"
#include "fit/pixel_model.h"
#include "formats/random_cloud_for_test.h"

namespace anchorsplat {
namespace {

// What a network knows more than the splat would be lost to what the splat shows.
TEST_F(Refinement, OfANetworksResultIsGentle) {
  options_ = {};
  input_.start_has_detail = true;
  auto refined = Refine(input_, options_, {});
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  EXPECT_EQ(refined->report.steps, 100);
  EXPECT_EQ(refined->report.copies, 1);
  EXPECT_EQ(std::ssize(refined->cloud.means), std::ssize(input_.start.means));
  options_.steps = 100;
  options_.copies = 1;
  options_.rate = 0.1;
  input_.start_has_detail = false;
  ExpectSameCloud(Refine(input_, options_, {})->cloud, refined->cloud);
  // What is said counts.
  input_.start_has_detail = true;
  options_.steps = 3;
  options_.copies = 2;
  refined = Refine(input_, options_, {});
  EXPECT_EQ(refined->report.steps, 3);
  EXPECT_EQ(refined->report.copies, 2);
  EXPECT_EQ(refined->report.plan.gaussians, 2 * input_.start.size());
  // With pictures there is more to learn.
  options_ = {};
  options_.images = project();
  options_.hold_out = 4;
  options_.steps = 1;
  EXPECT_EQ(Refine(input_, options_, {})->report.copies, 8);
}

// A fit has seen what it agrees with as well as with the rest. Views that it does not agree with it has not.
TEST_F(Refinement, HoldsOutWhatTheSplatHasNotSeen) {
  options_.hold_out.reset();
  options_.steps = 2;
  EXPECT_EQ(Refine(input_, options_, {})->report.views, 12);
  options_.hold_out = 8;
  EXPECT_EQ(Refine(input_, options_, {})->report.views, 10);
  options_.hold_out.reset();
  for (const size_t held_out : {size_t{0}, size_t{8}}) {  // every eighth, by name
    const std::filesystem::path path = project() / (cameras_.cameras[held_out].name + ".png");
    auto picture = ReadImage(path);
    ASSERT_TRUE(picture.ok());
    for (float& x : picture->pixels) x = 0.8f * x + 0.05f;
    ASSERT_TRUE(WritePng(path, *picture, {.overwrite = true}).ok());
  }
  EXPECT_EQ(Refine(input_, options_, {})->report.views, 10);
}

// 20,000 Gaussians in pictures of 28² pixels, which are 84² when seen closer.
TEST_F(Refinement, SplitsNothingThatNoPixelWouldShow) {
  input_.cloud = orbit_scene::Ball(20'000, 1);
  input_.start = input_.cloud;
  for (float& s : input_.start.log_scales) s += 0.3f;
  options_.images.clear();
  options_.copies.reset();
  options_.steps = 1;
  auto refined = Refine(input_, options_, {});
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  EXPECT_EQ(refined->report.copies, 1);
  options_.copies = 3;
  EXPECT_EQ(Refine(input_, options_, {})->report.copies, 3) << "what is said counts";
}

TEST_F(Refinement, WhatIsRightAlreadyStays) {
  options_.images.clear();
  options_.steps = 10;
  options_.rate = 50;  // does harm
  const auto refined = Refine(input_, options_, {});
  ASSERT_TRUE(refined.ok());
  EXPECT_TRUE(refined->report.kept_start);
  ExpectSameCloud(refined->cloud, input_.start);
}

// What is right when seen closer comes back unharmed: as a fit to the areas of pixels makes it, as Mip-Splatting makes
// it, and one of Gaussians that are wide anyway. 0.05 dB is the most that any of them may lose.
TEST_F(Refinement, WhatIsFineAlreadyIsNotHarmed) {
  EnhanceOptions options;
  options.upscale = kUpscale;
  options.refine = options_;
  options.refine.copies.reset();
  options.method = "refine";
  const auto worse_by = [&](const GaussianCloud& fine, const GaussianCloud& enhanced) {
    truth_ = fine;
    const double psnr = PsnrCloser(enhanced);  // infinite when nothing has changed
    return 10 * std::log10(1 + std::pow(10, (kGoodFit - psnr) / 10));
  };
  GaussianCloud area = truth_, wide = truth_, mip = truth_;
  area.comments = {PixelAreaComment(kUpscale)};
  for (float& s : wide.log_scales) s = std::max(s, static_cast<float>(std::log(6 * kPixel)));
  mip.render_mode = RenderMode::kMip;
  for (const GaussianCloud& fine : {area, wide, mip}) {
    const bool left_alone = !fine.comments.empty();
    options.refine.images.clear();
    options.cameras = cameras_;
    options.mode = fine.render_mode.value_or(RenderMode::kClassic);
    auto enhanced = Enhance(fine, options);
    ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
    EXPECT_LT(worse_by(fine, enhanced->cloud), 0.05) << "without pictures";
    enhanced->cloud.render_mode = fine.render_mode;
    if (left_alone) ExpectSameCloud(enhanced->cloud, fine);
  }
  // With the pictures it was fitted to.
  options.refine.images = project();
  options.cameras.reset();
  const GaussianCloud truth = truth_;
  const auto enhanced = Enhance(area, options);
  ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
  EXPECT_LT(worse_by(truth, enhanced->cloud), 0.05);
}

// A splat that was trained on larger pictures agrees with the smaller ones when seen closer, and better than with any
// width given to it. A little better is no reason to forget what they do not show.
TEST_F(Refinement, WhatKnowsMoreThanThePicturesStays) {
  Random random(4);
  input_.cloud = truth_;
  for (float& v : input_.cloud.means) v += static_cast<float>(0.01 * kPixel * random.Normal());
  input_.start = input_.cloud;
  for (float& s : input_.start.log_scales) s += 0.1f;  // as a filter would
  options_.rate = 0.2;
  const auto kept = Refine(input_, options_, {});
  ASSERT_TRUE(kept.ok()) << kept.error().message;
  EXPECT_TRUE(kept->report.kept_start);
  EXPECT_TRUE(kept->report.plan.from_input);
  EXPECT_EQ(kept->report.plan.least_gain, 2);
  EXPECT_FALSE(kept->report.plan.why.empty());
  ExpectSameCloud(kept->cloud, input_.cloud);
  // A bad one has more to learn than to forget.
  for (float& v : input_.cloud.means) v += static_cast<float>(0.3 * kPixel * random.Normal());
  input_.start = input_.cloud;
  for (float& s : input_.start.log_scales) s += 0.3f;
  options_.rate = 1;
  const auto refined = Refine(input_, options_, {});
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  EXPECT_FALSE(refined->report.kept_start);
  EXPECT_GT(refined->report.after, refined->report.before + 2);
}

// Where it begins with the splat as it is, the budget holds from the beginning, too.
TEST_F(Refinement, BeginsWithinItsBudgetWithTheSplatAsItIs) {
  input_.cloud = truth_;
  input_.start = truth_;
  for (float& s : input_.start.log_scales) s += 0.5f;  // the pictures agree better with the splat as it is
  options_.steps = 5;
  for (const int64_t most : {input_.cloud.size() - 10, input_.cloud.size() - 1}) {
    for (const int copies : {1, 4}) {
      options_.copies = copies;
      options_.max_gaussians = most;
      const auto refined = Refine(input_, options_, {});
      ASSERT_TRUE(refined.ok()) << refined.error().message;
      EXPECT_TRUE(refined->report.plan.from_input);
      EXPECT_LE(refined->cloud.size(), most);
    }
  }
}

// What the pictures' alpha is laid over: what is asked, else what the splat says of its training.
TEST_F(Refinement, KnowsTheBackgroundOfTraining) {
  CameraSet cameras = orbit_scene::Cameras(12, kSide, kSide);
  Rasterizer rasterizer;
  RenderOutput rays;
  Image seen;
  const std::array<float, 3> white = {1, 1, 1};
  for (const Camera& camera : cameras.cameras) {
    ASSERT_TRUE(rasterizer.Render(truth_, RaysOf(AreaModel(kUpscale), camera), {.background = white}, rays).ok());
    AverageRays(rays.color, kUpscale, seen);
    std::filesystem::remove(project() / (camera.name + ".png"));
    ASSERT_TRUE(WritePng(project() / (camera.name + ".png"), seen).ok());
  }
  options_.steps = 2;
  EXPECT_FALSE(Refine(input_, options_, {}).ok()) << "over black these are pictures of something else";
  options_.background = white;
  const auto asked = Refine(input_, options_, {});
  ASSERT_TRUE(asked.ok()) << asked.error().message;
  options_.background.reset();
  input_.cloud.comments.push_back(BackgroundComment(white));
  const auto known = Refine(input_, options_, {});
  ASSERT_TRUE(known.ok()) << known.error().message;
  EXPECT_EQ(known->report.before, asked->report.before);
}

}  // namespace
}  // namespace anchorsplat
