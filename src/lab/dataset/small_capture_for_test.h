#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <vector>

#include "cameras/colmap_writer.h"
#include "fit/orbit_scene_for_test.h"
#include "images/image_io.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// A COLMAP project: nine pictures of a ball, of a width and height that four does not divide, and points.
inline void WriteSmallCapture(const std::filesystem::path& folder) {
  CameraSet cameras = orbit_scene::Cameras(9, 66, 51);
  const GaussianCloud ball = orbit_scene::Ball(150, 3);
  std::filesystem::create_directories(folder / "images");
  std::filesystem::create_directories(folder / "sparse" / "0");
  Rasterizer rasterizer;
  for (Camera& camera : cameras.cameras) {
    camera.name = std::filesystem::path(camera.name).filename().string();
    RenderOutput output;
    ASSERT_TRUE(rasterizer.Render(ball, camera, {}, output).ok());
    ASSERT_TRUE(WritePng(folder / "images" / (camera.name + ".png"), output.color).ok());
  }
  ASSERT_TRUE(WriteColmapCameras(folder / "sparse" / "0", cameras, ColmapForm::kBinary).ok());
  std::vector<ColmapPoint> points;
  for (size_t i = 0; i < 150; ++i) {
    points.push_back({{ball.means[3 * i], ball.means[3 * i + 1], ball.means[3 * i + 2]}, {200, 150, 100}});
  }
  ASSERT_TRUE(WriteColmapPoints(folder / "sparse" / "0", points, ColmapForm::kBinary).ok());
}

}  // namespace anchorsplat
