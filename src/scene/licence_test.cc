#include "scene/licence.h"

#include <gtest/gtest.h>

namespace anchorsplat {
namespace {

TEST(Licence, KnowsCreativeCommonsByNameAndByAddress) {
  EXPECT_EQ(SpdxIdentifier("Released under\r\nCreative Commons Zero (Public Domain)"), "CC0-1.0");
  EXPECT_EQ(SpdxIdentifier("<a href=\"http://creativecommons.org/publicdomain/zero/1.0/\">"), "CC0-1.0");
  EXPECT_EQ(SpdxIdentifier("available under CC-0 license"), "CC0-1.0");
  EXPECT_EQ(SpdxIdentifier("Creative Commons\nAttribution 3.0"), "CC-BY-3.0");
  EXPECT_EQ(SpdxIdentifier("Creative Commons Attribution 3.0 United States license"), "CC-BY-3.0-US");
  EXPECT_EQ(SpdxIdentifier("https://creativecommons.org/licenses/by-sa/4.0/"), "CC-BY-SA-4.0");
  EXPECT_EQ(SpdxIdentifier("creativecommons.org/licenses/by-nc-nd/2.5"), "CC-BY-NC-ND-2.5");
  EXPECT_EQ(SpdxIdentifier("Creative Commons Attribution-ShareAlike 2.0"), "CC-BY-SA-2.0");
}

TEST(Licence, TheFirstNamedCounts) {
  EXPECT_EQ(SpdxIdentifier("Creative Commons Attribution 3.0; parts are CC0"), "CC-BY-3.0");
  EXPECT_EQ(SpdxIdentifier("CC0; parts are Creative Commons Attribution 3.0"), "CC0-1.0");
  // The mark says that something is free, the words beside it how.
  EXPECT_EQ(SpdxIdentifier("<a href=\"http://creativecommons.org/publicdomain/mark/1.0/\">Creative Commons Zero</a>"),
            "CC0-1.0");
}

TEST(Licence, OtherTextHasNone) {
  EXPECT_EQ(SpdxIdentifier(""), "");
  EXPECT_EQ(SpdxIdentifier("color:#ccc0; background: cc01"), "");
  EXPECT_EQ(SpdxIdentifier("Creative Commons Attribution"), "");  // which version?
  EXPECT_EQ(SpdxIdentifier("creativecommons.org/licenses/by"), "");
}

TEST(Licence, AttributionWithoutVersion) {
  EXPECT_TRUE(MentionsAttribution("added CC-BY water and marble images"));
  EXPECT_FALSE(MentionsAttribution("CC0, by someone"));
}

}  // namespace
}  // namespace anchorsplat
