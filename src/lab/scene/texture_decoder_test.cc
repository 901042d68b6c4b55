#include "scene/texture_decoder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scene/assets_for_test.h"
#include "scene/sgi_image.h"

namespace anchorsplat {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr int64_t kMany = 1'000'000;

Texture Decode(const std::string& name, const std::string& bytes) {
  auto texture = DecodeTexture(name, bytes, kMany);
  EXPECT_TRUE(texture.ok()) << texture.error().message;
  return texture.ok() ? *std::move(texture) : Texture();
}

// A run-length encoded SGI row table for a picture of two rows and one channel.
std::string PackedSgi(const std::vector<std::string>& rows, int width) {
  std::string out = SgiBytes(width, static_cast<int>(rows.size()), 1, {});
  out[2] = 1;
  out[5] = 2;
  std::string starts, lengths, data;
  const auto big = [](size_t value) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 255);
    return bytes;
  };
  for (const std::string& row : rows) {
    starts += big(512 + 8 * rows.size() + data.size());
    lengths += big(row.size());
    data += row;
  }
  return out + starts + lengths + data;
}

TEST(TextureDecoder, SgiOfEveryChannelCount) {
  // Two rows, the lower first.
  EXPECT_THAT(Decode("a.bw", SgiBytes(1, 2, 1, {10, 20})).rgba, ElementsAre(20, 20, 20, 255, 10, 10, 10, 255));
  EXPECT_THAT(Decode("a.la", SgiBytes(1, 1, 2, {10, 20})).rgba, ElementsAre(10, 10, 10, 20));
  EXPECT_THAT(Decode("a.rgb", SgiBytes(2, 1, 3, {1, 2, 3, 4, 5, 6})).rgba, ElementsAre(1, 3, 5, 255, 2, 4, 6, 255));
  const Texture rgba = Decode("a.rgba", SgiBytes(1, 1, 4, {1, 2, 3, 4}));
  EXPECT_THAT(rgba.rgba, ElementsAre(1, 2, 3, 4));
  EXPECT_TRUE(rgba.has_alpha);
}

TEST(TextureDecoder, PackedSgi) {
  const std::string packed =
      PackedSgi({std::string("\x03\x07\x81\x09\x00", 5), std::string("\x84\x01\x02\x03\x04", 5)}, 4);
  EXPECT_THAT(Decode("a.rgb", packed).rgba, ElementsAre(1, 1, 1, 255, 2, 2, 2, 255, 3, 3, 3, 255, 4, 4, 4, 255,  //
                                                        7, 7, 7, 255, 7, 7, 7, 255, 7, 7, 7, 255, 9, 9, 9, 255));
}

TEST(TextureDecoder, DamagedSgiIsAnError) {
  const auto message = [](const std::string& bytes) {
    const auto texture = DecodeTexture("a.rgb", bytes, kMany);
    EXPECT_FALSE(texture.ok());
    return texture.ok() ? std::string() : texture.error().message;
  };
  EXPECT_THAT(message(SgiBytes(2, 2, 3, {1, 2, 3})), HasSubstr("ends before"));
  EXPECT_THAT(message(SgiBytes(2, 2, 5, {1, 2, 3})), HasSubstr("channels"));
  EXPECT_THAT(message(SgiBytes(60000, 60000, 1, {})), HasSubstr("pixels"));
  EXPECT_THAT(message(PackedSgi({std::string("\x05\x07", 2)}, 4)), HasSubstr("damaged"));  // too long
  EXPECT_THAT(message(PackedSgi({std::string("\x03\x07", 2)}, 4)), HasSubstr("damaged"));  // too short
  EXPECT_THAT(message(PackedSgi({std::string("\x84\x07", 2)}, 4)), HasSubstr("damaged"));  // ends inside
  std::string outside = PackedSgi({std::string("\x04\x07", 2)}, 4);
  outside[512] = '\x7f';
  EXPECT_THAT(message(outside), HasSubstr("outside"));
}

TEST(TextureDecoder, Targa) {
  // 2 x 1, 24 bits, bgr, from the top left.
  std::string tga(18, '\0');
  tga[2] = 2;
  tga[12] = 2;
  tga[14] = 1;
  tga[16] = 24;
  tga[17] = 0x20;
  tga += "\x01\x02\x03\x04\x05\x06";
  EXPECT_THAT(Decode("a.tga", tga).rgba, ElementsAre(3, 2, 1, 255, 6, 5, 4, 255));
  EXPECT_FALSE(DecodeTexture("a.dat", tga, kMany).ok());  // it has no mark
  tga[13] = '\x7f';                                       // wider than there are bytes for
  tga[15] = '\x7f';
  EXPECT_FALSE(DecodeTexture("a.tga", tga, int64_t{1} << 40).ok());
}

TEST(TextureDecoder, OtherPicturesAreRefusedByName) {
  const auto texture = DecodeTexture("a.dds", "DDS |", kMany);
  ASSERT_FALSE(texture.ok());
  EXPECT_THAT(texture.error().message, HasSubstr("a.dds"));
  EXPECT_FALSE(DecodeTexture("a.png", "", kMany).ok());
}

}  // namespace
}  // namespace anchorsplat
