#include "core/fingerprint.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace anchorsplat {
namespace {

// The published test values of FNV-1a, 64 bits.
TEST(Fingerprint, IsFnv1a) {
  const auto of = [](const std::string& text) {
    Fingerprint print;
    print.Add(text);
    return print.value();
  };
  EXPECT_EQ(of(""), 0xcbf29ce484222325u);
  EXPECT_EQ(of("a"), 0xaf63dc4c8601ec8cu);
  EXPECT_EQ(of("foobar"), 0x85944171f73967e8u);
}

TEST(Fingerprint, GoesOnFromArrayToArray) {
  Fingerprint whole, parts;
  whole.Add(std::vector<float>{1, 2, 3});
  parts.Add(std::vector<float>{1});
  parts.Add(std::vector<float>{2, 3});
  EXPECT_EQ(whole.text(), parts.text());
  EXPECT_EQ(whole.text().size(), 16u);
  parts.Add(std::vector<float>{0});
  EXPECT_NE(whole.text(), parts.text());
}

}  // namespace
}  // namespace anchorsplat
