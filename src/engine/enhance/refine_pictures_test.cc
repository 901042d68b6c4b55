#include "enhance/refine_pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>

#include "cameras/camera_io.h"
#include "core/log.h"
#include "core/messages_for_test.h"
#include "enhance/enhance.h"
#include "enhance/refinement_for_test.h"
#include "fit/orbit_scene_for_test.h"
#include "fit/training_views.h"
#include "fit/view_pose.h"
#include "images/image_io.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;

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
  EXPECT_THAT(message(), HasSubstr("9 of 9 pictures match a single colour"));
}

// Pictures larger than those it was fitted to: they give its pixel size, and their own detail.
TEST_F(Refinement, LargerPicturesAreRefinedAgainstAsTheyAre) {
  EnhanceOptions options;
  options.mode = RenderMode::kClassic;
  options.upscale = kUpscale;
  options.method = "filter+refine-images";
  options.refine = options_;
  const auto of_small = Enhance(input_.cloud, options);
  ASSERT_TRUE(of_small.ok()) << of_small.error().message;
  EXPECT_FALSE(of_small->report.train_width);
  Rasterizer rasterizer;
  RenderOutput large;
  for (Camera camera : cameras_.cameras) {
    camera.intrinsics = Scaled(camera.intrinsics, 4);
    ASSERT_TRUE(rasterizer.Render(truth_, camera, {}, large).ok());
    ASSERT_TRUE(WritePng(project() / (camera.name + ".png"), large.color, {.overwrite = true}).ok());
  }
  const Messages messages;
  const auto of_large = Enhance(input_.cloud, options);
  ASSERT_TRUE(of_large.ok()) << of_large.error().message;
  EXPECT_EQ(of_large->report.pixel_size_source, PixelSizeSource::kPictures);
  EXPECT_EQ(of_large->report.train_width, kSide);
  EXPECT_NEAR(of_large->report.pixel_size, of_small->report.pixel_size, 1e-6);
  EXPECT_THAT(messages.notes(), testing::Contains(HasSubstr("pictures at 1/4 of this size")));
  EXPECT_GT(PsnrCloser(of_large->cloud), PsnrCloser(of_small->cloud) + 0.5);

  // Also where the pictures only stand beside the cameras.
  options.mode.reset();
  options.method = "filter";
  options.refine = {};
  const auto cameras = ReadCameras(project() / "transforms.json");
  ASSERT_TRUE(cameras.ok());
  options.cameras = *cameras;
  for (Camera& camera : options.cameras->cameras) camera.intrinsics = Scaled(camera.intrinsics, 4);
  const auto beside = Enhance(input_.cloud, options);
  ASSERT_TRUE(beside.ok()) << beside.error().message;
  EXPECT_EQ(beside->report.train_width, kSide);
  EXPECT_THAT(messages.notes(), testing::Contains(HasSubstr("fitted to pictures 28 pixels wide, not 112")));
  // Whatever the mode, and with a picture that cannot be read.
  options.mode = RenderMode::kClassic;
  std::filesystem::resize_file(project() / (cameras_.cameras[0].name + ".png"), 0);
  EXPECT_EQ(Enhance(input_.cloud, options)->report.train_width, kSide);
  // Those of something else tell nothing.
  for (const Camera& camera : cameras_.cameras) {
    Image black(4 * kSide, 4 * kSide, 3);
    std::fill(black.pixels.begin(), black.pixels.end(), 0.0f);
    ASSERT_TRUE(WritePng(project() / (camera.name + ".png"), black, {.overwrite = true}).ok());
  }
  EXPECT_FALSE(Enhance(input_.cloud, options)->report.train_width);
  EXPECT_THAT(messages.notes(), testing::Contains(HasSubstr("match the splat at no size")));
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

TEST_F(Refinement, PosesOfPhotographsMayBeALittleOff) {
  CameraSet said = cameras_;
  Random random(9);
  for (Camera& camera : said.cameras) {
    const double pixel = 1 / camera.intrinsics.fx;
    camera = Moved(camera, {random.Uniform(-1, 1) * pixel, random.Uniform(-1, 1) * pixel, 0, 0, 0, 0});
  }
  ASSERT_TRUE(WriteTransforms(project() / "transforms.json", said, {.overwrite = true}).ok());
  const auto plain = Refine(input_, options_, {});
  EXPECT_THAT(plain.error().message, testing::HasSubstr("--align")) << "it says what would help";
  options_.align = true;
  const auto aligned = Refine(input_, options_, {});
  ASSERT_TRUE(aligned.ok()) << aligned.error().message;
  // It agrees with them as well as if they had been right, but for a little.
  ASSERT_TRUE(WriteTransforms(project() / "transforms.json", cameras_, {.overwrite = true}).ok());
  options_.align = false;
  const auto right = Refine(input_, options_, {});
  ASSERT_TRUE(right.ok());
  EXPECT_GT(PsnrCloser(aligned->cloud), PsnrCloser(input_.start) + 1);
  EXPECT_GT(aligned->report.after, right->report.after - 2) << "the verdict looks where the pictures were taken";
  options_.align = true;
  options_.images.clear();
  EXPECT_FALSE(Refine(input_, options_, {}).ok());
}

}  // namespace
}  // namespace anchorsplat
