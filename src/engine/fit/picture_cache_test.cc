#include "fit/picture_cache.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "core/run_context.h"
#include "images/image_io.h"
#include "io/folder_for_test.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {
namespace {

Image RandomBytes(int width, int height, int channels, uint64_t seed) {
  Image image(width, height, channels);
  Random random(seed);
  for (float& x : image.pixels) x = static_cast<float>(random.Below(256)) / 255;
  return image;
}

Camera ViewOf(const std::filesystem::path& path, int width, int height) {
  Camera camera;
  camera.image = path;
  camera.intrinsics = {width, height, 10, 10, 1, 1};
  return camera;
}

void ExpectSamePicture(const Image& got, const Image& expected) {
  ASSERT_EQ(got.width, expected.width);
  ASSERT_EQ(got.height, expected.height);
  ASSERT_EQ(got.channels, 3);
  for (size_t i = 0; i < got.pixels.size(); ++i) ASSERT_NEAR(got.pixels[i], expected.pixels[i], 2e-7) << i;
}

TEST(PictureCache, KeepsWhatFitsAndGivesTheSameEitherWay) {
  const TestFolder folder;
  const std::array<float, 3> background = {0.2f, 0.5f, 1};
  const Image plain = RandomBytes(17, 9, 3, 1), covered = RandomBytes(13, 11, 4, 2);
  ASSERT_TRUE(WritePng(folder / "a.png", plain).ok());
  ASSERT_TRUE(WritePng(folder / "b.png", covered).ok());
  const std::vector<Camera> views = {ViewOf(folder / "a.png", 17, 9), ViewOf(folder / "b.png", 13, 11)};
  PictureCache all(views, background), one(views, background, 17 * 9 * 3 + 100), none(views, background, 0);
  Image picture;
  Buffer<uint8_t> ignored;
  for (PictureCache* cache : {&all, &one, &none}) {
    for (int round = 0; round < 2; ++round) {
      ASSERT_TRUE(cache->Load(0, picture, ignored).ok());
      ExpectSamePicture(picture, plain);
      ASSERT_TRUE(cache->Load(1, picture, ignored).ok());
      ExpectSamePicture(picture, CompositeOver(covered, background));
    }
  }
  // Without their files, only those can be had that are kept.
  std::filesystem::remove(folder / "a.png");
  std::filesystem::remove(folder / "b.png");
  EXPECT_TRUE(all.Load(0, picture, ignored).ok() && all.Load(1, picture, ignored).ok());
  EXPECT_TRUE(one.Load(0, picture, ignored).ok());
  EXPECT_EQ(one.Load(1, picture, ignored).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(none.Load(0, picture, ignored).error().code, ErrorCode::kNotFound);
}

// As many as there are threads are read ahead and kept, in their order, and none that would not fit.
TEST(PictureCache, ReadsAheadWhatComesNext) {
  const TestFolder folder;
  std::vector<Camera> views;
  std::vector<Image> pictures;
  for (int k = 0; k < 6; ++k) {
    const std::filesystem::path path = folder / (std::to_string(k) + ".png");
    pictures.push_back(RandomBytes(17, 9, 3, static_cast<uint64_t>(k)));
    if (k != 3) {
      ASSERT_TRUE(WritePng(path, pictures.back()).ok());
    }
    views.push_back(ViewOf(path, 17, 9));
  }
  // Which of the views are kept, by what can still be had without the files; and that it is right.
  std::error_code ignored_error;  // of the one that is not there
  const auto kept = [&](PictureCache cache, const std::vector<int64_t>& next) {
    cache.LoadAhead(next);
    for (const Camera& view : views) std::filesystem::rename(view.image, view.image.string() + ".away", ignored_error);
    std::vector<int64_t> found;
    for (size_t k = 0; k < views.size(); ++k) {
      Image picture;
      Buffer<uint8_t> ignored;
      if (!cache.Load(static_cast<int64_t>(k), picture, ignored).ok()) continue;
      ExpectSamePicture(picture, pictures[k]);
      found.push_back(static_cast<int64_t>(k));
    }
    for (const Camera& view : views) std::filesystem::rename(view.image.string() + ".away", view.image, ignored_error);
    return found;
  };
  using Views = std::vector<int64_t>;
  const RunScope three({.threads = 3});
  const auto threads = static_cast<size_t>(ThreadCount());  // fewer on a small machine
  const Views order = {4, 0, 5, 1, 2};
  Views expected(order.begin(), order.begin() + static_cast<ptrdiff_t>(threads));
  std::sort(expected.begin(), expected.end());
  if (threads == 1) expected.clear();  // nothing is gained
  const PictureCache roomy(views, {0, 0, 0});
  EXPECT_EQ(kept(roomy, order), expected);
  EXPECT_EQ(kept(roomy, {}), Views());
  EXPECT_EQ(kept(roomy, {2}), Views());  // Load does it
  if (threads > 1) {
    EXPECT_EQ(kept(roomy, {3, 2}), Views({2}));  // of one that is not there, Load says so
  }
  EXPECT_EQ(kept(PictureCache(views, {0, 0, 0}, 5 * 17 * 9 + 1), order), Views());  // no room for two
  PictureCache begun(views, {0, 0, 0});
  Image picture;
  Buffer<uint8_t> ignored;
  ASSERT_TRUE(begun.Load(4, picture, ignored).ok());
  EXPECT_EQ(kept(begun, order), Views({4}));  // the next one is there: later is early enough
  EXPECT_EQ(begun.Load(3, picture, ignored).error().code, ErrorCode::kNotFound);
}

TEST(PictureCache, WhatIsIgnoredDoesNotDiffer) {
  Image picture(3, 1, 3), shown(3, 1, 3);
  std::fill(picture.pixels.begin(), picture.pixels.end(), 0.0f);
  std::fill(shown.pixels.begin(), shown.pixels.end(), 0.5f);
  FillIgnored({}, shown, picture);
  EXPECT_EQ(picture.at(0, 0, 1), 0);
  Buffer<uint8_t> ignored(3, 0);
  ignored[1] = 1;
  FillIgnored(ignored, shown, picture);
  for (int c = 0; c < 3; ++c) {
    for (int x = 0; x < 3; ++x) EXPECT_EQ(picture.at(c, 0, x), x == 1 ? 0.5f : 0);
  }
}

TEST(PictureCache, APictureOfAnotherSizeIsAnError) {
  const TestFolder folder;
  ASSERT_TRUE(WritePng(folder / "a.png", RandomBytes(5, 4, 3, 1)).ok());
  PictureCache cache({ViewOf(folder / "a.png", 4, 5)}, {0, 0, 0});
  Image picture;
  Buffer<uint8_t> ignored;
  const Status status = cache.Load(0, picture, ignored);
  EXPECT_EQ(status.error().code, ErrorCode::kBadFile);
  EXPECT_NE(status.error().message.find("5x4 pixels, expected 4x5"), std::string::npos) << status.error().message;
}

}  // namespace
}  // namespace anchorsplat
