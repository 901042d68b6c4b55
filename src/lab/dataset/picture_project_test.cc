#include "dataset/picture_project.h"

#include <gtest/gtest.h>

#include <cmath>

#include "cameras/camera_io.h"
#include "cameras/colmap_writer.h"
#include "core/random.h"
#include "core/run_context.h"
#include "dataset/scene_reader.h"
#include "dataset/small_dataset_for_test.h"
#include "fit/training_views.h"
#include "images/image_io.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

Image RandomImage(int width, int height, int channels, uint64_t seed) {
  Random random(seed);
  Image image(width, height, channels);
  for (float& x : image.pixels) x = static_cast<float>(random.Below(256)) / 255;
  return image;
}

// NeRF-synthetic: transforms_train.json with camera_angle_x, pictures beside it.
void WriteNerfScene(const fs::path& folder, int views, int size) {
  fs::create_directories(folder / "train");
  const CameraSet orbit = *OrbitCameras(views, 4, {0, 0, 0}, PinholeFromFov(size, size, 0.7));
  CameraSet named = orbit;
  for (int i = 0; i < views; ++i) {
    named.cameras[static_cast<size_t>(i)].name = "train/r_" + std::to_string(i);
    ASSERT_TRUE(WritePng(folder / "train" / ("r_" + std::to_string(i) + ".png"),
                         RandomImage(size, size, 4, static_cast<uint64_t>(i)))
                    .ok());
  }
  ASSERT_TRUE(WriteTransforms(folder / "transforms_train.json", named).ok());
}

TEST(PictureProject, AverageKeepsWhatThePictureShows) {
  for (const auto& [width, height] : {std::pair{4, 3}, {5, 2}, {16, 12}, {1, 1}}) {
    const Image image = RandomImage(16, 12, 3, 1);
    const Image small = AreaAveraged(image, width, height);
    for (int c = 0; c < 3; ++c) {
      double before = 0, after = 0;
      for (int64_t i = 0; i < image.plane(); ++i) before += image.channel(c)[i];
      for (int64_t i = 0; i < small.plane(); ++i) after += small.channel(c)[i];
      EXPECT_NEAR(before / static_cast<double>(image.plane()), after / static_cast<double>(small.plane()), 1e-5);
    }
  }
  EXPECT_TRUE(AreaAveraged(RandomImage(7, 5, 3, 2), 7, 5).pixels == RandomImage(7, 5, 3, 2).pixels);
}

TEST(PictureProject, TransparentColoursDoNotBleed) {
  Image image(2, 1, 4);
  image.pixels = {1, 0, 0, 1, 0, 0, 1, 0};  // red and solid beside green and invisible
  const Image small = AreaAveraged(image, 1, 1);
  EXPECT_EQ(small.at(0, 0, 0), 1);
  EXPECT_EQ(small.at(1, 0, 0), 0);
  EXPECT_EQ(small.at(3, 0, 0), 0.5f);
}

TEST(PictureProject, NerfSceneBecomesTheLayout) {
  const TestFolder folder;
  WriteNerfScene(folder / "lego", 5, 32);
  const auto report = WritePictureProject(folder / "lego", folder / "out", {.random_points = 50});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->views, 5);
  EXPECT_EQ(report->low_size, 8);
  EXPECT_EQ(report->high_size, 32);
  EXPECT_EQ(report->points, 50);
  EXPECT_TRUE(FileBytes(folder / "lego/train/r_3.png") == FileBytes(folder / "out/32/images/r_3.png"));
  const auto scene = Scene::Open({"lego", folder / "out"});
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  ASSERT_EQ(scene->low_views().size(), 5u);
  EXPECT_EQ(scene->LowPicture(2)->width, 8);
  EXPECT_EQ(scene->HighPicture(2)->width, 32);
  EXPECT_NEAR(scene->high_views()[0].intrinsics.fx, 4 * scene->low_views()[0].intrinsics.fx, 1e-9);
  const auto source = OpenProject(folder / "lego", {.hold_out = 0});
  for (size_t k = 0; k < 9; ++k) {
    EXPECT_NEAR(scene->high_views()[1].world_to_camera.rotation[k], source->train[1].world_to_camera.rotation[k], 1e-9);
  }
}

TEST(PictureProject, ColmapProjectKeepsItsPoints) {
  const TestFolder folder;
  fs::create_directories(folder / "scan/sparse/0");
  fs::create_directories(folder / "scan/images");
  CameraSet set = *OrbitCameras(3, 4, {0, 0, 0}, {30, 20, 40, 40, 15, 10});
  for (Camera& camera : set.cameras) {
    ASSERT_TRUE(WritePng(folder / "scan/images" / (camera.name + ".png"), RandomImage(30, 20, 3, 1)).ok());
  }
  ASSERT_TRUE(WriteColmapCameras(folder / "scan/sparse/0", set, ColmapForm::kBinary).ok());
  const std::vector<ColmapPoint> points = {{{1, 2, 3}, {10, 20, 30}}, {{0, 0, 0}, {1, 2, 3}}};
  ASSERT_TRUE(WriteColmapPoints(folder / "scan/sparse/0", points, ColmapForm::kBinary).ok());
  const auto report = WritePictureProject(folder / "scan", folder / "out", {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->points, 2);
  EXPECT_EQ(report->low_size, 8);  // 7.5 rounded
  const auto back = ReadColmapPoints(folder / "out/8/sparse/0");
  ASSERT_TRUE(back.ok());
  EXPECT_EQ((*back)[0].color, points[0].color);
}

TEST(PictureProject, IsAnObjectOfADataSet) {
  const TestFolder folder;
  WriteNerfScene(folder / "lego", 9, 24);
  ObjectJob job = SmallJob((folder / "lego").string(), "lego");
  job.settings.downscale = 2;
  job.settings.fit_steps = 5;
  const auto record = BuildObject(job, folder / "set");
  ASSERT_TRUE(record.ok()) << record.error().message;
  EXPECT_EQ(record->low_size, 12);
  EXPECT_TRUE(fs::exists(folder / "set/lego/12/gaussian_splatting/ckpts/ckpt_4_rank0.pt"));
}

TEST(PictureProject, RefusesWhatTheLayoutCannotHold) {
  const TestFolder folder;
  WriteNerfScene(folder / "tiny", 2, 3);
  EXPECT_EQ(WritePictureProject(folder / "tiny", folder / "out", {}).error().code, ErrorCode::kBadArgument);
  WriteNerfScene(folder / "mixed", 2, 16);
  ASSERT_TRUE(WritePng(folder / "mixed/train/r_1.png", RandomImage(20, 20, 3, 1), {.overwrite = true}).ok());
  const auto mixed = WritePictureProject(folder / "mixed", folder / "out", {});
  EXPECT_NE(mixed.error().message.find("different cameras"), std::string::npos);
  EXPECT_FALSE(WritePictureProject(folder / "none", folder / "out", {}).ok());
  const std::atomic<bool> stop = true;
  const RunScope run({.stop = &stop});
  WriteNerfScene(folder / "lego", 2, 16);
  EXPECT_EQ(WritePictureProject(folder / "lego", folder / "out", {}).error().code, ErrorCode::kInterrupted);
}

}  // namespace
}  // namespace anchorsplat
