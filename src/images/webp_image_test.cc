#include "images/webp_image.h"

#include <gtest/gtest.h>

#include "core/random.h"

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

}  // namespace
}  // namespace anchorsplat
