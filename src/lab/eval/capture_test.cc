#include "eval/capture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "core/text.h"
#include "dataset/small_capture_for_test.h"
#include "eval/evaluation.h"
#include "fit/orbit_scene_for_test.h"
#include "fit/picture_cache.h"
#include "formats/cloud_io.h"
#include "io/folder_for_test.h"
#include "metrics/image_metrics.h"
#include "render/rasterizer.h"
#include "render/shown_range.h"
#include "upscale/small_upscaler_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr CaptureRecipe kQuick = {.steps = 8};

Result<BenchmarkObject> Open(const TestFolder& folder, const CaptureRecipe& recipe = kQuick) {
  const auto entries = ListCaptures(folder / "captures");
  if (!entries.ok()) return entries.error();
  return OpenCapturedObject(entries->front(), recipe, folder / "fit");
}

TEST(Capture, BecomesAnObject) {
  const TestFolder folder;
  WriteSmallCapture(folder / "captures" / "ball");
  const auto entries = ListCaptures(folder / "captures");
  ASSERT_TRUE(entries.ok());
  ASSERT_EQ(entries->size(), 1u);
  EXPECT_EQ(entries->front().name, "ball");
  EXPECT_EQ(ListCaptures(folder / "captures" / "ball")->front().name, "ball") << "it is one itself";

  const auto object = Open(folder);
  ASSERT_TRUE(object.ok()) << object.error().message;
  EXPECT_EQ(object->upscale(), 4);
  EXPECT_THAT(object->held_out, ElementsAre(0, 8));
  EXPECT_EQ(object->low_cameras.cameras.size(), 7u);
  EXPECT_EQ(object->low_cameras.cameras[0].name, "001");
  EXPECT_EQ(object->LowCamera(3).intrinsics.width, 16);
  EXPECT_EQ(object->LowCamera(3).intrinsics.height, 12);
  EXPECT_GT(object->low.size(), 0);
  ASSERT_EQ(object->views.size(), 9u);
  // What four leaves over is gone, and nothing moved.
  EXPECT_EQ(object->views[8].intrinsics.width, 64);
  EXPECT_EQ(object->views[8].intrinsics.height, 48);
  const Image whole = *ReadImage(folder / "captures/ball/images/008.png");
  const ViewPicture truth = *object->Truth(8);
  EXPECT_EQ(truth.image.pixels, Crop(whole, {0, 0, 64, 48}).pixels);
  RenderOutput output;
  Rasterizer rasterizer;
  ASSERT_TRUE(rasterizer.Render(orbit_scene::Ball(150, 3), object->views[8], {}, output).ok());
  Clamp01(output.color);
  EXPECT_GT(*Psnr(output.color, truth.image), 45);
}

TEST(Capture, IsFittedOnce) {
  const TestFolder folder;
  WriteSmallCapture(folder / "captures" / "ball");
  const auto first = Open(folder);
  ASSERT_TRUE(first.ok()) << first.error().message;
  const auto time = fs::last_write_time(first->splat);
  const auto again = Open(folder);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(fs::last_write_time(again->splat), time);
  EXPECT_EQ(again->low.means, first->low.means);
  // Others are other fits.
  const auto longer = Open(folder, {.steps = 9});
  ASSERT_TRUE(longer.ok());
  EXPECT_NE(longer->low.means, first->low.means);
  EXPECT_NE(Open(folder, {.steps = 8, .seed = 1})->low.means, first->low.means);
  EXPECT_EQ(Open(folder)->low.means, first->low.means);
  Image picture = *ReadImage(folder / "captures/ball/images/001.png");
  for (float& value : picture.pixels) value = 1 - value;
  ASSERT_TRUE(WritePng(folder / "captures/ball/images/001.png", picture, {.overwrite = true}).ok());
  EXPECT_NE(Open(folder)->low.means, first->low.means);
}

TEST(Capture, MaskedPixelsDoNotCount) {
  const TestFolder folder;
  const fs::path capture = folder / "captures" / "ball";
  WriteSmallCapture(capture);
  Image mask(66, 51, 3);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < 51; ++y) {
      for (int x = 0; x < 66; ++x) mask.at(c, y, x) = x < 20 ? 0 : 1;
    }
  }
  fs::create_directories(capture / "masks");
  ASSERT_TRUE(WritePng(capture / "masks/000.png.png", mask).ok());
  EvaluationOptions options;
  options.captures = kQuick;
  const auto raw = [&] {
    const auto evaluation = Evaluate(folder / "captures", {*MakeEvalMethod("raw", {})}, folder / "out", options);
    EXPECT_TRUE(evaluation.ok() && evaluation->failures.empty());
    return evaluation->results.at(0).views.at(0).psnr;
  };
  const double before = raw();
  // The same for another picture where the mask is black, and not where it is white.
  Image picture = *ReadImage(capture / "images/000.png");
  const auto paint = [&](int from, int to) {
    for (int y = 0; y < 51; ++y) {
      for (int x = from; x < to; ++x) picture.at(1, y, x) = 1;
    }
    ASSERT_TRUE(WritePng(capture / "images/000.png", picture, {.overwrite = true}).ok());
  };
  paint(0, 20);
  EXPECT_EQ(raw(), before);
  paint(20, 30);
  EXPECT_LT(raw(), before - 1);
}

TEST(Capture, EveryRowIsKeptAsSoonAsItIsMeasured) {
  const TestFolder folder;
  WriteSmallCapture(folder / "captures" / "ball");
  const std::string network = folder / "repeating.safetensors";
  ASSERT_TRUE(RepeatingForTest().Write(network).ok());
  std::vector<EvalMethod> methods;
  for (const std::string& word : {std::string("raw"), std::string("upsample"), network, std::string("auto")}) {
    auto method = MakeEvalMethod(word, {});
    ASSERT_TRUE(method.ok()) << method.error().message;
    methods.push_back(*std::move(method));
  }
  bool kept = false;
  methods.push_back({"last", "", [&](const MethodTask&) -> Result<MethodViews> {
                       kept = fs::exists(folder / "out/objects/ball/auto.json");
                       return Error{ErrorCode::kBadArgument, "not today"};
                     }});
  EvaluationOptions options;
  options.captures = kQuick;
  const auto evaluation = Evaluate(folder / "captures", methods, folder / "out", options);
  ASSERT_TRUE(evaluation.ok()) << evaluation.error().message;
  ASSERT_EQ(evaluation->failures.size(), 1u) << evaluation->failures[0].message;
  EXPECT_EQ(evaluation->failures[0].message, "not today");
  EXPECT_TRUE(kept);
  ASSERT_EQ(evaluation->results.size(), 4u);
  EXPECT_EQ(evaluation->results[0].views.size(), 2u);
  EXPECT_EQ(evaluation->results[2].method, "repeating");

  // Pixels four times as large, by cubic convolution and by a network that repeats them twice.
  const BenchmarkObject object =
      *OpenCapturedObject({"ball", folder / "captures/ball"}, kQuick, folder / "out/objects/ball/fit");
  RenderOutput output;
  Rasterizer rasterizer;
  ASSERT_TRUE(rasterizer.Render(object.low, object.LowCamera(8), DisplayOptions(object.low), output).ok());
  Clamp01(output.color);
  Image repeated(64, 48, 3);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) repeated.at(c, y, x) = output.color.at(c, y / 4, x / 4);
    }
  }
  EXPECT_NEAR(evaluation->Find("ball", "repeating")->views[1].psnr, *Psnr(repeated, object.Truth(8)->image), 1e-3);
  EXPECT_NE(evaluation->Find("ball", "upsample")->MeanPsnr(), evaluation->Find("ball", "repeating")->MeanPsnr());
  EXPECT_EQ(Evaluate(folder / "captures", methods, folder / "out", options)->resumed, 4);
}

// With pictures at a quarter of their size, and nothing but what a user would say.
TEST(Capture, BestSeesTheTrainingPictures) {
  const TestFolder folder;
  WriteSmallCapture(folder / "captures" / "ball");
  std::vector<EnhanceMethod> methods = BasicMethods();
  int calls = 0;
  for (EnhanceMethod& method : methods) {
    if (method.name != "refine-images") continue;
    method.run = [&](EnhanceInput input, const EnhanceOptions& options, StepReport&) -> Result<GaussianCloud> {
      ++calls;
      EXPECT_EQ(options.refine.images, folder / "captures/ball");
      EXPECT_EQ(options.refine.downscale, 4);
      EXPECT_EQ(options.refine.hold_out, 8);
      return std::move(input.cloud);
    };
  }
  const auto best = MakeEvalMethod("best", {.filter_strength = std::nullopt, .enhance_methods = &methods});
  ASSERT_TRUE(best.ok()) << best.error().message;
  EvaluationOptions options;
  options.captures = kQuick;
  const auto evaluation = Evaluate(folder / "captures", {*best}, folder / "out", options);
  ASSERT_TRUE(evaluation.ok() && evaluation->failures.empty());
  EXPECT_EQ(calls, 1);
}

TEST(Capture, NamesWhatIsMissing) {
  const TestFolder folder;
  EXPECT_EQ(ListCaptures(folder / "none").error().code, ErrorCode::kNotFound);
  fs::create_directories(folder / "captures" / "empty");
  const auto object = Open(folder);
  ASSERT_FALSE(object.ok());
  EXPECT_THAT(object.error().message, HasSubstr("empty"));
}

}  // namespace
}  // namespace anchorsplat
