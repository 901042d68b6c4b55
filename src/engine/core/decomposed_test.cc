#include "core/decomposed.h"

#include <gtest/gtest.h>

namespace anchorsplat {
namespace {

TEST(Decomposed, LettersAreApartFromTheirMarks) {
  EXPECT_EQ(Decomposed("\u00FCn\u00EF 0.png"), "u\u0308ni\u0308 0.png");
  EXPECT_EQ(Decomposed("u\u0308ni\u0308 0.png"), "u\u0308ni\u0308 0.png");
  EXPECT_EQ(Decomposed("\u1EBF"), "e\u0302\u0301") << "two marks";
  EXPECT_EQ(Decomposed("\u0439 \u304C \u03AC"), "\u0438\u0306 \u304B\u3099 \u03B1\u0301");
  EXPECT_EQ(Decomposed("\uD55C\uAC00"), "\u1112\u1161\u11AB\u1100\u1161");
  for (const char* same : {"", "plain", "\xFF\xC3", "\xC3", "\xE1\xBA", "\xC0\x80", "\xE0\x80\x80", "\xF0\x9F\x98\x80",
                           "\u4E2D\u6587", "\u00DF"}) {
    EXPECT_EQ(Decomposed(same), same);
  }
}

}  // namespace
}  // namespace anchorsplat
