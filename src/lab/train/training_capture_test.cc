#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "core/file_system.h"
#include "dataset/small_capture_for_test.h"
#include "io/folder_for_test.h"
#include "train/trainer.h"
#include "train/training_object.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TrainingCapture SmallCapture(const TestFolder& folder) {
  return {{"ball", folder / "captures/ball"}, {.hold_out = 3, .steps = 8}, folder / "fit"};
}

TEST(TrainingCapture, TrainsOnPhotographsThatTheFitHasNotSeen) {
  const TestFolder folder;
  WriteSmallCapture(folder / "captures/ball");
  const auto opened = OpenTrainingCapture(SmallCapture(folder));
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  const TrainingObject& object = **opened;
  EXPECT_THAT(object.training, ElementsAre(0, 3, 6));
  EXPECT_EQ(object.upscale, 4);
  EXPECT_EQ(object.pixel_sizes.size(), static_cast<size_t>(object.cloud.size()));
  EXPECT_EQ(object.views[3].intrinsics.width, 64);
  EXPECT_EQ(object.low_views[3].intrinsics.width, 16);
  const PixelBox window = {10, 5, 42, 33};
  const Image photograph = Crop(*ReadImage(folder / "captures/ball/images/003.png"), window);
  const TrueView truth = *object.truth->LoadWindow(3, window);
  EXPECT_EQ(truth.picture.pixels, photograph.pixels);
  EXPECT_TRUE(truth.ignored.empty());
  EXPECT_EQ(truth.object, (PixelBox{0, 0, 32, 28})) << "a photograph counts as a whole";
  EXPECT_EQ(Crop(object.truth->Load(3)->picture, window).pixels, photograph.pixels);
}

TEST(TrainingCapture, KnowsWhatAMaskHides) {
  const TestFolder folder;
  WriteSmallCapture(folder / "captures/ball");
  Image mask(66, 51, 3);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < 51; ++y) {
      for (int x = 0; x < 66; ++x) mask.at(c, y, x) = x < 20 ? 0 : 1;
    }
  }
  fs::create_directories(folder / "captures/ball/masks");
  ASSERT_TRUE(WritePng(folder / "captures/ball/masks/003.png.png", mask).ok());
  const auto object = OpenTrainingCapture(SmallCapture(folder));
  ASSERT_TRUE(object.ok()) << object.error().message;
  const TrueView truth = *(*object)->truth->LoadWindow(3, {10, 5, 42, 33});
  ASSERT_EQ(truth.ignored.size(), 32u * 28u);
  for (size_t i = 0; i < truth.ignored.size(); ++i) EXPECT_EQ(truth.ignored[i] != 0, i % 32 < 10);
  EXPECT_TRUE((*object)->truth->LoadWindow(6, {10, 5, 42, 33})->ignored.empty());
}

TEST(TrainingCapture, NeedsViewsThatAreHeldOut) {
  const TestFolder folder;
  WriteSmallCapture(folder / "captures/ball");
  TrainingCapture capture = SmallCapture(folder);
  capture.recipe.hold_out = 0;
  const auto object = OpenTrainingCapture(capture);
  ASSERT_FALSE(object.ok());
  EXPECT_THAT(object.error().message, HasSubstr("no view is held out"));
}

TEST(TrainingCapture, ATrainingMayHaveNothingElse) {
  const TestFolder folder;
  WriteSmallCapture(folder / "captures/ball");
  const fs::path config = folder / "small.toml";
  std::ofstream(config) << R"(
log_every = 1
[network]
kind = "compact"
copies = 2
hidden = 16
head_hidden = 16
[data]
views_per_step = 2
crop = 48
part = 100
[captures]
hold_out = 3
fit_steps = [8, 12]
)";
  TrainRequest request;
  request.captures = folder / "captures";
  request.config = config;
  request.out = folder / "run";
  request.steps = 3;
  const auto report = Train(request);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->objects, 2);
  EXPECT_EQ(report->steps, 3);
  EXPECT_EQ(report->skipped, 0);
  std::ifstream file(report->file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), {});
  EXPECT_THAT(bytes, HasSubstr("capture 2"));
  EXPECT_EQ(bytes.find("ball"), std::string::npos) << "a network does not tell whose photographs it has seen";
}

}  // namespace
}  // namespace anchorsplat
