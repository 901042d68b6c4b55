#include "images/orientation.h"

#include <gtest/gtest.h>

#include <string>

#include "core/random.h"

namespace anchorsplat {
namespace {

// The letter F, 2×3, as a camera held in each of eight ways stores it; all are the same when upright.
TEST(Orientation, EveryWayIsTheSamePictureUpright) {
  const std::string stored[] = {"", "abcdef", "badcfe", "fedcba", "efcdab", "acebdf", "bdface", "fdbeca", "ecafdb"};
  const int width[] = {0, 2, 2, 2, 2, 3, 3, 3, 3};
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const std::string& letters = stored[orientation];
    Image image(width[orientation], 6 / width[orientation], 1);
    Buffer<uint8_t> bytes(6);
    for (size_t i = 0; i < 6; ++i) image.pixels[i] = static_cast<float>(bytes[i] = static_cast<uint8_t>(letters[i]));
    // The table above is the definition, by hand: EXIF says where the stored first row and column are seen.
    // 5 left top: rows are columns. 6 right top: the first row is the right column. 7 right bottom, 8 left bottom.
    const auto turned = Upright(bytes, image.width, image.height, orientation);
    image = Upright(std::move(image), orientation);
    EXPECT_EQ(image.width, 2) << orientation;
    EXPECT_EQ(image.height, 3) << orientation;
    std::string upright, of_bytes;
    for (size_t i = 0; i < 6; ++i) {
      upright += static_cast<char>(image.pixels[i]);
      of_bytes += static_cast<char>(turned[i]);
    }
    EXPECT_EQ(of_bytes, upright);
    EXPECT_EQ(upright, "abcdef") << orientation;
  }
}

TEST(Orientation, DamagedBlocksSayNothing) {
  std::string good("II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0", 26);
  ASSERT_EQ(OrientationOfExif(good), 6);
  for (size_t length = 0; length < 20; ++length) EXPECT_EQ(OrientationOfExif(good.substr(0, length)), 1) << length;
  Random random(1);
  for (int i = 0; i < 20000; ++i) {
    std::string bytes = good;
    for (int k = 0; k < 3; ++k) {
      bytes[static_cast<size_t>(random.Uniform(0, static_cast<double>(bytes.size()) - 0.01))] =
          static_cast<char>(random.Uniform(0, 256));
    }
    const int found = OrientationOfExif(bytes);
    ASSERT_TRUE(found >= 1 && found <= 8);
  }
}

}  // namespace
}  // namespace anchorsplat
