#include "images/webp_image.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "core/random.h"
#include "images/image_io.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

TEST(WebpImage, KeepsEveryByte) {
  Random random(1);
  ByteImage image{37, 11, {}};
  image.rgba.resize(4 * 37 * 11);
  for (uint8_t& x : image.rgba) x = static_cast<uint8_t>(random.Below(random.Below(2) == 0 ? 2 : 256));
  const auto bytes = EncodeWebp(image);
  ASSERT_TRUE(bytes.ok());
  const auto read = DecodeWebp("a.webp", *bytes, 1, 1000);
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->rgba, image.rgba);
  EXPECT_FALSE(DecodeWebp("a.webp", *bytes, 1, 406).ok());
  EXPECT_FALSE(DecodeWebp("a.webp", *bytes, 408, 1000).ok());
  EXPECT_FALSE(DecodeWebp("a.webp", bytes->substr(0, bytes->size() - 9), 1, 1000).ok());
  EXPECT_FALSE(EncodeWebp(ByteImage{16384, 1, Buffer<uint8_t>(4 * 16384)}).ok());
}

// Three pixels by two, lossless, with EXIF's orientation 6; by libwebp through Pillow.
constexpr const char* kTurned =
    "524946466e00000057454250565038580a000000080000000200000100005650384c2e0000002f024000002f201020a8f55f"
    "6043209004b5bfda020182ff03b3e63f406c726c152848db80c5dd53b288fec7b502455849461a0000004d4d002a00000008"
    "000101120003000000010006000000000000";
constexpr const char* kAnimated =
    "52494646c800000057454250565038580a00000002000000020000010000414e494d06000000000000000000414e4d464a00"
    "0000000000000000020000010000640000025650384c310000002f024000002f201020dc7a326b432090e4b4bfc15004d936"
    "1bed994ebbf90f1099ec7a162848db80c5dd73b288fec7950100414e4d464a00000000000000000002000001000064000000"
    "5650384c310000002f024000002f201020dc7a326b432090e4b4bfc15004d9361bed994ebbf90f1099ec7a162848db80c5dd"
    "13b288fec7f20200";

std::string FromHex(const std::string& digits) {
  std::string bytes;
  for (size_t i = 0; i < digits.size(); i += 2) bytes += static_cast<char>(std::stoi(digits.substr(i, 2), nullptr, 16));
  return bytes;
}

TEST(WebpPhotograph, ComesAsThePictureItIs) {
  const TestFolder folder;
  const std::string bytes = FromHex(kTurned);
  std::ofstream(folder / "a.webp", std::ios::binary) << bytes;
  const auto image = ReadImage(folder / "a.webp");
  ASSERT_TRUE(image.ok()) << image.error().message;
  EXPECT_EQ(image->channels, 3);
  EXPECT_EQ(image->at(0, 0, 0), 1);
  EXPECT_EQ(image->at(0, 1, 0), 51.0f / 255);
  EXPECT_EQ(image->at(2, 1, 0), 153.0f / 255);
  const auto size = ReadImageSize(folder / "a.webp");
  ASSERT_TRUE(size.ok()) << size.error().message;
  EXPECT_EQ(size->width, 3);
  EXPECT_EQ(size->orientation, 6);
  ByteImage clear{2, 1, {}};
  clear.rgba.resize(8);
  EXPECT_EQ(DecodeWebpPhotograph("a", *EncodeWebp(std::move(clear)))->channels, 4);
  for (size_t n = 0; n < bytes.size(); ++n) {
    const auto cut = DecodeWebpPhotograph("cut", bytes.substr(0, n));
    EXPECT_TRUE(cut.ok() || cut.error().code == ErrorCode::kBadFile) << n;
    const auto cut_size = DecodeWebpSize("cut", bytes.substr(0, n));
    EXPECT_TRUE(cut_size.ok() ? cut_size->width == 3 : cut_size.error().code == ErrorCode::kBadFile) << n;
  }
}

TEST(WebpPhotograph, AnimationsAreErrors) {
  const auto animated = DecodeWebpPhotograph("a.webp", FromHex(kAnimated));
  ASSERT_FALSE(animated.ok());
  EXPECT_NE(animated.error().message.find("an animated WebP"), std::string::npos) << animated.error().message;
}

}  // namespace
}  // namespace anchorsplat
