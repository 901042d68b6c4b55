#include "edit/edit_clouds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "core/messages_for_test.h"
#include "core/run_context.h"
#include "edit/edit_files.h"
#include "formats/opened_splat.h"
#include "formats/ply/ply_writer.h"
#include "formats/random_cloud_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

using ::testing::HasSubstr;
using Words = std::vector<std::pair<const char*, const char*>>;

std::vector<EditAction> AlongLuf(const Words& words) {
  std::vector<EditAction> actions;
  for (const auto& [name, text] : words) actions.push_back(*ParseAction(name, text, kLuf));
  return actions;
}

GaussianCloud SplatOf(int64_t n, int degree, uint64_t seed) {
  GaussianCloud cloud = RandomCloud(n, degree, seed);
  for (float& x : cloud.log_scales) x -= 3;
  return cloud;
}

template <typename T>
bool SameBits(const T& a, const T& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0);
}

void ExpectSame(const GaussianCloud& a, const GaussianCloud& b) {
  EXPECT_EQ(a.sh_degree, b.sh_degree);
  EXPECT_EQ(a.render_mode, b.render_mode);
  EXPECT_EQ(a.comments, b.comments);
  EXPECT_EQ(a.origin, b.origin);
  EXPECT_TRUE(SameBits(a.means, b.means));
  EXPECT_TRUE(SameBits(a.log_scales, b.log_scales));
  EXPECT_TRUE(SameBits(a.quats, b.quats));
  EXPECT_TRUE(SameBits(a.opacity_logits, b.opacity_logits));
  EXPECT_TRUE(SameBits(a.sh, b.sh));
}

TEST(EditClouds, GivesTheBitsOfFiles) {
  const TestFolder folder;
  GaussianCloud a = CloudWithNonFinite(9'001, 2), b = SplatOf(5'003, 1, 5);
  a.origin = {1000, 2000, 30};
  a.comments = {"credit: somebody"};
  b.comments = {"world up: 0 0 1"};
  ASSERT_TRUE(WritePlyWithExtras(folder / "a.ply", a, {}, {}).ok());
  ASSERT_TRUE(WritePlyWithExtras(folder / "b.ply", b, {}, {}).ok());
  const Words of_one = {{"--filter-nan", ""}, {"--rotate", "10,20,30"}, {"--filter-harmonics", "1"}};
  const Words of_other = {{"--translate", "-1000,-2000,30"}, {"--filter-floaters", ""}, {"--mirror", "x"}};
  const Words of_both = {{"--scale", "0.5"}, {"--filter-value", "f_rest_2,lt,0.2"}, {"--filter-value", "x,gt,-600"}};
  EditJob job{.inputs = {{folder / "a.ply", AlongLuf(of_one)}, {folder / "b.ply", AlongLuf(of_other)}},
              .actions = AlongLuf(of_both)};
  const auto files = EditFiles(job, folder / "o.ply");
  ASSERT_TRUE(files.ok()) << files.error().message;
  const auto written = OpenedSplat::Open(folder / "o.ply")->Read();
  ASSERT_TRUE(written.ok());
  for (const int threads : {1, 3}) {
    const RunScope run({.threads = threads});
    const std::vector<CloudView> clouds = {a, b};
    const std::vector<EditRun> runs = {{0, 1, AlongLuf(of_one)}, {1, 1, AlongLuf(of_other)}, {0, 2, AlongLuf(of_both)}};
    const auto edited = EditClouds(clouds, runs);
    ASSERT_TRUE(edited.ok()) << edited.error().message;
    ExpectSame(edited->cloud, *written);
    ASSERT_EQ(edited->steps.size(), files->steps.size());
    for (size_t k = 0; k < files->steps.size(); ++k) {
      EXPECT_EQ(edited->steps[k].action, files->steps[k].action);
      EXPECT_EQ(edited->steps[k].taken, files->steps[k].taken);
      EXPECT_EQ(edited->steps[k].left, files->steps[k].left);
      EXPECT_EQ(edited->steps[k].axes, files->steps[k].axes);
    }
    EXPECT_EQ(edited->steps[0].input, "cloud 1");
    EXPECT_EQ(edited->steps[3].input, "cloud 2");
    EXPECT_EQ(edited->steps[6].input, "");
  }
}

TEST(EditClouds, WithoutRunsIsACopyAndOneOfNothingIsNothing) {
  const GaussianCloud cloud = SplatOf(3'000, 3, 1);
  const std::vector<CloudView> one = {cloud};
  ExpectSame(EditClouds(one, {})->cloud, cloud);
  const std::vector<EditRun> runs = {{0, 1, AlongLuf({{"--filter-sphere", "90,0,0,1"}, {"--translate", "1,2,3"}})}};
  const auto nothing = EditClouds(one, runs);
  ASSERT_TRUE(nothing.ok());
  EXPECT_TRUE(nothing->cloud.empty());
  EXPECT_EQ(nothing->steps[0].taken, 3'000);
}

TEST(EditClouds, WhatABoxRemovesIsWhatItWouldKeep) {
  const GaussianCloud cloud = SplatOf(2'000, 1, 3);
  const std::vector<CloudView> one = {cloud};
  const char* const box = "-0.5,-0.5,-0.5,0.5,0.5,-";
  const std::vector<EditRun> keeps = {{0, 1, AlongLuf({{"--filter-box", box}})}},
                             removes = {{0, 1, AlongLuf({{"--remove-box", box}})}};
  const auto kept = EditClouds(one, keeps), rest = EditClouds(one, removes);
  ASSERT_TRUE(kept.ok() && rest.ok());
  EXPECT_GT(kept->cloud.size(), 0);
  EXPECT_GT(rest->cloud.size(), 0);
  EXPECT_EQ(kept->cloud.size() + rest->cloud.size(), cloud.size());
  EXPECT_EQ(kept->steps[0].taken, rest->cloud.size());
}

TEST(EditClouds, NamesTheCloudThatHasNotAProperty) {
  const GaussianCloud cloud = SplatOf(10, 0, 1);
  const std::vector<CloudView> one = {cloud}, two = {cloud, cloud};
  const std::vector<EditRun> runs = {{0, 1, AlongLuf({{"--filter-value", "label,gt,1"}})}};
  EXPECT_THAT(EditClouds(one, runs).error().message,
              HasSubstr("the cloud: --filter-value label,gt,1: there is no property 'label'"));
  EXPECT_THAT(EditClouds(two, runs).error().message, HasSubstr("cloud 1: --filter-value"));
}

}  // namespace
}  // namespace anchorsplat
