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

TEST(Licence, KnowsTheGnuLicences) {
  EXPECT_EQ(SpdxIdentifier("GNU GENERAL PUBLIC LICENSE\n  Version 2, June 1991\n\n Copyright (C) 1989, 1991"),
            "GPL-2.0");
  EXPECT_EQ(SpdxIdentifier("GNU GENERAL PUBLIC LICENSE\n  Version 3, 29 June 2007"), "GPL-3.0");
  EXPECT_EQ(SpdxIdentifier("under the terms of the GNU General Public License as published by the Free Software\n"
                           "Foundation; either version 2 of the License, or (at your option) any later version."),
            "GPL-2.0-or-later");
  EXPECT_EQ(SpdxIdentifier("the GNU General Public License, version 2 of the License."), "GPL-2.0-only");
  EXPECT_EQ(SpdxIdentifier("License: GPL-2+\n"), "GPL-2.0-or-later");
  EXPECT_EQ(SpdxIdentifier("GPL-3.0-only"), "GPL-3.0-only");
  EXPECT_EQ(SpdxIdentifier("GPLv3 or later"), "GPL-3.0-or-later");
  EXPECT_EQ(SpdxIdentifier("GNU Lesser General Public License version 2.1"), "LGPL-2.1");
  EXPECT_EQ(SpdxIdentifier("LGPL-3"), "LGPL-3.0");
  EXPECT_EQ(SpdxIdentifier("GNU AFFERO GENERAL PUBLIC LICENSE\nVersion 3"), "AGPL-3.0");
  EXPECT_EQ(SpdxIdentifier("under the GPL"), "");  // which version?
}

TEST(Licence, KnowsTheCommonPermissiveLicences) {
  EXPECT_EQ(SpdxIdentifier("The MIT License (MIT)"), "MIT");
  EXPECT_EQ(SpdxIdentifier("Permission is hereby granted, free of charge, to any person obtaining a copy\n"
                           "of this software and associated"),
            "MIT");
  EXPECT_EQ(SpdxIdentifier("                 Apache License\n           Version 2.0, January 2004"), "Apache-2.0");
  EXPECT_EQ(SpdxIdentifier("Redistribution and use in source and binary forms, with or without"), "BSD-2-Clause");
  EXPECT_EQ(SpdxIdentifier("Redistribution and use in source and binary forms … Neither the name of"), "BSD-3-Clause");
  EXPECT_EQ(SpdxIdentifier("CC-BY-SA 4.0"), "CC-BY-SA-4.0");
  EXPECT_EQ(SpdxIdentifier("summit licensed"), "");
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
