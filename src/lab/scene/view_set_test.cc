#include "scene/view_set.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "cameras/camera_io.h"
#include "images/image_io.h"
#include "io/folder_for_test.h"
#include "scene/meshes_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

ViewSetOptions Small() {
  ViewSetOptions options;
  options.rig.views = 3;
  options.low_size = 8;
  options.high_size = 24;
  options.points = 50;
  return options;
}

TEST(ViewSet, WritesTheBenchmarksLayout) {
  const TestFolder folder;
  auto tracer = RayTracer::Create(SphereMesh(0.5f, 12, true));
  ASSERT_TRUE(tracer.ok());
  const auto cost = WriteViewSet(*tracer, folder.path(), Small());
  ASSERT_TRUE(cost.ok()) << cost.error().message;
  EXPECT_GT(cost->low.rays, 0);
  EXPECT_GT(cost->high.rays, cost->low.rays);
  for (const char* name :
       {"8/images/000.png", "8/images/002.png", "8/cameras.txt", "8/images.txt", "8/sparse/0/cameras.bin",
        "8/sparse/0/images.bin", "8/sparse/0/points3D.bin", "24/images/002.png", "24/cameras.txt", "24/images.txt"}) {
    EXPECT_TRUE(fs::exists(folder / name)) << name;
  }
  EXPECT_EQ(fs::file_size(folder / "8/sparse/0/points3D.bin"), 8u + 50 * (8 + 24 + 3 + 8 + 8));

  const auto expected = MakeViewSetCameras(Small());
  ASSERT_TRUE(expected.ok());
  for (const char* place : {"8", "8/sparse/0", "24", "transforms_24.json", "transforms_8.json"}) {
    const auto cameras = ReadCameras(folder / place);
    ASSERT_TRUE(cameras.ok()) << cameras.error().message;
    ASSERT_EQ(cameras->cameras.size(), 3u) << place;
    const bool high = std::string(place).find("24") != std::string::npos;
    for (size_t i = 0; i < 3; ++i) {
      const Camera& camera = cameras->cameras[i];
      const Camera& wanted = (high ? expected->high : expected->low).cameras[i];
      EXPECT_EQ(fs::weakly_canonical(camera.image),
                fs::weakly_canonical(folder / (high ? "24" : "8") / "images" / (wanted.name + ".png")))
          << place;
      EXPECT_EQ(camera.intrinsics.width, wanted.intrinsics.width);
      EXPECT_NEAR(camera.intrinsics.fx, wanted.intrinsics.fx, 1e-12);
      for (size_t k = 0; k < 9; ++k) {
        EXPECT_NEAR(camera.world_to_camera.rotation[k], wanted.world_to_camera.rotation[k], 1e-12);
      }
    }
  }
}

TEST(ViewSet, ViewsMadeAgainAreTheStoredOnesBitByBit) {
  for (const bool opaque : {false, true}) {
    const TestFolder folder;
    auto tracer = RayTracer::Create(RandomTriangles(40, 2));
    ASSERT_TRUE(tracer.ok());
    ViewSetOptions options = Small();
    options.opaque = opaque;
    options.background = {1, 0.5f, 0};
    ASSERT_TRUE(WriteViewSet(*tracer, folder.path(), options).ok());
    const auto cameras = MakeViewSetCameras(options);
    const auto stored = ReadImage(folder / "24/images/001.png");
    const auto again = RenderStoredView(*tracer, cameras->high.cameras[1], options);
    ASSERT_TRUE(stored.ok() && again.ok());
    EXPECT_EQ(stored->channels, opaque ? 3 : 4);
    ASSERT_EQ(stored->channels, again->channels);
    EXPECT_TRUE(stored->pixels == again->pixels);
  }
}

TEST(ViewSet, OnDemandKeepsTheHighCamerasOnly) {
  const TestFolder folder;
  auto tracer = RayTracer::Create(SphereMesh(0.5f, 12, true));
  ASSERT_TRUE(tracer.ok());
  ViewSetOptions options = Small();
  options.store_high = false;
  ASSERT_TRUE(WriteViewSet(*tracer, folder.path(), options).ok());
  EXPECT_TRUE(fs::exists(folder / "24/cameras.txt"));
  EXPECT_FALSE(fs::exists(folder / "24/images"));
  EXPECT_TRUE(fs::exists(folder / "8/images/002.png"));
}

TEST(ViewSet, ReplacesOnlyWhenTold) {
  const TestFolder folder;
  auto tracer = RayTracer::Create(SphereMesh(0.5f, 12, true));
  ASSERT_TRUE(tracer.ok());
  ViewSetOptions options = Small();
  ASSERT_TRUE(WriteViewSet(*tracer, folder.path(), options).ok());
  EXPECT_EQ(WriteViewSet(*tracer, folder.path(), options).error().code, ErrorCode::kExists);
  options.overwrite = true;
  EXPECT_TRUE(WriteViewSet(*tracer, folder.path(), options).ok());
}

TEST(ViewSet, RefusesTheImpossible) {
  for (const auto& change : {+[](ViewSetOptions& o) { o.low_size = 0; }, +[](ViewSetOptions& o) { o.low_size = 24; },
                             +[](ViewSetOptions& o) { o.high_size = 1 << 15; },
                             +[](ViewSetOptions& o) { o.points = -1; }, +[](ViewSetOptions& o) { o.rig.views = 0; }}) {
    ViewSetOptions options = Small();
    change(options);
    EXPECT_FALSE(MakeViewSetCameras(options).ok());
  }
}

}  // namespace
}  // namespace anchorsplat
