#include "enhance/refine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <filesystem>

#include "core/log.h"
#include "core/parallel.h"
#include "core/run_context.h"
#include "enhance/enhance.h"
#include "enhance/filter.h"
#include "enhance/refine_pictures.h"
#include "fit/orbit_scene_for_test.h"
#include "fit/pixel_model.h"
#include "fit/training_views.h"
#include "formats/random_cloud_for_test.h"
#include "images/image_io.h"
#include "io/flip_bit_for_test.h"
#include "io/folder_for_test.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;

constexpr int kSide = 28, kUpscale = 3;
constexpr double kGoodFit = 40;                              // dB that a splat that is fine comes to the truth
constexpr double kPixel = 1.7 / (0.5 * kSide / 0.41421356);  // at the middle of the scene

// A splat that is right when seen three times closer; a project with what a camera sees of it; and what a fit makes of
// those pictures: eroded, a little wrong.
class Refinement : public testing::Test {
 protected:
  void SetUp() override {
    log_ = SetLogSink(MakeTerminalSink(true));
    truth_ = orbit_scene::Ball(150, 1);
    for (float& s : truth_.log_scales) s -= 0.7f;
    cameras_ = orbit_scene::Cameras(12, kSide, kSide);
    std::filesystem::create_directories(project() / "views");
    Rasterizer rasterizer;
    RenderOutput rays;
    Image seen;
    for (const Camera& camera : cameras_.cameras) {
      ASSERT_TRUE(rasterizer.Render(truth_, RaysOf(AreaModel(kUpscale), camera), {}, rays).ok());
      AverageRays(rays.color, kUpscale, seen);
      ASSERT_TRUE(WritePng(project() / (camera.name + ".png"), seen).ok());
    }
    ASSERT_TRUE(WriteTransforms(project() / "transforms.json", cameras_).ok());

    input_.cloud = truth_;
    Random random(4);
    const double eroded = 0.3 * kPixel * kPixel;
    for (size_t i = 0; i < input_.cloud.means.size(); ++i) {
      input_.cloud.means[i] += static_cast<float>(0.15 * kPixel * random.Normal());
      float& s = input_.cloud.log_scales[i];
      const double square = std::exp(2.0 * s) - 0.7 * eroded;
      s = static_cast<float>(0.5 * std::log(std::max(square, 0.1 * eroded)));
    }
    input_.upscale = kUpscale;
    input_.pixel_size = kPixel;
    input_.start = input_.cloud;
    ASSERT_TRUE(
        ApplyFilter(input_.start, std::vector<float>{static_cast<float>(kPixel)}, {.upscale = kUpscale, .strength = {}})
            .ok());
    options_.images = project();
    options_.hold_out = 4;
    options_.steps = 90;
    options_.copies = 1;
  }
  void TearDown() override { SetLogSink(log_); }

  std::filesystem::path project() const { return folder_ / "project"; }

  // How far from the truth a cloud is when seen closer, from where nobody was.
  double PsnrCloser(const GaussianCloud& cloud) const {
    Rasterizer rasterizer;
    RenderOutput a, b;
    double sum = 0;
    for (const Camera& camera : orbit_scene::Cameras(5, kSide * kUpscale, kSide * kUpscale).cameras) {
      EXPECT_TRUE(rasterizer.Render(cloud, camera, {}, a).ok());
      EXPECT_TRUE(rasterizer.Render(truth_, camera, {}, b).ok());
      sum += Psnr(a.color, b.color).value() / 5;
    }
    return sum;
  }

  std::shared_ptr<LogSink> log_;
  TestFolder folder_;
  GaussianCloud truth_;
  CameraSet cameras_;
  RefineInput input_;
  RefineOptions options_;
};

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

TEST_F(Refinement, MoreGaussiansHaveABound) {
  options_.steps = 20;
  const GaussianCloud one = Refine(input_, options_, {})->cloud;
  options_.copies = 5;
  options_.max_gaussians = 299;  // no room for two each
  ExpectSameCloud(Refine(input_, options_, {})->cloud, one);
}

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
  // With pictures there is more to learn.
  options_ = {};
  options_.images = project();
  options_.hold_out = 4;
  options_.steps = 1;
  EXPECT_EQ(Refine(input_, options_, {})->report.copies, 8);
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

TEST_F(Refinement, GoesOnWhereItWasStopped) {
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
  EXPECT_TRUE(std::filesystem::exists(control.checkpoint)) << "its owner removes it, once the result is safe";

  // The same counts are not the same run.
  RefineInput other = input_;
  other.cloud.sh[0] += 0.01f;
  EXPECT_THAT(Refine(other, options_, control).error().message, HasSubstr("its input is"));
  other = input_;
  other.start.log_scales[0] += 0.01f;
  EXPECT_THAT(Refine(other, options_, control).error().message, HasSubstr("its start is"));

  // Nor are other pictures of the same names, or one bit of the state.
  const auto picture = project() / (cameras_.cameras[2].name + ".png"), aside = folder_ / "aside.png";
  std::filesystem::copy_file(picture, aside);
  Image changed = ReadImage(picture).value();
  changed.pixels[0] = changed.pixels[0] > 0.5f ? 0.0f : 1.0f;
  ASSERT_TRUE(WritePng(picture, changed, {.overwrite = true}).ok());
  EXPECT_THAT(Refine(input_, options_, control).error().message, HasSubstr("its set of pictures is another"));
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

TEST_F(Refinement, WhatIsRightAlreadyStays) {
  options_.images.clear();
  options_.steps = 10;
  options_.rate = 50;  // does harm
  const auto refined = Refine(input_, options_, {});
  ASSERT_TRUE(refined.ok());
  EXPECT_TRUE(refined->report.kept_start);
  ExpectSameCloud(refined->cloud, input_.start);
}

// Whatever is wrong with the pictures is said before the first step.
TEST_F(Refinement, BadPicturesAreRefusedAtOnce) {
  options_.steps = 1;
  const auto message = [&] {
    const auto refined = Refine(input_, options_, {});
    return refined.ok() ? std::string() : refined.error().message;
  };
  const auto replace = [&](const auto& change) {
    for (const Camera& camera : cameras_.cameras) {
      const auto path = project() / (camera.name + ".png");
      const Image picture = ReadImage(path).value();
      ASSERT_TRUE(WritePng(path, change(picture), {.overwrite = true}).ok());
    }
  };
  // One picture too few: the camera without one is named.
  const auto first = project() / (cameras_.cameras[3].name + ".png");
  std::filesystem::rename(first, folder_ / "elsewhere.png");
  EXPECT_THAT(message(), testing::AllOf(HasSubstr("1 of its 12 cameras"), HasSubstr(cameras_.cameras[3].name)));
  std::filesystem::rename(folder_ / "elsewhere.png", first);
  // Another shape.
  const Image whole = ReadImage(first).value();
  ASSERT_TRUE(WritePng(first, Image(kSide, kSide / 2, 3), {.overwrite = true}).ok());
  EXPECT_THAT(message(), testing::AllOf(HasSubstr("28x14"), HasSubstr("28x28")));
  ASSERT_TRUE(WritePng(first, whole, {.overwrite = true}).ok());
  // Larger than those that it was fitted to, of the same shape.
  replace([](const Image& picture) {
    Image large;
    SpreadToRays(picture, {0, 0, picture.width, picture.height}, 4, large);
    for (float& x : large.pixels) x *= 16;
    return large;
  });
  EXPECT_THAT(message(), HasSubstr("at 1/4 of their size"));
  replace([](const Image&) {
    Image black(kSide, kSide, 3);
    std::fill(black.pixels.begin(), black.pixels.end(), 0.0f);
    return black;
  });
  EXPECT_FALSE(message().empty());
  // Of a dark splat on black ground, even black pictures are not far off.
  GaussianCloud dark = input_.cloud;
  for (size_t i = 0; i < dark.sh.size(); ++i) dark.sh[i] = 0.3f * dark.sh[i] - 1.2f;
  input_.cloud = dark;
  EXPECT_THAT(message(), HasSubstr("9 of 9 pictures are as near to a picture of one colour"));
}

TEST_F(Refinement, PicturesOfSomethingElseAreRefused) {
  const auto message = [&] {
    const auto refined = Refine(input_, options_, {});
    return refined.ok() ? std::string() : refined.error().message;
  };
  // Another order.
  CameraSet turned = cameras_;
  for (size_t i = 0; i < turned.cameras.size(); ++i) {
    turned.cameras[i].world_to_camera = cameras_.cameras[(i + 1) % cameras_.cameras.size()].world_to_camera;
  }
  ASSERT_TRUE(WriteTransforms(project() / "transforms.json", turned, {.overwrite = true}).ok());
  EXPECT_THAT(message(), HasSubstr("order"));
  // Another splat.
  input_.cloud = orbit_scene::Ball(400, 99);
  for (float& c : input_.cloud.sh) c += 2;
  EXPECT_THAT(message(), HasSubstr("dB only"));
  options_.images = folder_ / "nothing";
  EXPECT_FALSE(message().empty());
}

TEST_F(Refinement, CamerasThatAreNotQuiteThoseOfTheFitAreRefused) {
  const auto message = [&](const CameraSet& cameras) {
    EXPECT_TRUE(WriteTransforms(project() / "transforms.json", cameras, {.overwrite = true}).ok());
    const auto refined = Refine(input_, options_, {});
    return refined.ok() ? std::string() : refined.error().message;
  };
  options_.steps = 1;
  EXPECT_EQ(message(cameras_), "");
  CameraSet moved = cameras_;
  for (Camera& camera : moved.cameras) camera.intrinsics.cx += 1.2;
  EXPECT_THAT(message(moved), HasSubstr("enlarged by a pixel"));
  moved = cameras_;
  for (Camera& camera : moved.cameras) camera.intrinsics.fx = camera.intrinsics.fy *= 1.08;
  EXPECT_THAT(message(moved), HasSubstr("enlarged by a pixel"));
}

TEST_F(Refinement, SaysWhichPicturesStandOut) {
  const auto agreement = [&] {
    const auto views = OpenProject(project(), {.hold_out = 0});
    PictureCache pictures(views->train, {0, 0, 0});
    return MeasureAgreement(input_.cloud, {}, pictures).value();
  };
  EXPECT_TRUE(agreement().far_below.empty());
  EXPECT_EQ(agreement().mismatched, 0);
  const auto name = [&](size_t i) { return project() / (cameras_.cameras[i].name + ".png"); };
  std::filesystem::rename(name(3), folder_ / "kept.png");
  std::filesystem::copy_file(name(7), name(3));
  EXPECT_EQ(agreement().far_below.size(), 1u);
  EXPECT_EQ(agreement().mismatched, 1);
  EXPECT_TRUE(CheckAgreement(agreement(), kLeastInputPsnr).ok()) << "a warning";
  for (const size_t i : {0u, 1u, 4u}) {
    std::filesystem::copy_file(name(7), name(i), std::filesystem::copy_options::overwrite_existing);
  }
  EXPECT_FALSE(CheckAgreement(agreement(), kLeastInputPsnr).ok());
}

TEST_F(Refinement, PhotographsMayDifferInExposure) {
  Random random(8);
  for (const Camera& camera : cameras_.cameras) {
    const auto path = project() / (camera.name + ".png");
    Image picture = ReadImage(path).value();
    const auto gain = static_cast<float>(random.Uniform(0.7, 1.0));
    for (float& x : picture.pixels) x *= gain;
    ASSERT_TRUE(WritePng(path, picture, {.overwrite = true}).ok());
  }
  const auto plain = Refine(input_, options_, {});
  options_.exposure = true;
  options_.robust = true;
  const auto exposed = Refine(input_, options_, {});
  ASSERT_TRUE(plain.ok() && exposed.ok());
  EXPECT_GT(PsnrCloser(exposed->cloud), PsnrCloser(plain->cloud) + 1);
  options_.images.clear();
  EXPECT_FALSE(Refine(input_, options_, {}).ok());
}

TEST_F(Refinement, ThroughTheDoor) {
  EnhanceOptions options;
  options.pixel_size = kPixel;
  options.upscale = kUpscale;
  options.refine = options_;
  options.refine.steps = 5;
  options.method = "auto";
  EXPECT_EQ(Enhance(input_.cloud, options)->report.method, "refine-images") << "there are pictures";
  options.pixel_size.reset();
  const EnhanceReport from_pictures = Enhance(input_.cloud, options)->report;
  EXPECT_EQ(from_pictures.pixel_size_source, "pictures");
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
  ExpectSameCloud(Enhance(input_.cloud, options)->cloud, input_.cloud);
  options.upscale = 4;
  GaussianCloud antialiased = input_.cloud;
  antialiased.render_mode = RenderMode::kAntialiased;
  ExpectSameCloud(Enhance(antialiased, options)->cloud, antialiased);
  options.method = "filter+refine";
  ExpectSameCloud(Enhance(antialiased, options)->cloud, antialiased);
}

// What is right when seen closer comes back unharmed: as a fit to the areas of pixels makes it, as an antialiased one
// makes it, and one of Gaussians that are wide anyway. 0.05 dB is the most that any of them may lose.
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
  GaussianCloud area = truth_, wide = truth_, antialiased = truth_;
  area.comments = {PixelAreaComment(kUpscale)};
  for (float& s : wide.log_scales) s = std::max(s, static_cast<float>(std::log(6 * kPixel)));
  antialiased.render_mode = RenderMode::kAntialiased;
  for (const GaussianCloud& fine : {area, wide, antialiased}) {
    const bool untold = fine.comments.empty() && !fine.render_mode;
    options.refine.images.clear();
    options.cameras = cameras_;
    auto enhanced = Enhance(fine, options);
    ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
    EXPECT_LT(worse_by(fine, enhanced->cloud), 0.05) << "without pictures";
    if (!untold) ExpectSameCloud(enhanced->cloud, fine);
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

}  // namespace
}  // namespace anchorsplat
