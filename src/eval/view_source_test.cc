#include "eval/view_source.h"

#include <gtest/gtest.h>

#include <cmath>

#include "cameras/camera_io.h"
#include "core/source_dir_for_test.h"
#include "formats/cloud_io.h"
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
  const auto original = MakeSplatViews(cloud, cameras, OptionsFor(cloud));
  for (const double unit : {1e-4, 0.003, 0.007, 1000.0, 1e5}) {
    GaussianCloud scaled = cloud;
    for (float& x : scaled.means) x = static_cast<float>(x * unit);
    for (float& x : scaled.log_scales) x = static_cast<float>(x + std::log(unit));
    CameraSet there = cameras;
    for (Camera& camera : there.cameras) {
      for (double& x : camera.world_to_camera.translation) x *= unit;
    }
    const auto views = MakeSplatViews(scaled, there, OptionsFor(scaled));
    for (size_t view = 0; view < 2; ++view) {
      const auto psnr = Psnr(*views->Load(view), *original->Load(view));
      ASSERT_TRUE(psnr.ok());
      EXPECT_GT(*psnr, 60) << unit;
    }
  }
}

}  // namespace
}  // namespace anchorsplat
