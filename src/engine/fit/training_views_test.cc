#include "fit/training_views.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>

#include "cameras/camera_io.h"
#include "core/messages_for_test.h"
#include "core/text.h"
#include "fit/fit.h"
#include "fit/initial_cloud.h"
#include "fit/orbit_scene_for_test.h"
#include "fit/picture_cache.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

void Put(const fs::path& path, const std::string& bytes) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << bytes;
}

// A COLMAP project in text form with `views` views of 8×6 pixels on the x axis, names in falling order.
void WriteColmap(const fs::path& project, int views, const std::string& model = "sparse/0") {
  Put(project / model / "cameras.txt", "1 PINHOLE 8 6 10 11 4 3\n");
  std::string images;
  for (int i = views; i-- > 0;) {
    const std::string name = "v" + std::to_string(10 + i) + ".png";
    images += std::to_string(i + 1) + " 1 0 0 0 " + std::to_string(-i) + " 0 0 1 " + name + "\n\n";
    fs::create_directories(project / "images");
    ASSERT_TRUE(WritePng(project / "images" / name, Image(8, 6, 3)).ok());
  }
  Put(project / model / "images.txt", images);
}

TEST(TrainingViews, ColmapProject) {
  const TestFolder folder;
  WriteColmap(folder.path(), 10);
  Put(folder / "sparse/0/points3D.txt", "1 0.5 1 2 255 0 0 0.1\n2 3 4 5 0 0 0 0.1\n");
  for (const fs::path& path : {folder.path(), folder / "sparse/0", folder / "sparse/0/images.txt"}) {
    const auto views = OpenProject(path);
    ASSERT_TRUE(views.ok()) << views.error().message;
    ASSERT_EQ(views->train.size(), 8u);
    ASSERT_EQ(views->held_out.size(), 2u);
    EXPECT_EQ(views->held_out[0].name, "v10");
    EXPECT_EQ(views->held_out[1].name, "v18");
    EXPECT_EQ(views->train[0].name, "v11");
    EXPECT_EQ(views->train[0].intrinsics.width, 8);
    EXPECT_EQ(views->points.size(), 2);
    EXPECT_NEAR(views->scene_scale, 1.1 * 4.5, 1e-12) << "of all views, held out or not";
  }
  EXPECT_EQ(OpenProject(folder.path(), {.hold_out = 0})->train.size(), 10u);
  EXPECT_EQ(OpenProject(folder.path(), {.hold_out = 1}).error().code, ErrorCode::kBadArgument);
  Put(folder / "sparse/0/points3D.txt", "1 0.5 1\n");
  EXPECT_EQ(OpenProject(folder.path()).error().code, ErrorCode::kBadFile);
  fs::remove(folder / "sparse/0/points3D.txt");
  EXPECT_EQ(OpenProject(folder.path())->points.size(), 0);
}

// The same project where the world's coordinates are those of a map.
TEST(TrainingViews, MapsBeginAtAnOrigin) {
  const TestFolder folder;
  WriteColmap(folder.path(), 10);
  std::string images;
  for (int i = 0; i < 10; ++i) {
    images += Cat(i + 1, " 1 0 0 0 ", -(500000 + i), " -4500000 -120 1 v", 10 + i, ".png\n\n");
  }
  Put(folder / "sparse/0/images.txt", images);
  Put(folder / "sparse/0/points3D.txt", "1 500000.125 4500001.25 122 255 0 0 0.1\n");
  const auto views = OpenProject(folder.path());
  ASSERT_TRUE(views.ok()) << views.error().message;
  EXPECT_EQ(views->origin, (WorldOrigin{500000, 4500000, 100}));
  EXPECT_EQ(views->points.positions, (Buffer<float>{0.125f, 1.25f, 22}));
  EXPECT_NEAR(views->scene_scale, 1.1 * 4.5, 1e-6);
  EXPECT_NEAR(views->train[0].Center()[0], 1, 1e-6);
  EXPECT_NEAR(views->held_out[0].Center()[2], 20, 1e-6);
  // Of a splat that is there already.
  const auto beside = OpenProject(folder.path(), {.origin = WorldOrigin{500000, 0, 0}});
  ASSERT_TRUE(beside.ok());
  EXPECT_EQ(beside->points.positions, (Buffer<float>{0.125f, 4500001.0f, 122}));
}

// In nerfstudio's frame points are where its cameras saw them.
TEST(TrainingViews, PointsMoveWithTheCameras) {
  const TestFolder folder;
  WriteColmap(folder.path(), 3);
  Put(folder / "sparse/0/points3D.txt", "1 0.5 1 2 255 0 0 0.1\n2 3 4 5 0 0 0 0.1\n");
  const auto still = OpenProject(folder.path(), {.hold_out = 0});
  ASSERT_TRUE(still.ok()) << still.error().message;
  Put(folder / "dataparser_transforms.json",
      R"({"transform": [[0, 1, 0, 0.5], [1, 0, 0, -2], [0, 0, -1, 3]], "scale": 0.5})");
  for (const fs::path& path : {folder.path(), folder / "sparse/0"}) {
    const auto moved = OpenProject(path, {.hold_out = 0});
    ASSERT_TRUE(moved.ok()) << moved.error().message;
    EXPECT_NEAR(moved->scene_scale, 0.5 * still->scene_scale, 1e-12);
    ASSERT_EQ(moved->points.size(), 2);
    EXPECT_NEAR(moved->points.positions[0], 0.5 * (1 + 0.5), 1e-6);
    EXPECT_NEAR(moved->points.positions[1], 0.5 * (0.5 - 2), 1e-6);
    EXPECT_NEAR(moved->points.positions[2], 0.5 * (3 - 2), 1e-6);
    const auto before = still->train[1].ToCamera({3, 4, 5});
    const float* const p = moved->points.positions.data() + 3;
    const auto after = moved->train[1].ToCamera({p[0], p[1], p[2]});
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(after[k], 0.5 * before[k], 1e-6);
  }
}

TEST(TrainingViews, MissingPicturesAreNamed) {
  const TestFolder folder;
  WriteColmap(folder.path(), 4);
  fs::remove(folder / "images/v11.png");
  Messages messages;
  ASSERT_TRUE(OpenProject(folder.path()).ok());
  ASSERT_EQ(messages.warnings().size(), 1u);
  EXPECT_NE(
      messages.warnings()[0].find("1 of 4 views have no picture and are skipped: v11; the first was expected at " +
                                  (folder / "images/v11.png").string()),
      std::string::npos)
      << messages.warnings()[0];
  fs::remove_all(folder / "images");
  const auto none = OpenProject(folder.path());
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::kNotFound);
  EXPECT_NE(none.error().message.find((folder / "images/v13.png").string()), std::string::npos) << none.error().message;
}

TEST(TrainingViews, LensMaskPointsAndDownscale) {
  const TestFolder folder;
  WriteColmap(folder.path(), 4);
  fs::remove(folder / "sparse/0/cameras.txt");
  Put(folder / "sparse/0/cameras.txt", "1 OPENCV 8 6 10 11 4 3 -0.1 0.01 0 0\n");
  Image mask(8, 6, 1);
  std::fill(mask.pixels.begin(), mask.pixels.end(), 0.0f);
  std::fill(mask.pixels.begin(), mask.pixels.begin() + 16, 1.0f);  // the two upper rows are shown
  fs::create_directories(folder / "masks");
  ASSERT_TRUE(WritePng(folder / "masks/v11.png.png", mask).ok());
  Put(folder / "sparse/0/points3D.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
      "1 2 3 255 0 51\nnan 0 0 0 0 0\n4 5 6 0 255 0\n");
  const auto views = OpenProject(folder.path(), {.hold_out = 0});
  ASSERT_TRUE(views.ok()) << views.error().message;
  EXPECT_EQ(views->points.size(), 2);
  EXPECT_NEAR(views->points.colors[2], 0.2, 1e-6);
  const Pinhole& k = views->train[0].intrinsics;
  EXPECT_EQ(k.fx, 10);
  PictureCache cache(views->train, {0, 0, 0});
  Image picture;
  Buffer<uint8_t> ignored;
  ASSERT_TRUE(cache.Load(0, picture, ignored).ok());
  EXPECT_EQ(picture.width, k.width);
  EXPECT_TRUE(ignored.empty());
  for (int round = 0; round < 2; ++round) {  // made, and kept
    ASSERT_TRUE(cache.Load(1, picture, ignored).ok());
    ASSERT_EQ(ignored.size(), static_cast<size_t>(k.width * k.height));
    EXPECT_EQ(ignored.front(), 0);
    EXPECT_EQ(ignored.back(), 1);
  }
  const auto half = OpenProject(folder.path(), {.hold_out = 0, .downscale = 2});
  ASSERT_TRUE(half.ok()) << half.error().message;
  EXPECT_EQ(half->train[0].intrinsics, (Pinhole{k.width / 2, k.height / 2, k.fx / 2, k.fy / 2, k.cx / 2, k.cy / 2}));
  Put(folder / "sparse/0/points3D.ply", "ply\n");
  EXPECT_TRUE(OpenProject(folder.path()).ok() == false);
}

TEST(TrainingViews, SmallestResolutionOfADataset) {
  const TestFolder folder;
  WriteColmap(folder / "scene/1024", 3, "");
  WriteColmap(folder / "scene/256", 4);
  fs::create_directories(folder / "scene/64");
  fs::create_directories(folder / "scene/notes");
  const auto views = OpenProject(folder / "scene");
  ASSERT_TRUE(views.ok()) << views.error().message;
  EXPECT_EQ(views->train.size() + views->held_out.size(), 4u);
  EXPECT_EQ(OpenProject(folder / "scene/1024")->train.size(), 2u);
  EXPECT_FALSE(views->background);
  // Beside each resolution there is what its COLMAP model cannot say.
  Put(folder / "scene/transforms_256.json",
      R"({"fl_x": 10, "fl_y": 10, "cx": 4, "cy": 3, "w": 8, "h": 6, "background": [1, 0.5, 1], "frames": [{
      "file_path": "256/images/v10.png", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]})");
  constexpr std::array<float, 3> kSaid = {1, 0.5f, 1};
  for (const char* project : {"scene", "scene/256", "scene/256/"}) {
    const auto with = OpenProject(folder / project);
    ASSERT_TRUE(with.ok()) << with.error().message;
    EXPECT_EQ(with->background, kSaid) << project;
  }
  EXPECT_FALSE(OpenProject(folder / "scene/1024")->background);
  EXPECT_EQ(OpenProject(folder / "scene/64").error().code, ErrorCode::kNotFound);
}

TEST(TrainingViews, NerfSyntheticHasItsOwnTestViews) {
  const TestFolder folder;
  orbit_scene::Write(folder.path(), orbit_scene::Ball(5, 1), 9, 12);
  fs::rename(folder / "transforms.json", folder / "transforms_train.json");
  auto views = OpenProject(folder.path());
  ASSERT_TRUE(views.ok()) << views.error().message;
  EXPECT_EQ(views->train.size(), 7u) << "no test views: every eighth is held out";
  EXPECT_NEAR(views->scene_scale, 1.1 * 1.7, 0.1);
  fs::copy(folder / "transforms_train.json", folder / "transforms_test.json");
  fs::copy(folder / "transforms_train.json", folder / "transforms_val.json");
  views = OpenProject(folder.path());
  EXPECT_EQ(views->train.size(), 9u);
  EXPECT_EQ(views->held_out.size(), 9u);
  fs::copy(folder / "transforms_train.json", folder / "transforms.json");
  const Messages messages;
  views = OpenProject(folder.path());
  EXPECT_EQ(views->train.size(), 9u);
  ASSERT_EQ(messages.warnings().size(), 1u);
  for (const char* said : {"using ", "transforms_train.json", "pass one of", "/transforms.json"}) {
    EXPECT_NE(messages.warnings()[0].find(said), std::string::npos) << messages.warnings()[0];
  }
}

TEST(TrainingViews, UnclearPicturesAreAnErrorOfWhoNeedsThem) {
  const TestFolder folder;
  orbit_scene::Write(folder.path(), orbit_scene::Ball(5, 1), 9, 12);
  const fs::path images = ReadCameras(folder / "transforms.json")->cameras[0].image.parent_path();
  fs::create_directories(folder / "left");
  for (const auto& entry : fs::directory_iterator(images)) {
    if (entry.path().extension() == ".png") fs::rename(entry.path(), folder / "left" / entry.path().filename());
  }
  fs::copy(folder / "left", folder / "right");
  const auto cameras = ReadCameras(folder / "transforms.json");
  ASSERT_TRUE(cameras.ok()) << cameras.error().message;
  EXPECT_TRUE(cameras->cameras[0].image.empty());
  const auto views = OpenProject(folder.path());
  ASSERT_FALSE(views.ok());
  EXPECT_EQ(views.error().code, ErrorCode::kBadArgument);
  EXPECT_NE(views.error().message.find("may be in"), std::string::npos) << views.error().message;
}

TEST(TrainingViews, PicturesOfAnotherSize) {
  const TestFolder folder;
  WriteColmap(folder.path(), 3);
  const fs::path picture = folder / "images/v11.png";
  ASSERT_TRUE(WritePng(picture, Image(4, 3, 3), {.overwrite = true}).ok());
  const auto views = OpenProject(folder.path());
  ASSERT_TRUE(views.ok()) << views.error().message;
  const Pinhole k = views->train[0].intrinsics;
  EXPECT_EQ(k.width, 4);
  EXPECT_EQ(k.height, 3);
  EXPECT_EQ(k.fx, 5);
  EXPECT_EQ(k.cy, 1.5);
  ASSERT_TRUE(WritePng(picture, Image(6, 8, 3), {.overwrite = true}).ok());
  EXPECT_EQ(OpenProject(folder.path()).error().code, ErrorCode::kBadFile);
  EXPECT_NE(OpenProject(folder.path()).error().message.find("v11.png"), std::string::npos);
  fs::remove(picture);
  EXPECT_EQ(OpenProject(folder.path())->train.size(), 1u) << "views without a picture are left out";
  fs::remove_all(folder / "images");
  EXPECT_EQ(OpenProject(folder.path()).error().code, ErrorCode::kNotFound);
}

TEST(TrainingViews, SceneScaleOfOnePlaceIsOne) {
  Camera camera;
  EXPECT_EQ(SceneScale({camera, camera}), 1);
}

TEST(TrainingViews, MasksThatLeaveNothing) {
  const TestFolder folder;
  orbit_scene::Write(folder.path(), orbit_scene::Ball(20, 1), 6, 24);
  TrainingViews views = OpenProject(folder.path(), {.hold_out = 3}).value();
  Image mask(24, 24, 1);
  std::fill(mask.pixels.begin(), mask.pixels.end(), 0.0f);
  ASSERT_TRUE(WritePng(folder / "black.png", mask).ok());
  views.train.front().photograph.mask = folder / "black.png";
  FitOptions options = FitOptionsFor(20, FitPreset::kDefault);
  const GaussianCloud initial =
      InitialCloud(RandomPointsInView(30, views.train, views.scene_scale, 1), views.scene_scale, StartOptions(options))
          .value();
  const Messages messages;
  const auto fitted = Fit(views, initial, options);
  ASSERT_TRUE(fitted.ok()) << fitted.error().message;
  EXPECT_EQ(fitted->report.train.views, std::ssize(views.train) - 1);
  EXPECT_TRUE(std::isfinite(fitted->report.train.psnr));
  ASSERT_EQ(messages.warnings().size(), 1u);
  EXPECT_NE(messages.warnings()[0].find("masks hide every pixel of 1 of"), std::string::npos) << messages.warnings()[0];
  for (Camera& camera : views.train) camera.photograph.mask = folder / "black.png";
  const auto nothing = Fit(views, initial, options);
  ASSERT_FALSE(nothing.ok());
  EXPECT_NE(nothing.error().message.find("black.png"), std::string::npos) << nothing.error().message;
}

}  // namespace
}  // namespace anchorsplat
