#include "enhance/refine_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <type_traits>
#include <variant>

#include "enhance/count_members_for_test.h"
#include "enhance/enhance.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;

TEST(RefineOptions, RefusesNonsense) {
  const auto bad = [](auto&& change) {
    RefineOptions options;
    change(options);
    return !Validate(options).ok();
  };
  EXPECT_TRUE(Validate(RefineOptions{}).ok());
  EXPECT_TRUE(bad([](RefineOptions& o) { o.steps = 0; }));
  EXPECT_TRUE(bad([](RefineOptions& o) { o.seconds = -1; }));
  EXPECT_TRUE(bad([](RefineOptions& o) { o.steps = 1, o.seconds = 1; }));
  EXPECT_TRUE(bad([](RefineOptions& o) { o.copies = 0; }));
  EXPECT_TRUE(bad([](RefineOptions& o) { o.rate = 0; }));
  EXPECT_TRUE(bad([](RefineOptions& o) { o.rate_decay = 0; }));
  EXPECT_TRUE(bad([](RefineOptions& o) { o.half_from = 0.9; }));
  EXPECT_TRUE(bad([](RefineOptions& o) { o.ssim_weight = 2; }));
  EXPECT_TRUE(bad([](RefineOptions& o) { o.poses = 0; }));
}

TEST(RefineOptions, AreSetByName) {
  EnhanceOptions options;
  const RefineOptions& o = options.refine;
  const auto set = [&](const std::string& key, const std::string& value) {
    const Status status = SetOption(RefinementOptions(), key, value, options);
    return status.ok() ? std::string() : status.error().message;
  };
  for (const MethodOption& option : RefinementOptions()) EXPECT_EQ(set(option.name, "1"), "") << option.name;
  EXPECT_EQ(options.given.size(), RefinementOptions().size());
  EXPECT_EQ(o.images, "1");
  EXPECT_EQ(o.poses, 1);
  EXPECT_EQ(o.hold_out, 1);
  EXPECT_EQ(options.max_gaussians, 1);
  EXPECT_EQ(o.seconds, 1);
  EXPECT_TRUE(o.robust);
  EXPECT_EQ(set("k", "3"), "");
  EXPECT_EQ(o.copies, 3);
  EXPECT_EQ(set("steps", "1e3"), "");
  EXPECT_EQ(o.steps, 1000);
  EXPECT_EQ(set("half-from", "0.125"), "");
  EXPECT_EQ(o.half_from, 0.125);
  EXPECT_EQ(set("most-gaussians", "7"), "") << "the former name";
  EXPECT_EQ(options.max_gaussians, 7);

  EXPECT_THAT(set("speed", "1"), HasSubstr("no option 'speed' (known: images, "));
  EXPECT_EQ(set("k", "2.5"), "k cannot be '2.5': it must be a whole number from 1 to 64");
  EXPECT_EQ(set("rate", "0"), "rate cannot be '0': it must be a number above 0");
  EXPECT_EQ(set("max-gaussians", "-1"), "max-gaussians cannot be '-1': it must be a whole number of 0 or more");
  for (const char* value : {"", "x", "1x", "nan", "1e30", "-1e30", " 1"}) EXPECT_NE(set("k", value), "") << value;
  EXPECT_EQ(set("exposure", "2"), "exposure cannot be '2': it must be 0 or 1");
  EXPECT_NE(set("images", ""), "");
  EXPECT_NE(set("", "1"), "");
  EXPECT_EQ(o.copies, 3) << "a wrong value changes nothing";
}

// A member without a description fails here, as does a description of another's member.
TEST(RefineOptions, EachIsDescribedOnce) {
  constexpr size_t kOthers = 3 + 1;  // set by the program: enlarged, origin, background; outputs
  EXPECT_EQ(RefinementOptions().size() + CheckpointOptions().size() + kOthers,
            CountMembers<RefineOptions>() + CountMembers<RefineControl>());
  EnhanceOptions options;
  std::set<const void*> places;
  for (const auto& described : {RefinementOptions(), CheckpointOptions()}) {
    for (const MethodOption& option : described) {
      EXPECT_TRUE(option.name == "max-gaussians" || !option.help.empty()) << option.name;
      const OptionValue value = option.value(options);
      std::visit(
          [&](const auto& place) {
            if constexpr (std::is_pointer_v<std::decay_t<decltype(place)>>) places.insert(place);
          },
          value);
    }
  }
  EXPECT_EQ(places.size(), RefinementOptions().size() + CheckpointOptions().size());
}

// What changes the result is part of a checkpoint.
TEST(RefineOptions, CheckpointsKnowThemAll) {
  for (const MethodOption& option : RefinementOptions()) {
    if (option.name == "seconds" || option.name == "enlarge-with") continue;
    const char* value = option.name == "downscale" || option.name == "between" ? "2" : "1";
    EnhanceOptions options;
    ASSERT_TRUE(SetOption({option}, option.name, value, options).ok());
    options.refine.max_gaussians = options.max_gaussians;
    EXPECT_NE(ToJsonText(options.refine), ToJsonText(RefineOptions{})) << option.name;
  }
}

}  // namespace
}  // namespace anchorsplat
