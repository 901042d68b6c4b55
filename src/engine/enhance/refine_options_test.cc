#include "enhance/refine_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <string_view>

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
  RefineOptions o;
  const auto set = [&](std::string_view key, std::string_view value) {
    const Status status = SetRefineOption(o, key, value);
    return status.ok() ? std::string() : status.error().message;
  };
  EXPECT_EQ(set("k", "3"), "");
  EXPECT_EQ(o.copies, 3);
  EXPECT_EQ(set("steps", "1e3"), "");
  EXPECT_EQ(o.steps, 1000);
  EXPECT_EQ(set("half-from", "0.125"), "");
  EXPECT_EQ(o.half_from, 0.125);
  EXPECT_EQ(set("robust", "1"), "");
  EXPECT_TRUE(o.robust);
  // Every key is understood by the name that the list has for it.
  std::string keys = RefineOptionKeys() + ", ";
  for (size_t at = 0, end; at < keys.size(); at = end + 2) {
    end = keys.find(", ", at);
    EXPECT_EQ(set(keys.substr(at, end - at), "1"), "") << keys.substr(at, end - at);
  }
  EXPECT_EQ(o.poses, 1);
  EXPECT_EQ(o.hold_out, 1);
  EXPECT_EQ(o.max_gaussians, 1);
  EXPECT_EQ(o.seconds, 1);

  EXPECT_THAT(set("speed", "1"), HasSubstr("no option 'speed' (known: steps, "));
  EXPECT_THAT(set("k", "2.5"), HasSubstr("k cannot be '2.5'"));
  for (const char* value : {"", "x", "1x", "nan", "1e30", "-1e30", " 1"}) EXPECT_NE(set("k", value), "") << value;
  EXPECT_NE(set("exposure", "2"), "");
  EXPECT_NE(set("", "1"), "");
}

}  // namespace
}  // namespace anchorsplat
