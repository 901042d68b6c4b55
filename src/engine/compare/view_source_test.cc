#include "compare/view_source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include "cameras/camera_io.h"
#include "cameras/undistortion.h"
#include "compare/comparison.h"
#include "core/messages_for_test.h"
#include "core/source_dir_for_test.h"
#include "formats/cloud_io.h"
#include "images/image_io.h"
#include "io/folder_for_test.h"
#include "metrics/image_metrics.h"
#include "render/shown_range.h"

namespace anchorsplat {
namespace {

// A real fit and its cameras, in another unit of length.
TEST(ViewSource, ShowsTheSameInAnyUnit) {
  const std::filesystem::path example = SourceDirForTest() / "examples" / "biplane";
  const GaussianCloud cloud = *ReadCloud(example / "input.ply");
  CameraSet cameras = *ReadCameras(example / "transforms_hr.json");
  cameras.cameras.resize(2);
  for (Camera& camera : cameras.cameras) camera.intrinsics = Scaled(camera.intrinsics, 0.125);
  const auto original = MakeSplatViews(cloud, cameras, DisplayOptions(cloud));
  for (const double unit : {1e-4, 0.003, 0.007, 1000.0, 1e5}) {
    GaussianCloud scaled = cloud;
    for (float& x : scaled.means) x = static_cast<float>(x * unit);
    for (float& x : scaled.log_scales) x = static_cast<float>(x + std::log(unit));
    CameraSet there = cameras;
    for (Camera& camera : there.cameras) {
      for (double& x : camera.world_to_camera.translation) x *= unit;
    }
    const auto views = MakeSplatViews(scaled, there, DisplayOptions(scaled));
    for (size_t view = 0; view < 2; ++view) {
      const auto psnr = Psnr(*views->Load(view), *original->Load(view));
      ASSERT_TRUE(psnr.ok());
      EXPECT_GT(*psnr, 60) << unit;
    }
  }
}

// What the cameras' own pictures leave out does not count, whatever is there.
TEST(ViewSource, CamerasOwnPicturesComeWithoutLensAndMasked) {
  const TestFolder folder;
  std::filesystem::create_directories(folder / "images");
  Image picture(40, 30, 3), mask(40, 30, 1);
  std::fill(picture.pixels.begin(), picture.pixels.end(), 0.25f);
  std::fill(mask.pixels.begin(), mask.pixels.end(), 1.0f);
  for (int x = 0; x < 40; ++x) {
    for (int y = 0; y < 15; ++y) {
      mask.at(0, y, x) = 0;
      picture.at(0, y, x) = 1;
    }
  }
  ASSERT_TRUE(WritePng(folder / "images/a.png", picture).ok());
  ASSERT_TRUE(WritePng(folder / "mask.png", mask).ok());
  Camera camera;
  camera.name = "a";
  camera.image = folder / "images/a.png";
  camera.photograph.lens = {.model = LensModel::kRadial, .radial = {-0.1, 0, 0, 0}};
  camera.photograph.intrinsics = {40, 30, 40, 40, 20, 15};
  camera.photograph.mask = folder / "mask.png";
  camera.intrinsics = *UndistortedPinhole(camera.photograph.lens, camera.photograph.intrinsics);
  CameraSet cameras;
  cameras.cameras = {camera};
  const auto own = OpenImageViews(folder / "images" / ".." / "images", {0, 0, 0}, cameras);
  ASSERT_TRUE(own.ok()) << own.error().message;
  const auto size = (*own)->SizeOf(0);
  ASSERT_TRUE(size.ok());
  EXPECT_EQ(size->width, camera.intrinsics.width);
  ASSERT_TRUE((*own)->Load(0).ok());
  EXPECT_FALSE((*own)->ignored().empty());

  Image shown(camera.intrinsics.width, camera.intrinsics.height, 3);
  std::fill(shown.pixels.begin(), shown.pixels.end(), 0.35f);
  std::filesystem::create_directories(folder / "shown");
  ASSERT_TRUE(WritePng(folder / "shown/a.png", shown).ok());
  const auto other = OpenImageViews(folder / "shown", {0, 0, 0}, cameras);
  ASSERT_TRUE(other.ok());
  ViewSource* const sources[] = {other->get()};
  const auto compared = CompareToReference(sources, **own);
  ASSERT_TRUE(compared.ok()) << compared.error().message;
  EXPECT_NEAR((*compared)[0].mean_psnr, 20, 0.2) << "0.1 everywhere that is asked, in steps of 1/255";
}

// A view of which a mask leaves nothing is in no mean, and pictures that are no camera's are passed over.
TEST(ViewSource, WhollyMaskedViewsAndStrangersDoNotCount) {
  const TestFolder folder;
  std::filesystem::create_directories(folder / "images");
  std::filesystem::create_directories(folder / "shown");
  Image picture(16, 12, 3), shown(16, 12, 3), black(16, 12, 1), white(16, 12, 1);
  std::fill(picture.pixels.begin(), picture.pixels.end(), 0.25f);
  std::fill(shown.pixels.begin(), shown.pixels.end(), 0.35f);
  std::fill(black.pixels.begin(), black.pixels.end(), 0.0f);
  std::fill(white.pixels.begin(), white.pixels.end(), 1.0f);
  ASSERT_TRUE(WritePng(folder / "black.png", black).ok());
  ASSERT_TRUE(WritePng(folder / "white.png", white).ok());
  CameraSet cameras;
  for (const char* name : {"a", "b"}) {
    ASSERT_TRUE(WritePng(folder / "images" / (std::string(name) + ".png"), picture).ok());
    ASSERT_TRUE(WritePng(folder / "shown" / (std::string(name) + ".png"), shown).ok());
    Camera& camera = cameras.cameras.emplace_back();
    camera.name = name;
    camera.image = folder / "images" / (std::string(name) + ".png");
    camera.intrinsics = {16, 12, 20, 20, 8, 6};
    camera.photograph.mask = folder / (*name == 'a' ? "black.png" : "white.png");
  }
  ASSERT_TRUE(WritePng(folder / "images/a_depth.png", picture).ok());
  const Messages messages;
  const auto compare = [&]() {
    const auto own = OpenImageViews(folder / "images", {0, 0, 0}, cameras);
    EXPECT_TRUE(own.ok()) << own.error().message;
    EXPECT_EQ((*own)->names().size(), 2u) << "the depth map is nobody's view";
    const auto other = OpenImageViews(folder / "shown", {0, 0, 0}, {});
    EXPECT_TRUE(other.ok());
    ViewSource* const sources[] = {other->get()};
    return CompareToReference(sources, **own);
  };
  const auto compared = compare();
  ASSERT_TRUE(compared.ok()) << compared.error().message;
  ASSERT_EQ((*compared)[0].views.size(), 1u);
  EXPECT_EQ((*compared)[0].views[0].name, "b");
  EXPECT_EQ((*compared)[0].views[0].reference_view, 1u);
  EXPECT_NEAR((*compared)[0].mean_psnr, 20, 0.2);
  ASSERT_EQ(messages.warnings().size(), 1u);
  EXPECT_NE(messages.warnings()[0].find("1 of 2 views, which are skipped"), std::string::npos)
      << messages.warnings()[0];
  for (const std::string& note : messages.notes()) {
    EXPECT_EQ(note.find("not used"), note.npos) << note << ": the search for the cameras' pictures has said it";
  }
  cameras.cameras[1].photograph.mask = folder / "black.png";
  const auto nothing = compare();
  ASSERT_FALSE(nothing.ok());
  EXPECT_EQ(nothing.error().code, ErrorCode::kBadArgument);
}

}  // namespace
}  // namespace anchorsplat
