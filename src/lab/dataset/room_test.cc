#include "dataset/room.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "dataset/room_pictures.h"
#include "images/image_io.h"
#include "io/folder_for_test.h"
#include "scene/ray_tracer.h"

namespace anchorsplat {
namespace {

using ::testing::HasSubstr;

constexpr const char* kCube =
    "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nv 0 0 1\nv 2 0 1\nv 2 1 1\nv 0 1 1\n"
    "f 1 2 3 4\nf 5 8 7 6\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 5 1 4 8\n";

class RoomTest : public ::testing::Test {
 protected:
  void SetUp() override { Write("box.obj", kCube); }
  void Write(const std::string& name, const std::string& text) { std::ofstream(folder_.path() / name) << text; }
  Result<std::vector<PlacedMesh>> Furniture(const std::string& text) {
    Write("room.txt", text);
    return ReadFurniture(folder_.path() / "room.txt", folder_.path());
  }
  TestFolder folder_;
};

TEST_F(RoomTest, ReadsFurniture) {
  const auto pieces = Furniture("# furniture\n\nbox.obj 2 0.5 3 90 1.5\n");
  ASSERT_TRUE(pieces.ok()) << pieces.error().message;
  ASSERT_EQ(pieces->size(), 1u);
  EXPECT_EQ((*pieces)[0].at, (std::array<double, 3>{2, 0.5, 3}));
  EXPECT_EQ((*pieces)[0].turn, 90);
  EXPECT_EQ((*pieces)[0].height, 1.5);
}

TEST_F(RoomTest, SaysWhichLineIsWrong) {
  for (const char* line : {"box.obj 2 0 3 90", "box.obj 2 0 x 90 1", "box.obj 2 0 3 90 0", "box.obj 2 0 3 90 1 more",
                           "box.obj 2 0 3 90 nan"}) {
    const auto pieces = Furniture(std::string("# one\n") + line + "\n");
    ASSERT_FALSE(pieces.ok()) << line;
    EXPECT_EQ(pieces.error().code, ErrorCode::kBadFile);
    EXPECT_THAT(pieces.error().message, HasSubstr("line 2"));
  }
  EXPECT_EQ(Furniture("no.obj 2 0 3 0 1\n").error().code, ErrorCode::kNotFound);
}

TEST_F(RoomTest, FurnitureStandsWhereItIsTold) {
  const auto pieces = Furniture("box.obj 2 0.5 3 90 0.5\n");
  ASSERT_TRUE(pieces.ok()) << pieces.error().message;
  const auto room = FurnishRoom(*pieces, {});
  ASSERT_TRUE(room.ok()) << room.error().message;
  const Room::Box& box = room->furniture.back();
  // 2 x 1 x 1, half as large, turned by a quarter: long along z.
  EXPECT_NEAR(box.low[0], 1.75f, 1e-5f);
  EXPECT_NEAR(box.high[0], 2.25f, 1e-5f);
  EXPECT_NEAR(box.low[1], 0.5f, 1e-5f);
  EXPECT_NEAR(box.high[1], 1.0f, 1e-5f);
  EXPECT_NEAR(box.low[2], 2.5f, 1e-5f);
  EXPECT_NEAR(box.high[2], 3.5f, 1e-5f);
}

TEST_F(RoomTest, RefusesWhatDoesNotFit) {
  const auto outside = Furniture("box.obj 5 0 3 0 1\n");
  ASSERT_TRUE(outside.ok());
  const auto room = FurnishRoom(*outside, {});
  ASSERT_FALSE(room.ok());
  EXPECT_EQ(room.error().code, ErrorCode::kBadArgument);
  EXPECT_THAT(room.error().message, HasSubstr("box.obj"));
  RoomOptions small;
  small.size = {2, 2.7, 4};
  EXPECT_EQ(FurnishRoom({}, small).error().code, ErrorCode::kBadArgument);
}

TEST_F(RoomTest, IsClosedSeenFromEverywhere) {
  const auto pieces = Furniture("box.obj 2.5 0 2 0 0.8\n");
  ASSERT_TRUE(pieces.ok());
  const auto room = FurnishRoom(*pieces, {});
  ASSERT_TRUE(room.ok()) << room.error().message;
  const auto cameras = RoomCameras(*room, 24, 32, 64);
  ASSERT_TRUE(cameras.ok()) << cameras.error().message;
  ASSERT_EQ(cameras->low.cameras.size(), 24u);
  EXPECT_EQ(cameras->low.cameras[7].name, "007");
  EXPECT_EQ(cameras->low.cameras[7].intrinsics.height, 24);
  EXPECT_EQ(cameras->high.cameras[7].intrinsics.width, 64);
  const auto tracer = RayTracer::Create(room->mesh);
  ASSERT_TRUE(tracer.ok());
  for (const Camera& camera : cameras->low.cameras) {
    const auto eye = camera.Center();
    const Room::Box& box = room->furniture.back();
    bool inside = true;
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_GT(eye[k], 0.3);
      EXPECT_LT(eye[k], room->size[k] - 0.3);
      inside = inside && eye[k] > double{box.low[k]} - 0.14 && eye[k] < double{box.high[k]} + 0.14;
    }
    EXPECT_FALSE(inside);
    const auto view = tracer->Render(camera, {.samples = 2});
    ASSERT_TRUE(view.ok());
    EXPECT_EQ(*std::min_element(view->channel(3), view->channel(3) + view->plane()), 1);
  }
}

TEST_F(RoomTest, CamerasNeedAPlaceAndAPicture) {
  const auto room = FurnishRoom({}, {});
  ASSERT_TRUE(room.ok()) << room.error().message;
  EXPECT_EQ(RoomCameras(*room, 0, 32, 64).error().code, ErrorCode::kBadArgument);
  EXPECT_EQ(RoomCameras(*room, 3, 30, 64).error().code, ErrorCode::kBadArgument);
  Room full = *room;
  full.furniture.push_back({{0, 0, 0}, {5.2f, 2.7f, 4.4f}});
  EXPECT_EQ(RoomCameras(full, 3, 32, 64).error().code, ErrorCode::kBadArgument);
}

TEST(RoomPictures, RepeatWithoutSeamsAndFollowTheSeed) {
  const auto difference = [](const Texture& t, int x, int y, int u, int v) {
    int sum = 0;
    for (int c = 0; c < 3; ++c) {
      sum += std::abs(int{t.rgba[static_cast<size_t>(4 * (y * t.width + x) + c)]} -
                      int{t.rgba[static_cast<size_t>(4 * (v * t.width + u) + c)]});
    }
    return sum;
  };
  for (const Texture& t : {PlasterPicture(1), WallpaperPicture(1)}) {
    // Across the seam texels differ as much as beside it.
    int64_t seam = 0, beside = 0;
    for (int y = 0; y < t.height; ++y) {
      seam += difference(t, 0, y, t.width - 1, y);
      beside += difference(t, t.width / 2, y, t.width / 2 - 1, y) + difference(t, 1, y, 0, y);
    }
    EXPECT_LT(seam, 2 * beside + 3 * t.height) << t.name;
  }
  EXPECT_EQ(RugPicture(4).rgba, RugPicture(4).rgba);
  EXPECT_NE(RugPicture(4).rgba, RugPicture(5).rgba);
}

// Ink on paper down to the last line, or the chart would show nothing at a closer look.
TEST(RoomPictures, TheReadingChartIsPrintedFromTopToBottom) {
  const Texture chart = ReadingChartPicture();
  for (int band = 0; band < 8; ++band) {
    int64_t ink = 0;
    for (int y = band * chart.height / 8; y < (band + 1) * chart.height / 8; ++y) {
      for (int x = 0; x < chart.width; ++x) ink += chart.rgba[static_cast<size_t>(4 * (y * chart.width + x))] < 128;
    }
    EXPECT_GT(ink, 1000) << band;
  }
}

}  // namespace
}  // namespace anchorsplat
