#include "enhance/enhance_region.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/source_dir_for_test.h"
#include "core/splat_comments.h"
#include "enhance/filter.h"
#include "enhance/gaussian_budget.h"
#include "enhance/refine.h"
#include "enhance/refinement_for_test.h"
#include "formats/cloud_io.h"

namespace anchorsplat {
namespace {

void ExpectSameBits(const GaussianCloud& a, const GaussianCloud& b) {
  EXPECT_EQ(a.means, b.means);
  EXPECT_EQ(a.log_scales, b.log_scales);
  EXPECT_EQ(a.quats, b.quats);
  EXPECT_EQ(a.opacity_logits, b.opacity_logits);
  EXPECT_EQ(a.sh, b.sh);
}

// The rows of a cloud that lie in the region, or those that do not.
GaussianCloud Part(const GaussianCloud& cloud, const Region& region, bool inside) {
  std::vector<int64_t> rows;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (region.Contains(cloud.means.data() + 3 * i) == inside) rows.push_back(i);
  }
  return Subset(cloud, rows).value();
}

GaussianCloud Rows(const GaussianCloud& cloud, int64_t begin, int64_t end) {
  std::vector<int64_t> rows;
  for (int64_t i = begin; i < end; ++i) rows.push_back(i);
  return Subset(cloud, rows).value();
}

const Region kHalf{.low = {-100, -100, -100}, .high = {100, 0, 100}};

TEST(Region, HoldsWhatLiesInItOrOnItsBorder) {
  const Region box{.low = {0, 1, 2}, .high = {1, 2, 3}}, sphere{.low = {0, 0, 1}, .high = {}, .radius = 2};
  const std::vector<std::array<float, 3>> in_box = {{0, 1, 2}, {1, 2, 3}, {0.5f, 1.5f, 2.5f}};
  for (const auto& p : in_box) EXPECT_TRUE(box.Contains(p.data()));
  const std::vector<std::array<float, 3>> out = {{1.1f, 1, 2}, {0, 0.9f, 2}, {0, 1, 3.1f}, {NAN, 1.5f, 2.5f}};
  for (const auto& p : out) EXPECT_FALSE(box.Contains(p.data()));
  const std::array<float, 3> border = {0, 0, 3}, beyond = {1.5f, 1.5f, 1}, none = {0, NAN, 0};
  EXPECT_TRUE(sphere.Contains(border.data()));
  EXPECT_FALSE(sphere.Contains(beyond.data()));
  EXPECT_FALSE(sphere.Contains(none.data()));
}

class EnhanceRegion : public Refinement {};

TEST_F(EnhanceRegion, IsFilteredAsInTheWholeAndTheRestStays) {
  const GaussianCloud& cloud = input_.cloud;
  EnhanceOptions options;
  options.method = "filter";
  options.upscale = kUpscale;
  options.mode = RenderMode::kClassic;
  options.cameras = cameras_;  // a pixel size for each
  const auto whole = Enhance(cloud, options);
  ASSERT_TRUE(whole.ok()) << whole.error().message;
  for (const Region& region : {kHalf, Region{.low = {0.5, 0, 0}, .high = {}, .radius = 0.8}}) {
    options.region = region;
    const auto part = Enhance(cloud, options);
    ASSERT_TRUE(part.ok()) << part.error().message;
    const int64_t inside = Part(cloud, region, true).size();
    ASSERT_GT(inside, 10);
    ASSERT_LT(inside, cloud.size() - 10);
    EXPECT_EQ(part->report.region_in, inside);
    EXPECT_EQ(part->report.kept_outside, cloud.size() - inside);
    EXPECT_EQ(part->report.gaussians_out, cloud.size());
    ExpectSameBits(Rows(part->cloud, 0, inside), Part(whole->cloud, region, true));
    ExpectSameBits(Rows(part->cloud, inside, cloud.size()), Part(cloud, region, false));
    EXPECT_EQ(part->cloud.comments, std::vector{PartEnhancedComment("filter", kUpscale)});
    EXPECT_FALSE(HasMark(part->cloud.comments, kEnhancedMark)) << "another part may be enhanced later";
  }
}

TEST_F(EnhanceRegion, IsRefinedAndTheRestStays) {
  const GaussianCloud& cloud = input_.cloud;
  EnhanceOptions options;
  options.method = "filter+refine";
  options.upscale = kUpscale;
  options.mode = RenderMode::kClassic;
  options.refine = options_;
  options.region = kHalf;
  const int64_t inside = Part(cloud, kHalf, true).size(), rest = cloud.size() - inside;
  for (const bool pictures : {true, false}) {
    if (!pictures) {
      options.refine.images.clear();
      options.refine.rate = 0.3;
      options.cameras = cameras_;
    }
    const auto part = Enhance(cloud, options);
    ASSERT_TRUE(part.ok()) << part.error().message;
    ExpectSameBits(Rows(part->cloud, part->cloud.size() - rest, part->cloud.size()), Part(cloud, kHalf, false));
    if (!pictures) continue;
    EXPECT_NE(Rows(part->cloud, 0, inside).means, Part(cloud, kHalf, true).means) << "moved, as pictures tell";
    options.refine.copies = 2;
    const auto split = Enhance(cloud, options);
    ASSERT_TRUE(split.ok()) << split.error().message;
    EXPECT_GT(split->report.steps.back().plan->gaussians, 3 * inside / 2 + rest);
    EXPECT_LE(split->report.steps.back().plan->gaussians, 2 * inside + rest);
  }
}

TEST_F(EnhanceRegion, TheBudgetIsThatOfTheWhole) {
  EnhanceOptions options;
  options.method = "filter";
  options.mode = RenderMode::kClassic;
  options.pixel_size = kPixel;
  options.region = kHalf;
  const GaussianCloud rest = Part(input_.cloud, kHalf, false);
  SetBudget(options, rest.size() + 20);
  const auto some = Enhance(input_.cloud, options);
  ASSERT_TRUE(some.ok()) << some.error().message;
  EXPECT_EQ(some->cloud.size(), rest.size() + 20);
  ExpectSameBits(Rows(some->cloud, 20, some->cloud.size()), rest);
  SetBudget(options, rest.size());
  const auto none = Enhance(input_.cloud, options);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::kBadArgument);
  EXPECT_THAT(none.error().message, testing::HasSubstr("leaves nothing for the region"));
}

TEST_F(EnhanceRegion, RefusesARegionOfNothing) {
  EnhanceOptions options;
  options.method = "filter";
  options.mode = RenderMode::kClassic;
  options.pixel_size = kPixel;
  options.region = Region{.low = {50, 50, 50}, .high = {60, 60, 60}};
  const auto result = Enhance(input_.cloud, options);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::kBadArgument);
  EXPECT_THAT(result.error().message, testing::HasSubstr("no Gaussian lies in it"));
}

TEST_F(EnhanceRegion, ABudgetBoundsEveryMethod) {
  EnhanceOptions options;
  options.upscale = kUpscale;
  options.mode = RenderMode::kClassic;
  options.cameras = cameras_;
  options.method = "filter";
  SetBudget(options, 99);
  EXPECT_EQ(Enhance(input_.cloud, options)->cloud.size(), 99);
  options_.steps = 10;
  options_.copies = 5;
  for (const bool pictures : {true, false}) {
    if (!pictures) options_.images.clear();
    for (const int64_t most : {99, 150, 200, 700}) {
      options_.max_gaussians = most;
      const auto refined = Refine(input_, options_, {});
      ASSERT_TRUE(refined.ok()) << refined.error().message;
      EXPECT_LE(refined->cloud.size(), most);
      const int64_t planned = refined->report.plan.nothing_to_do ? most : refined->report.plan.gaussians;
      EXPECT_LE(planned, most);
      EXPECT_GE(planned, pictures ? most * 9 / 10 : most) << "what is left of it is spent, too";
    }
  }
}

// Of a part that has been enhanced the width would be given back twice.
TEST(Region, AfterAPartTheWholeIsLeftAlone) {
  const GaussianCloud cloud = ReadCloud(SourceDirForTest() / "examples/biplane/input.ply").value();
  EnhanceOptions part;
  part.method = "filter";
  part.mode = RenderMode::kClassic;
  part.pixel_size = 0.0055;
  part.region = kHalf;
  const Enhanced first = Enhance(cloud, part).value();
  EXPECT_TRUE(IsMarkedPartEnhanced(first.cloud));
  EXPECT_FALSE(IsMarkedEnhanced(first.cloud));

  EnhanceOptions whole = part;
  whole.region.reset();
  const Enhanced again = Enhance(first.cloud, whole).value();
  EXPECT_EQ(again.cloud.log_scales, first.cloud.log_scales);
  EXPECT_EQ(again.report.filter_strength, 0);
  EXPECT_TRUE(IsMarkedPartEnhanced(again.cloud));

  // Another part may follow, and the mark stays one.
  EnhanceOptions other = part;
  other.region = Region{.low = {-2, -2, -2}, .high = {0.5, 2, 2}};
  const Enhanced second = Enhance(first.cloud, other).value();
  EXPECT_GT(second.report.filter_strength, 0.5);
  EXPECT_EQ(std::ranges::count_if(second.cloud.comments,
                                  [](const std::string& c) { return c.starts_with(kPartEnhancedMark); }),
            1);
}

// What has been enhanced says nothing about the pixels of the other part.
TEST(Region, AnotherPartIsLookedAtAlone) {
  GaussianCloud cloud = ReadCloud(SourceDirForTest() / "examples/biplane/input.ply").value();
  EnhanceOptions options;
  options.method = "filter";
  options.region = kHalf;
  const Enhanced first = Enhance(cloud, options).value();
  const double whole = Read(cloud)->pixel;
  ASSERT_TRUE(first.report.reading);
  EXPECT_EQ(first.report.reading->pixel, whole) << "all of it says more than a part";
  options.region = Region{.low = {-100, 0, -100}, .high = {100, 100, 100}};
  const Enhanced second = Enhance(first.cloud, options).value();
  ASSERT_TRUE(second.report.reading);
  EXPECT_EQ(second.report.reading->pixel, Read(Part(first.cloud, *options.region, true))->pixel);
  EXPECT_LT(second.report.reading->pixel, 1.2 * whole);
  EXPECT_GT(second.report.filter_strength, 0.5);
  options.region = Region{.low = {50, 50, 50}, .high = {60, 60, 60}};
  EXPECT_FALSE(Enhance(first.cloud, options).ok()) << "nothing lies there";
}

}  // namespace
}  // namespace anchorsplat
