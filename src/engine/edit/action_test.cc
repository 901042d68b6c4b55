#include "edit/action.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace anchorsplat {
namespace {

using ::testing::HasSubstr;

template <typename T>
T Parsed(std::string_view name, const std::string& text, const Axes& axes = kRdf) {
  const auto action = ParseAction(name, text, axes);
  EXPECT_TRUE(action.ok()) << (action.ok() ? "" : action.error().message);
  return std::get<T>(action->what);
}

TEST(EditAction, TurnsAboutXThenYThenZ) {
  const auto turn = Parsed<MoveWorld>("--rotate", "90,0,90").map;
  // y becomes z about x, and stays about z; x becomes y; z becomes −y, and that x.
  EXPECT_EQ(turn.Apply({0, 1, 0}), (std::array<double, 3>{0, 0, 1}));
  EXPECT_EQ(turn.Apply({1, 0, 0}), (std::array<double, 3>{0, 1, 0}));
  EXPECT_EQ(turn.Apply({0, 0, 1}), (std::array<double, 3>{1, 0, 0}));
}

TEST(EditAction, NumbersCountAlongTheAxesThatAreSaid) {
  const Axes luf = kLuf;  // x and y the other way round
  EXPECT_EQ(Parsed<MoveWorld>("--translate", "1,2,3", luf).map.translation, (std::array<double, 3>{-1, -2, 3}));
  const auto box = Parsed<KeepBox>("--filter-box", "-1,-2,-3,4,,6", luf);
  EXPECT_EQ(box.low, (std::array<double, 3>{-4, -INFINITY, -3}));
  EXPECT_EQ(box.high, (std::array<double, 3>{1, 2, 6}));
  EXPECT_FALSE(box.outside);
  const auto removed = Parsed<KeepBox>("--remove-box", "-1,-2,-3,4,,6", luf);
  EXPECT_EQ(removed.low, box.low);
  EXPECT_TRUE(removed.outside);
  EXPECT_EQ(Parsed<KeepByValue>("--filter-value", "y,gt,1", luf).turn,
            (std::array<double, 9>{-1, 0, 0, 0, -1, 0, 0, 0, 1}));
  // A turn about y is one about −y, the other way.
  const auto turned = Parsed<MoveWorld>("--rotate", "0,90,0", luf).map.Apply({1, 0, 0});
  EXPECT_EQ(turned, (std::array<double, 3>{0, 0, 1}));
  const Axes rfu = *AxesFromName("RFU");
  EXPECT_EQ(Parsed<MoveWorld>("--translate", "1,2,3", rfu).map.translation, (std::array<double, 3>{1, -3, 2}));
  EXPECT_EQ(Parsed<TurnToUp>("--up", "z", rfu).up, (std::array<double, 3>{0, -1, 0}));
}

TEST(EditAction, SaysTheAxesWhereItsNumbersAreAlongSome) {
  for (const auto& [name, text] :
       {std::pair("--translate", "1,2,3"), std::pair("--up", "z"), std::pair("--filter-value", "x,gt,1"),
        std::pair("--filter-value", "rot_2,gt,1"), std::pair("--filter-value", "f_rest_7,gt,1")}) {
    EXPECT_EQ(ParseAction(name, text, kLuf)->axes, "LUF") << name << text;
  }
  for (const auto& [name, text] : {std::pair("--scale", "2"), std::pair("--filter-nan", ""),
                                   std::pair("--filter-value", "opacity,gt,0.5"), std::pair("--filter-floaters", "")}) {
    EXPECT_EQ(ParseAction(name, text, kLuf)->axes, "") << name << text;
  }
}

TEST(EditAction, ValuesMayBeSaidAsPeopleThinkOfThem) {
  EXPECT_DOUBLE_EQ(Parsed<KeepByValue>("--filter-value", "opacity,gt,0.5").value, 0);
  EXPECT_EQ(Parsed<KeepByValue>("--filter-value", "opacity,gte,0").value, -INFINITY);
  EXPECT_DOUBLE_EQ(Parsed<KeepByValue>("--filter-value", "scale_1,lt,1").value, 0);
  EXPECT_DOUBLE_EQ(Parsed<KeepByValue>("--filter-value", "f_dc_2,eq,0.5").value, 0);
  const auto raw = Parsed<KeepByValue>("--filter-value", "opacity_raw,neq,-2.5");
  EXPECT_EQ(raw.property, "opacity");
  EXPECT_EQ(raw.value, -2.5);
  EXPECT_EQ(Parsed<KeepByValue>("--filter-value", " label , lte , 3 ").property, "label");
}

TEST(EditAction, WhatMakesNoSenseIsNamed) {
  struct Case {
    const char *name, *text, *says;
  };
  for (const Case& c : {Case{"--translate", "1,2", "--translate: expected X,Y,Z, found '1,2'"},
                        Case{"--translate", "1,2,nan", "expected X,Y,Z"},
                        Case{"--translate", "1,2,3,4", "expected X,Y,Z"},
                        Case{"--rotate", "1,2,1e999", "in degrees"},
                        Case{"--rotate", "", "in degrees"},
                        Case{"--scale", "0", "a factor above 0"},
                        Case{"--scale", "-1", "--mirror mirrors"},
                        Case{"--scale", "1e30", "1e-18 to 1e+18"},
                        Case{"--scale", "1,2,3", "takes one factor for all axes"},
                        Case{"--scale", "inf", "a factor"},
                        Case{"--mirror", "w", "an axis"},
                        Case{"--up", "0,0,0", "a direction"},
                        Case{"--filter-box", "0,0,0,1,1", "a box"},
                        Case{"--filter-box", "2,0,0,1,1,1", "along x 2 is above 1"},
                        Case{"--filter-box", "0,0,0,1,1,x", "a box"},
                        Case{"--remove-box", "0,0,0,1,1", "--remove-box: expected a box"},
                        Case{"--filter-sphere", "0,0,0,0", "above 0"},
                        Case{"--filter-value", "opacity,>,1", "lt, lte, gt"},
                        Case{"--filter-value", "opacity,gt,2", "0 to 1, not 2"},
                        Case{"--filter-value", "scale_0,gt,-1", "a length of 0 or more"},
                        Case{"--filter-nan", "false", "--filter-nan: takes no value, found 'false'"},
                        Case{"--filter-harmonics", "4", "a degree"},
                        Case{"--filter-harmonics", "1.5", "a degree"},
                        Case{"--filter-floaters", "0.05,0.1,0.004", "takes one factor"},
                        Case{"--filter-floaters", "-1", "takes one factor"},
                        Case{"--flip", "x", "is not an edit"}}) {
    SCOPED_TRACE(c.name + std::string(" ") + c.text);
    const auto action = ParseAction(c.name, c.text);
    ASSERT_FALSE(action.ok());
    EXPECT_EQ(action.error().code, ErrorCode::kBadArgument);
    EXPECT_THAT(action.error().message, HasSubstr(c.says));
  }
}

}  // namespace
}  // namespace anchorsplat
