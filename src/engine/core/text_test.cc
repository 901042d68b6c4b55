#include "core/text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>

namespace anchorsplat {
namespace {

TEST(Text, CatWritesEverything) { EXPECT_EQ(Cat("byte ", 17, ": ", 0.5, ' ', true), "byte 17: 0.5 1"); }

TEST(Text, Thousands) {
  EXPECT_EQ(WithThousands(0), "0");
  EXPECT_EQ(WithThousands(999), "999");
  EXPECT_EQ(WithThousands(1000), "1,000");
  EXPECT_EQ(WithThousands(1234567), "1,234,567");
  EXPECT_EQ(WithThousands(-100), "-100");
  EXPECT_EQ(WithThousands(-123456), "-123,456");
  EXPECT_EQ(WithThousands(std::numeric_limits<int64_t>::min()), "-9,223,372,036,854,775,808");
}

TEST(Text, FixedDigits) {
  EXPECT_EQ(Fixed(3.14159, 2), "3.14");
  EXPECT_EQ(Fixed(-0.5, 0), "-0");
  EXPECT_EQ(Fixed(std::numeric_limits<double>::infinity(), 1), "inf");
  EXPECT_EQ(Fixed(-std::numeric_limits<double>::infinity(), 1), "-inf");
  EXPECT_EQ(Fixed(std::nan(""), 1), "nan");
  EXPECT_EQ(Fixed(std::numeric_limits<double>::max(), 3).size(), 309u + 4);
}

TEST(Text, BytesChangeUnitBeforeFourDigits) {
  EXPECT_EQ(HumanBytes(0), "0 B");
  EXPECT_EQ(HumanBytes(999), "999 B");
  EXPECT_EQ(HumanBytes(1000), "1.0 kB");
  EXPECT_EQ(HumanBytes(4'700'000), "4.7 MB");
  EXPECT_EQ(HumanBytes(999'499), "999 kB");
  EXPECT_EQ(HumanBytes(999'500), "1.0 MB");
  EXPECT_EQ(HumanBytes(UINT64_MAX), "18.4 EB");
}

TEST(Text, SecondsChangeUnit) {
  EXPECT_EQ(HumanSeconds(0.00123), "1.23 ms");
  EXPECT_EQ(HumanSeconds(0.85), "850 ms");
  EXPECT_EQ(HumanSeconds(0.9996), "1.0 s");
  EXPECT_EQ(HumanSeconds(12.34), "12.3 s");
  EXPECT_EQ(HumanSeconds(245), "4 min 05 s");
  EXPECT_EQ(HumanSeconds(119.6), "2 min 00 s");
}

TEST(Text, HostileBytesBecomePrintable) {
  EXPECT_EQ(Printable("plain ä"), "plain ä");
  EXPECT_EQ(Printable(std::string("a\0b\n\x1b[2J\x7f", 9)), "a\\x00b\\x0a\\x1b[2J\\x7f");
  EXPECT_LT(Printable(std::string(100'000, 'x')).size(), 70u);
  EXPECT_EQ(Printable("a\xff\xc3(\xe2\x82"), "a\\xff\\xc3(\\xe2\\x82");
  EXPECT_EQ(Printable("\xc2\x9b\xc2\xa0€"), "\\xc2\\x9b\xc2\xa0€");  // a control character of two bytes, and none
  EXPECT_EQ(Printable("\xc2"), "\\xc2");
  // What turns the direction of a line.
  EXPECT_EQ(Printable("a\u202egnp"), "a\\xe2\\x80\\xaegnp");
  EXPECT_EQ(Printable("\u2066\u061c"), "\\xe2\\x81\\xa6\\xd8\\x9c");
  EXPECT_EQ(Printable("\u2026\u0627"), "\u2026\u0627");  // neighbours that do not
  const std::string long_text = Printable("x" + std::string(30, '\xc3') + std::string(100, 'a'));
  EXPECT_LT(long_text.size(), 70u);
}

}  // namespace
}  // namespace anchorsplat
