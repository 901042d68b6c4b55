#include "viewer/base64.h"

#include <gtest/gtest.h>

#include <array>

namespace anchorsplat {
namespace {

std::string Encoded(const std::string& text) {
  return Base64({reinterpret_cast<const uint8_t*>(text.data()), text.size()});
}

// The vectors of RFC 4648, section 10.
TEST(Base64, TestVectors) {
  EXPECT_EQ(Encoded(""), "");
  EXPECT_EQ(Encoded("f"), "Zg==");
  EXPECT_EQ(Encoded("fo"), "Zm8=");
  EXPECT_EQ(Encoded("foo"), "Zm9v");
  EXPECT_EQ(Encoded("foob"), "Zm9vYg==");
  EXPECT_EQ(Encoded("fooba"), "Zm9vYmE=");
  EXPECT_EQ(Encoded("foobar"), "Zm9vYmFy");
}

TEST(Base64, AllBits) { EXPECT_EQ(Base64(std::array<uint8_t, 6>{0xff, 0xff, 0xfe, 0xfb, 0xf0, 0x00}), "///++/AA"); }

}  // namespace
}  // namespace anchorsplat
