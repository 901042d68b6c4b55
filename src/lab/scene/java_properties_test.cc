#include "scene/java_properties.h"

#include <gtest/gtest.h>

namespace anchorsplat {
namespace {

TEST(JavaProperties, ReadsEveryWayToWriteAnEntry) {
  const JavaProperties p = ParseJavaProperties(
      "# Head\r\n#line two\n\n  a = 1\nb: 2\rc 3\n d\\=e\\ f=g=h\n! later comment\nempty=\nalone\nlong=one \\\n   "
      "two\\\n"
      "three\nback=slash\\\\\nlast=x\\");
  EXPECT_EQ(p.header, "Head\nline two\n");
  EXPECT_EQ(p.Get("a"), "1");
  EXPECT_EQ(p.Get("b"), "2");
  EXPECT_EQ(p.Get("c"), "3");
  EXPECT_EQ(p.Get("d=e f"), "g=h");
  EXPECT_EQ(p.Get("empty"), "");
  EXPECT_EQ(p.Get("long"), "one twothree");
  EXPECT_EQ(p.Get("back"), "slash\\");
  EXPECT_EQ(p.entries.size(), 9u);
  EXPECT_EQ(p.Get("none"), "");
}

TEST(JavaProperties, NumberSignsInKeysAndTheLastValueCounts) {
  const JavaProperties p = ParseJavaProperties("name#1=Old\nname#1=New");
  EXPECT_EQ(p.Get("name#1"), "New");
}

TEST(JavaProperties, TextBecomesUtf8) {
  const JavaProperties p = ParseJavaProperties("a=\xe9\\u00e9\\u20AC\\uD83D\\uDE00\\ud83d!\\u12\\t\\q");
  EXPECT_EQ(p.Get("a"), "\u00e9\u00e9\u20ac\U0001F600\ufffd!u12\tq");
}

TEST(JavaProperties, AnyTextIsSomeList) {
  EXPECT_TRUE(ParseJavaProperties("").entries.empty());
  EXPECT_TRUE(ParseJavaProperties("\n\n#\n!").entries.empty());
  EXPECT_EQ(ParseJavaProperties("\\").entries.size(), 1u);
  EXPECT_EQ(ParseJavaProperties("=").entries.size(), 1u);
  EXPECT_EQ(ParseJavaProperties("a\\u").entries.size(), 1u);
}

}  // namespace
}  // namespace anchorsplat
