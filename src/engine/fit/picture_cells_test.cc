#include "fit/picture_cells.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "core/random.h"

namespace anchorsplat {
namespace {

Camera CameraOf(int width, int height) {
  Camera camera;
  camera.intrinsics = {width, height, 100, 100, 0.5 * width, 0.5 * height};
  return camera;
}

// A point that the camera at the origin sees at (x, y).
void PutAt(const Camera& camera, double x, double y, double depth, Buffer<float>& positions) {
  const Pinhole& k = camera.intrinsics;
  positions.push_back(static_cast<float>((x - k.cx) / k.fx * depth));
  positions.push_back(static_cast<float>((y - k.cy) / k.fy * depth));
  positions.push_back(static_cast<float>(depth));
}

TEST(PictureCells, AreAsFineAsThePointsAllow) {
  for (const auto& [points, along] : {std::pair{0, 4}, {70, 4}, {150, 6}, {900, 15}, {5000, 16}}) {
    const Camera camera = CameraOf(160, 120);
    Buffer<float> positions;
    Random random(3);
    for (int i = 0; i < points; ++i) {
      PutAt(camera, random.Uniform(0, 160), random.Uniform(0, 120), random.Uniform(1, 9), positions);
    }
    EXPECT_EQ(PictureCells(camera, positions).columns(), along) << points;
  }
}

TEST(PictureCells, TileThePicture) {
  for (const auto& [width, height] : {std::pair{160, 120}, {67, 200}, {3, 2}, {1, 1}, {1000, 3}}) {
    const PictureCells cells(CameraOf(width, height), {});
    std::vector<int> covered(static_cast<size_t>(width * height), 0);
    for (size_t cell = 0; cell < cells.size(); ++cell) {
      const PixelBox box = cells.BoxOf(cell);
      for (int y = box.y0; y < box.y1; ++y) {
        for (int x = box.x0; x < box.x1; ++x) ++covered[static_cast<size_t>(y * width + x)];
      }
    }
    for (const int times : covered) ASSERT_EQ(times, 1) << width << "x" << height;
  }
}

TEST(PictureCells, CloseWhereAPointIs) {
  const Camera camera = CameraOf(160, 120);
  Buffer<float> positions;
  PutAt(camera, 1, 1, 5, positions);
  PutAt(camera, 159.5, 119.5, 1000, positions);
  PutAt(camera, 100, 60, -1, positions);  // behind
  PutAt(camera, 161, 60, 1, positions);   // beside
  positions.insert(positions.end(), {NAN, NAN, NAN});
  const PictureCells cells(camera, positions);
  EXPECT_FALSE(cells.IsOpenAt(2, 2));
  EXPECT_FALSE(cells.IsOpenAt(158, 118));
  EXPECT_TRUE(cells.IsOpenAt(100, 60));
  EXPECT_TRUE(cells.IsOpenAt(50, 2));
  int64_t closed = 0;
  for (size_t i = 0; i < cells.size(); ++i) closed += cells.IsOpen(i) ? 0 : 1;
  EXPECT_EQ(closed, 2);
}

TEST(PictureCells, ColoursLeaveOutWhatIsHidden) {
  CellPicture picture;
  picture.image = Image(4, 4, 3);
  std::iota(picture.image.pixels.begin(), picture.image.pixels.end(), 0.0f);
  std::array<float, 3> color{};
  ASSERT_TRUE(MeanColor(picture, 1, 2, 0, color));
  EXPECT_EQ(color, (std::array<float, 3>{9, 25, 41}));
  ASSERT_TRUE(MeanColor(picture, 0, 0, 1, color));
  EXPECT_EQ(color[0], (0 + 1 + 4 + 5) / 4.0f);
  picture.image.pixels[0] = NAN;
  ASSERT_TRUE(MeanColor(picture, 0, 0, 1, color));
  EXPECT_FLOAT_EQ(color[0], (1 + 4 + 5) / 3.0f);
  picture.hidden.assign(16, 1);
  EXPECT_FALSE(MeanColor(picture, 0, 0, 3, color));
  picture.hidden[5] = 0;
  ASSERT_TRUE(MeanColor(picture, 0, 0, 1, color));
  EXPECT_EQ(color, (std::array<float, 3>{5, 21, 37}));
}

TEST(PictureCells, SharesCountPicturesAlike) {
  CellPicture fine, coarse;
  fine.cells = PictureCells(CameraOf(160, 160), {});
  coarse.cells = PictureCells(CameraOf(2, 2), {});
  for (size_t i = 0; i < fine.cells.size(); ++i) fine.cells.Close(i);
  const CellPicture both[] = {fine, coarse};
  EXPECT_DOUBLE_EQ(ShareOfOpenCells(both), 0.5);
  EXPECT_EQ(ShareOfOpenCells({}), 0);
}

TEST(PictureCells, PlainOnesCloseByBackgroundOrByMost) {
  CellPicture picture;
  picture.cells = PictureCells(CameraOf(40, 40), {});
  const std::array<float, 3> white = {1, 1, 1}, black = {0, 0, 0}, red = {1, 0, 0};
  picture.open_colors = {white, white, white, black, red};
  picture.flat = {{0, white}, {1, white}, {2, {0.99f, 1, 1}}, {3, {0.01f, 0, 0}}, {4, red}};
  ClosePlainCells(black, std::span(&picture, 1));
  for (const size_t closed : {0, 1, 2, 3}) EXPECT_FALSE(picture.cells.IsOpen(closed)) << closed;
  EXPECT_TRUE(picture.cells.IsOpen(4));
  EXPECT_TRUE(picture.cells.IsOpen(5)) << "not flat";
}

}  // namespace
}  // namespace anchorsplat
