#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "enhance/enhance.h"

namespace anchorsplat {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// A network for these tests, where the seed says so.
constexpr uint64_t kWithNetwork = 20'002;

class Plan : public testing::Test {
 protected:
  Plan() { Begin(); }
  // Options as they are before anybody says anything.
  void Begin() {
    options_ = {};
    options_.methods = &methods_;
  }
  // The methods' name, or what is wrong.
  std::string Name() const {
    const auto plan = PlanEnhancement(options_);
    return plan.ok() ? plan->Name() : plan.error().message;
  }
  // Nothing, or what is wrong with `given`.
  std::string Given(const std::string& name) {
    options_.given = {name};
    const Status status = CheckOptions(options_);
    return status.ok() ? "" : status.error().message;
  }

  EnhanceOptions options_;
  const std::vector<EnhanceMethod> methods_ = [] {
    std::vector<EnhanceMethod> methods = BasicMethods();
    methods.push_back(
        {.name = "sharpen",
         .summary = "for this test",
         .rank = 1,
         .adds_detail = true,
         .options = {{"prune-opacity", {}},
                     {.name = "block-gaussians", .lacks = [](const MethodUse&) { return "with a larger network"; }}},
         .ready = [](const EnhanceOptions& options) -> Status {
           if (options.seed == kWithNetwork) return {};
           return Error{ErrorCode::kBadArgument, "no network"};
         },
         .run = [](EnhanceInput input, const EnhanceOptions&, StepReport&) -> Result<GaussianCloud> {
           return std::move(input.cloud);
         }});
    return methods;
  }();
};

TEST_F(Plan, QualityIsAMethodForThoseWhoKnowNone) {
  for (const bool network : {true, false}) {
    Begin();
    options_.seed = network ? kWithNetwork : 0;
    options_.quality = "fast";
    EXPECT_EQ(Name(), network ? "sharpen" : "filter");
    options_.quality = "good";
    EXPECT_EQ(Name(), network ? "sharpen+refine" : "refine");
    options_.quality = "best";
    EXPECT_EQ(Name(), network ? "sharpen+detail" : "detail");
    options_.upscale = 2.5;
    EXPECT_EQ(Name(), network ? "sharpen+refine" : "refine") << "only whole pixels can be enlarged";
    options_.upscale = 4;
    options_.refine.images = "pictures";
    EXPECT_EQ(Name(), network ? "sharpen+refine-images" : "refine-images");
    for (const char* without : {"fast", "good"}) {
      options_.quality = without;
      EXPECT_THAT(Name(), AllOf(HasSubstr("--images"), HasSubstr("--quality best")));
    }
  }
  options_.quality = "perfect";
  EXPECT_THAT(Name(), HasSubstr("known: fast, good, best"));
}

TEST_F(Plan, QualityAndAnotherMethodContradictEachOther) {
  options_.seed = kWithNetwork;
  options_.quality = "good";
  for (const char* other : {"filter", "sharpen", "refine", "magic"}) {
    options_.method = other;
    EXPECT_THAT(Name(), AllOf(HasSubstr("--quality good is --method sharpen+refine"), HasSubstr(other)));
  }
  options_.method = "sharpen+refine";
  EXPECT_EQ(Name(), "sharpen+refine");
}

TEST_F(Plan, AutoIsInstantUnlessThereArePictures) {
  EXPECT_EQ(Name(), "filter");
  options_.seed = kWithNetwork;
  EXPECT_EQ(Name(), "sharpen");
  options_.refine.images = "pictures";
  EXPECT_EQ(Name(), "sharpen+refine-images");
  options_.method = "refine";
  EXPECT_EQ(Name(), "sharpen+refine");
  options_.method = "filter+refine";
  EXPECT_EQ(Name(), "filter+refine");
  options_.method = "refine";
  options_.refine.images.clear();
  EXPECT_EQ(Name(), "refine") << "what it is called is what it does";
}

// Of all that methods look at, what the chosen one does not look at is refused, and nothing else is.
TEST_F(Plan, WhatHasNoEffectIsRefused) {
  const std::set<std::string> of_filter = {"upscale",     "pixel-size",      "cameras",      "train-width",
                                           "camera-rule", "filter-strength", "max-gaussians"};
  std::set<std::string> all;
  for (const EnhanceMethod& method : methods_) {
    for (const MethodOption& option : method.options) all.insert(option.name);
  }
  ASSERT_GT(all.size(), 20u);
  options_.method = "filter";
  for (const std::string& name : all) {
    const std::string said = Given(name);
    EXPECT_EQ(said.empty(), of_filter.contains(name)) << name << ": " << said;
    if (said.empty()) continue;
    EXPECT_THAT(said, HasSubstr("--" + name + " has no effect with --method filter; it works only with"));
  }
  EXPECT_EQ(Given("out-dir"), "") << "no method's business";

  options_.method = "auto";
  EXPECT_THAT(Given("steps"),
              HasSubstr("filter (chosen by auto); it works only with --method refine, refine-images or detail"));
  EXPECT_THAT(Given("prune-opacity"), HasSubstr("with --method sharpen"));
  options_.refine.images = "pictures";
  EXPECT_THAT(Given("prune-opacity"), HasSubstr("refine-images (chosen by auto); it works only with --method sharpen"));
  options_.seed = kWithNetwork;
  EXPECT_EQ(Given("prune-opacity"), "") << "it begins with the network";
  EXPECT_THAT(Given("block-gaussians"), HasSubstr("with a larger network"));
  options_.quality = "best";
  EXPECT_THAT(Given("poses"), HasSubstr("(chosen by --quality best); it works only without --images"));
}

TEST_F(Plan, RefinementSaysWhatItsOptionsNeed) {
  options_.method = "refine";
  for (const char* name : {"hold-out", "downscale", "exposure", "robust", "align"}) {
    EXPECT_THAT(Given(name), HasSubstr("it works only with --images")) << name;
  }
  EXPECT_EQ(Given("poses"), "");
  EXPECT_THAT(Given("between"), HasSubstr("with --cameras"));
  options_.cameras.emplace();
  EXPECT_EQ(Given("between"), "");
  EXPECT_THAT(Given("poses"), HasSubstr("without --images and --cameras"));
  EXPECT_EQ(Given("max-gaussians"), "");
  EXPECT_EQ(Given("half-from"), "");
  options_.upscale = 1;
  EXPECT_THAT(Given("half-from"), HasSubstr("with --upscale above 1"));
  EXPECT_EQ(Given("resume"), "");
  options_.refine.seconds = 5;
  EXPECT_THAT(Given("resume"), HasSubstr("without --seconds"));
  EXPECT_THAT(Given("checkpoint"), HasSubstr("without --seconds"));
  options_.refine.images = "pictures";
  options_.refine.copies.reset();
  for (const char* name : {"hold-out", "exposure", "robust", "align", "max-gaussians", "filter-strength"}) {
    EXPECT_EQ(Given(name), "") << name;
  }
  EXPECT_THAT(Given("between"), HasSubstr("without --images"));
  // A network's result has no width to choose, and is not split unless that is said.
  Begin();
  options_.seed = kWithNetwork;
  options_.method = "sharpen+refine";
  EXPECT_FALSE(Given("filter-strength").empty());
  EXPECT_EQ(Given("max-gaussians"), "");
  options_.method = "filter+refine";
  EXPECT_EQ(Given("filter-strength"), "");
}

}  // namespace
}  // namespace anchorsplat
