#include "enhance/refine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>

#include "core/parallel.h"
#include "core/run_context.h"
#include "enhance/enhance.h"
#include "enhance/refinement_for_test.h"
#include "formats/random_cloud_for_test.h"
#include "io/flip_bit_for_test.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;

TEST_F(Refinement, WithPicturesComesNearerToTheTruth) {
  const auto refined = Refine(input_, options_, {});
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  const RefineReport& r = refined->report;
  EXPECT_EQ(r.steps, 90);
  EXPECT_EQ(r.views, 9);
  EXPECT_FALSE(r.kept_start);
  EXPECT_FALSE(r.interrupted);
  EXPECT_GT(r.after, r.before + 2);
  EXPECT_GT(PsnrCloser(refined->cloud), PsnrCloser(input_.start) + 2);
  EXPECT_GT(r.input_psnr.value(), kLeastInputPsnr);
}

TEST_F(Refinement, WithoutPicturesComesNearerToTheViewsItSees) {
  options_.images.clear();
  for (const bool cameras : {false, true}) {
    if (cameras) input_.cameras = cameras_;
    const auto refined = Refine(input_, options_, {});
    ASSERT_TRUE(refined.ok()) << refined.error().message;
    EXPECT_FALSE(refined->report.kept_start);
    EXPECT_GT(refined->report.after, refined->report.before + 1);
    EXPECT_FALSE(refined->report.input_psnr.has_value());
    EXPECT_EQ(refined->report.views, cameras ? 10 : 128) << "two of twelve are set apart";
  }
}

// The near plane of a fit would show nothing of this scene, neither before nor after, and so nothing to mend.
TEST_F(Refinement, WorksInAnyUnit) {
  options_.images.clear();
  options_.steps = 30;
  input_.cameras = cameras_;
  const auto expected = Refine(input_, options_, {});
  ASSERT_TRUE(expected.ok()) << expected.error().message;
  constexpr float kUnit = 1e-3f;
  for (GaussianCloud* cloud : {&input_.cloud, &input_.start}) {
    for (float& x : cloud->means) x *= kUnit;
    for (float& x : cloud->log_scales) x += std::log(kUnit);
  }
  for (Camera& camera : input_.cameras->cameras) {
    for (double& x : camera.world_to_camera.translation) x *= double{kUnit};
  }
  input_.pixel_size *= double{kUnit};
  const auto refined = Refine(input_, options_, {});
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  EXPECT_FALSE(refined->report.kept_start);
  EXPECT_NEAR(refined->report.before, expected->report.before, 0.1);
  EXPECT_NEAR(refined->report.after, expected->report.after, 0.3);
}

TEST_F(Refinement, SameBitsForAnyNumberOfThreads) {
  options_.steps = 20;
  GaussianCloud expected;
  for (const int threads : {1, 2, 5}) {
    SetThreadCount(threads);
    const auto refined = Refine(input_, options_, {});
    ASSERT_TRUE(refined.ok());
    if (threads == 1) expected = refined->cloud;
    ExpectSameCloud(refined->cloud, expected);
  }
  SetThreadCount(0);
  input_.seed = 9;
  EXPECT_FALSE(SameBits(Refine(input_, options_, {})->cloud.means, expected.means));
}

// What a killed run leaves: the state of the last multiple of the steps that were asked for.
TEST_F(Refinement, KeepsItsStateWhileItRuns) {
  options_.steps = 7;
  const auto whole = Refine(input_, options_, {});
  ASSERT_TRUE(whole.ok());
  RefineControl control{.checkpoint = folder_ / "state", .checkpoint_every = 3, .outputs = {}};
  const auto first = Refine(input_, options_, control);
  ASSERT_TRUE(first.ok()) << first.error().message;
  ExpectSameCloud(first->cloud, whole->cloud);
  control.resume = true;
  const auto second = Refine(input_, options_, control);
  ASSERT_TRUE(second.ok()) << second.error().message;
  EXPECT_EQ(second->report.resumed_at, 6);
  ExpectSameCloud(second->cloud, whole->cloud);
}

TEST_F(Refinement, GoesOnWhereItWasStopped) {
  options_.align = true;  // more to remember
  input_.start.comments = input_.cloud.comments = {"credit: Ann"};
  const auto whole = Refine(input_, options_, {});
  ASSERT_TRUE(whole.ok());
  std::atomic<bool> stop{true};  // after the first step
  const RunScope run({.stop = &stop});
  RefineControl control{.checkpoint = folder_ / "state", .outputs = {}};
  const auto first = Refine(input_, options_, control);
  ASSERT_TRUE(first.ok());
  EXPECT_TRUE(first->report.interrupted);
  EXPECT_EQ(first->report.steps, 1);
  EXPECT_TRUE(Validate(first->cloud).ok());
  EXPECT_GE(first->report.after, first->report.before) << "valid, and no worse than the start";
  ASSERT_TRUE(std::filesystem::exists(control.checkpoint));
  control.resume = true;
  stop = false;
  RefineOptions others = options_;
  others.rate = 0.3;
  EXPECT_THAT(Refine(input_, others, control).error().message, HasSubstr("its rate is"));
  const auto second = Refine(input_, options_, control);
  ASSERT_TRUE(second.ok()) << second.error().message;
  EXPECT_EQ(second->report.resumed_at, 1);
  ExpectSameCloud(second->cloud, whole->cloud);
  EXPECT_EQ(second->cloud.comments, whole->cloud.comments);
  EXPECT_EQ(second->cloud.comments, input_.start.comments);
  EXPECT_TRUE(std::filesystem::exists(control.checkpoint)) << "its owner removes it, once the result is safe";

  // The same counts are not the same run.
  RefineInput other = input_;
  other.cloud.sh[0] += 0.01f;
  EXPECT_THAT(Refine(other, options_, control).error().message, HasSubstr("its input differs"));
  other = input_;
  other.start.log_scales[0] += 0.01f;
  EXPECT_THAT(Refine(other, options_, control).error().message, HasSubstr("its start differs"));

  // Nor are other pictures of the same names, or one bit of the state.
  const auto picture = project() / (cameras_.cameras[2].name + ".png"), aside = folder_ / "aside.png";
  std::filesystem::copy_file(picture, aside);
  Image changed = ReadImage(picture).value();
  changed.pixels[0] = changed.pixels[0] > 0.5f ? 0.0f : 1.0f;
  ASSERT_TRUE(WritePng(picture, changed, {.overwrite = true}).ok());
  EXPECT_THAT(Refine(input_, options_, control).error().message, HasSubstr("its set of pictures differs"));
  std::filesystem::rename(aside, picture);
  FlipBit(control.checkpoint, 5);
  EXPECT_THAT(Refine(input_, options_, control).error().message, HasSubstr("is damaged"));

  // A state that cannot be written costs the state, not the result.
  stop = true;
  RefineControl nowhere{.checkpoint = folder_ / "no such folder" / "state", .outputs = {}};
  const auto kept = Refine(input_, options_, nowhere);
  ASSERT_TRUE(kept.ok()) << kept.error().message;
  EXPECT_TRUE(kept->report.interrupted);
}

TEST_F(Refinement, TimeCanBeTheBound) {
  options_.steps.reset();
  options_.seconds = 0.2;
  const auto refined = Refine(input_, options_, {});
  ASSERT_TRUE(refined.ok());
  EXPECT_GT(refined->report.steps, 0);
}

TEST_F(Refinement, ThroughTheDoor) {
  EnhanceOptions options;
  options.mode = RenderMode::kClassic;
  options.pixel_size = kPixel;
  options.upscale = kUpscale;
  options.refine = options_;
  options.refine.steps = 5;
  options.method = "auto";
  EXPECT_EQ(Enhance(input_.cloud, options)->report.method, "refine-images") << "there are pictures";
  options.pixel_size.reset();
  const EnhanceReport from_pictures = Enhance(input_.cloud, options)->report;
  EXPECT_EQ(from_pictures.pixel_size_source, PixelSizeSource::kPictures);
  EXPECT_NEAR(from_pictures.pixel_size, kPixel, 0.1 * kPixel);
  options.pixel_size = kPixel;
  options.method = "filter+refine";
  EXPECT_EQ(Enhance(input_.cloud, options)->report.method, "filter+refine");
  options.method = "refine+filter";
  EXPECT_FALSE(Enhance(input_.cloud, options).ok());
  options.refine.images.clear();
  options.method = "auto";
  EXPECT_EQ(Enhance(input_.cloud, options)->report.method, "filter");
  options.method = "refine-images";
  EXPECT_FALSE(Enhance(input_.cloud, options).ok());
  options.method = "refine";
  const auto refined = Enhance(input_.cloud, options);
  ASSERT_TRUE(refined.ok()) << refined.error().message;
  EXPECT_EQ(refined->report.method, "refine");
  options.upscale = 1;  // nothing was absorbed that a closer view would miss
  GaussianCloud same = Enhance(input_.cloud, options)->cloud;
  EXPECT_EQ(std::exchange(same.render_mode, std::nullopt), RenderMode::kClassic);
  ExpectSameCloud(same, input_.cloud);
  options.upscale = 4;
  const GaussianCloud& antialiased = input_.cloud;
  options.mode = RenderMode::kAntialiased;
  options.method = "filter";
  const GaussianCloud filtered = Enhance(antialiased, options)->cloud;
  for (const char* method : {"refine", "filter+refine"}) {
    options.method = method;
    GaussianCloud left = Enhance(antialiased, options)->cloud;
    left.comments = filtered.comments;  // which have the method's name
    ExpectSameCloud(left, filtered);
  }
}

}  // namespace
}  // namespace anchorsplat
