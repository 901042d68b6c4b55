#include "cameras/photograph.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "core/random.h"
#include "images/image_io.h"
#include "images/orientation.h"
#include "io/file_bytes.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

Image RandomPicture(int width, int height, int channels, uint64_t seed) {
  Random random(seed);
  Image image(width, height, channels);
  for (float& x : image.pixels) x = static_cast<float>(static_cast<int>(random.Uniform(0, 256))) / 255;
  return image;
}

Camera CameraOf(const std::filesystem::path& picture, int width, int height) {
  Camera camera;
  camera.image = picture;
  camera.intrinsics = {width, height, 50, 50, 0.5 * width, 0.5 * height};
  return camera;
}

void ExpectSame(const Image& got, const Image& expected) {
  ASSERT_EQ(got.width, expected.width);
  ASSERT_EQ(got.height, expected.height);
  ASSERT_EQ(got.channels, expected.channels);
  for (size_t i = 0; i < got.pixels.size(); ++i) ASSERT_NEAR(got.pixels[i], expected.pixels[i], 1e-6) << i;
}

// A PNG with an eXIf chunk; its checksum is that of the bytes.
void AddOrientation(const std::filesystem::path& path, int orientation) {
  std::string bytes = *ReadFileBytes(path, 1 << 20);
  std::string chunk("eXIfMM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01", 22);
  chunk += std::string(1, '\0') + static_cast<char>(orientation) + std::string(6, '\0');
  uint32_t crc = ~0u;
  for (const char c : chunk) {
    crc ^= static_cast<unsigned char>(c);
    for (int k = 0; k < 8; ++k) crc = (crc >> 1) ^ (0xEDB88320u & (0u - (crc & 1)));
  }
  crc = ~crc;
  const auto big = [](uint32_t value) {
    std::string text;
    for (int i = 3; i >= 0; --i) text += static_cast<char>(value >> (8 * i));
    return text;
  };
  bytes.insert(33, big(static_cast<uint32_t>(chunk.size()) - 4) + chunk + big(crc));  // behind IHDR
  std::filesystem::remove(path);
  std::ofstream(path, std::ios::binary) << bytes;
}

TEST(Photograph, IsTurnedWhereOnlyThatFits) {
  const TestFolder folder;
  const Image stored = RandomPicture(9, 6, 3, 1);
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const auto path = folder / (std::to_string(orientation) + ".png");
    ASSERT_TRUE(WritePng(path, stored).ok());
    AddOrientation(path, orientation);
    ASSERT_EQ(ReadImageSize(path)->orientation, orientation);
    Camera as_stored = CameraOf(path, 9, 6), upright = CameraOf(path, 6, 9), other = CameraOf(path, 7, 7);
    ASSERT_TRUE(MatchPhotograph(as_stored).ok());
    ExpectSame(ReadPhotograph(as_stored)->image, stored);
    EXPECT_EQ(MatchPhotograph(upright).ok(), orientation >= 5);
    if (orientation >= 5) ExpectSame(ReadPhotograph(upright)->image, Upright(stored, orientation));
    EXPECT_EQ(MatchPhotograph(other).error().code, ErrorCode::kBadFile);
  }
}

TEST(Photograph, MasksOfEverySize) {
  const TestFolder folder;
  ASSERT_TRUE(WritePng(folder / "a.png", RandomPicture(8, 4, 3, 2)).ok());
  Image mask(8, 4, 1);
  std::fill(mask.pixels.begin(), mask.pixels.end(), 1.0f);
  mask.at(0, 1, 5) = 0;
  ASSERT_TRUE(WritePng(folder / "mask.png", mask).ok());
  Camera camera = CameraOf(folder / "a.png", 8, 4);
  camera.photograph.mask = folder / "mask.png";
  ASSERT_TRUE(MatchPhotograph(camera).ok());
  auto picture = ReadPhotograph(camera);
  ASSERT_TRUE(picture.ok()) << picture.error().message;
  for (size_t i = 0; i < 32; ++i) EXPECT_EQ(picture->ignored[i], i == 8 + 5) << i;
  // A mask of half the size counts for two pixels each way; one of another shape is an error that says both sizes.
  Image half(4, 2, 1);
  std::fill(half.pixels.begin(), half.pixels.end(), 1.0f);
  half.at(0, 1, 0) = 0;
  ASSERT_TRUE(WritePng(folder / "mask.png", half, {.overwrite = true}).ok());
  picture = ReadPhotograph(camera);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 8; ++x) EXPECT_EQ(picture->ignored[static_cast<size_t>(8 * y + x)], y >= 2 && x < 2);
  }
  ASSERT_TRUE(WritePng(folder / "mask.png", Image(5, 5, 1), {.overwrite = true}).ok());
  const auto wrong = ReadPhotograph(camera);
  ASSERT_FALSE(wrong.ok());
  EXPECT_NE(wrong.error().message.find("mask has 5x5 pixels, its picture 8x4"), std::string::npos)
      << wrong.error().message;
  // Nothing black: no mask. A broken one is an error.
  std::fill(mask.pixels.begin(), mask.pixels.end(), 1.0f);
  ASSERT_TRUE(WritePng(folder / "mask.png", mask, {.overwrite = true}).ok());
  EXPECT_TRUE(ReadPhotograph(camera)->ignored.empty());
  std::filesystem::remove(folder / "mask.png");
  std::ofstream(folder / "mask.png") << "no picture";
  EXPECT_EQ(ReadPhotograph(camera).error().code, ErrorCode::kBadFile);
}

TEST(Photograph, LensAndDownscaleGiveTheCamerasSize) {
  const TestFolder folder;
  ASSERT_TRUE(WritePng(folder / "a.png", RandomPicture(31, 22, 4, 3)).ok());
  Camera camera = CameraOf(folder / "a.png", 62, 44);  // half the size that the camera file says
  camera.photograph.lens = {.model = LensModel::kRadial, .radial = {-0.1, 0, 0, 0}};
  camera.photograph.intrinsics = camera.intrinsics;
  ASSERT_TRUE(MatchPhotograph(camera, 3).ok());
  EXPECT_NEAR(camera.intrinsics.fx, 50 / 2.0 / 3, 1e-12);
  const auto picture = ReadPhotograph(camera);
  ASSERT_TRUE(picture.ok()) << picture.error().message;
  EXPECT_EQ(picture->image.width, camera.intrinsics.width);
  EXPECT_EQ(picture->image.height, camera.intrinsics.height);
  EXPECT_EQ(picture->image.channels, 4);
  Camera tiny = CameraOf(folder / "a.png", 31, 22);
  EXPECT_EQ(MatchPhotograph(tiny, 64).error().code, ErrorCode::kBadFile);
}

}  // namespace
}  // namespace anchorsplat
