#include "edit/edit_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "core/messages_for_test.h"
#include "core/parallel.h"
#include "core/splat_comments.h"
#include "core/world_up.h"
#include "formats/opened_splat.h"
#include "formats/ply/ply_writer.h"
#include "formats/random_cloud_for_test.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Words = std::vector<std::pair<const char*, const char*>>;

std::vector<EditAction> Actions(const Words& words, const Axes& axes = kRdf) {
  std::vector<EditAction> actions;
  for (const auto& [name, text] : words) {
    const auto action = ParseAction(name, text, axes);
    EXPECT_TRUE(action.ok()) << (action.ok() ? "" : action.error().message);
    actions.push_back(*action);
  }
  return actions;
}

GaussianCloud Splat(int64_t n, int degree, uint64_t seed) {
  GaussianCloud cloud = RandomCloud(n, degree, seed);
  for (float& x : cloud.log_scales) x -= 3;
  return cloud;
}

// With a label, which is the row, normals, and some values that are no numbers.
std::filesystem::path WithLabels(const TestFolder& folder, const std::string& name, const GaussianCloud& cloud,
                                 bool labels = true) {
  ExtraProperties extras;
  if (labels) extras.properties = {{"label", PlyType::kInt32}};
  extras.rows.resize(static_cast<size_t>(cloud.size()) * extras.row_size());
  for (int64_t i = 0; labels && i < cloud.size(); ++i) {
    const auto label = static_cast<int32_t>(i);
    std::memcpy(extras.rows.data() + 4 * i, &label, sizeof label);
  }
  extras.normals.resize(cloud.means.size());
  for (size_t i = 0; i < extras.normals.size(); ++i) extras.normals[i] = static_cast<float>(i % 7) - 3;
  EXPECT_TRUE(WritePlyWithExtras(folder / name, cloud, {.overwrite = true}, extras).ok());
  return folder / name;
}

GaussianCloud ReadOf(const std::filesystem::path& path, ExtraProperties* extras = nullptr) {
  auto cloud = OpenedSplat::Open(path)->Read({}, extras);
  EXPECT_TRUE(cloud.ok());
  return *std::move(cloud);
}

TEST(EditFiles, StreamsGiveTheSameBitsAsMemory) {
  const TestFolder folder;
  GaussianCloud a = CloudWithNonFinite(9'001, 3), b = Splat(5'003, 1, 5);
  a.origin = {1000, 2000, 30};
  b.comments = {"world up: 0 0 1", "credit: somebody"};
  const auto one = WithLabels(folder, "a.ply", a), two = WithLabels(folder, "b.ply", b, false);
  const std::vector<Words> chains = {
      {{"--translate", "1,2,3"}},
      {{"--filter-nan", ""}, {"--rotate", "10,20,30"}, {"--scale", "0.5"}, {"--filter-box", "-,-,-,1000,-,-"}},
      {{"--filter-value", "label,gte,4000"}, {"--mirror", "y"}, {"--filter-harmonics", "1"}},
      {{"--up", "1,1,0"}, {"--filter-value", "f_rest_2,lt,0.2"}, {"--filter-value", "rot_1,gt,-1"}},
      {{"--filter-floaters", ""}, {"--origin", "1000,2000,30"}, {"--filter-sphere", "0,0,0,2"}}};
  for (size_t c = 0; c < chains.size(); ++c) {
    for (const bool merges : {false, true}) {
      SCOPED_TRACE(std::to_string(c) + (merges ? " merged" : ""));
      EditJob job{.inputs = {{one, Actions(chains[c])}}, .actions = Actions({{"--filter-value", "opacity,gt,0.3"}})};
      if (merges) job.inputs.push_back({two, Actions({{"--translate", "1000,2000,30"}})});
      job.convert.write.overwrite = true;
      job.convert.min_opacity = 0.35f;
      const Messages messages;
      const auto streamed = EditFiles(job, folder / "stream.ply");
      ASSERT_TRUE(streamed.ok()) << streamed.error().message;
      EXPECT_TRUE(streamed->streamed);
      const std::vector<std::string> warnings = messages.warnings();
      GaussianCloud kept;
      const Messages others;
      const auto whole = EditFiles(job, folder / "memory.ply", &kept);
      ASSERT_TRUE(whole.ok());
      EXPECT_FALSE(whole->streamed);
      EXPECT_EQ(FileBytes(folder / "stream.ply"), FileBytes(folder / "memory.ply"));
      EXPECT_EQ(warnings.size(), others.warnings().size());
      ASSERT_EQ(streamed->steps.size(), whole->steps.size());
      for (size_t k = 0; k < whole->steps.size(); ++k) {
        EXPECT_EQ(streamed->steps[k].action, whole->steps[k].action);
        EXPECT_EQ(streamed->steps[k].taken, whole->steps[k].taken);
        EXPECT_EQ(streamed->steps[k].left, whole->steps[k].left);
      }
      EXPECT_EQ(streamed->convert.gaussians_written, whole->convert.gaussians_written);
      EXPECT_EQ(streamed->convert.sh_degree_written, whole->convert.sh_degree_written);
      job.dry_run = true;
      const auto dry = EditFiles(job, folder / "none.ply");
      ASSERT_TRUE(dry.ok());
      EXPECT_EQ(dry->convert.gaussians_written, whole->convert.gaussians_written);
      EXPECT_TRUE(whole->convert.predicted_bytes.has_value());
      EXPECT_EQ(dry->convert.predicted_bytes, whole->convert.predicted_bytes);
      EXPECT_EQ(streamed->convert.predicted_bytes, whole->convert.predicted_bytes);
      EXPECT_FALSE(std::filesystem::exists(folder / "none.ply"));
    }
  }
}

TEST(EditFiles, TheOrderCounts) {
  const TestFolder folder;
  const auto input = WithLabels(folder, "a.ply", Splat(2'000, 0, 1));
  const auto left = [&](const Words& words) {
    const auto report =
        EditFiles({.inputs = {{input, {}}}, .actions = Actions(words), .dry_run = true}, folder / "o.ply");
    EXPECT_TRUE(report.ok());
    return report->convert.gaussians_written;
  };
  const int64_t first = left({{"--filter-sphere", "0,0,0,1"}, {"--scale", "2"}});
  const int64_t last = left({{"--scale", "2"}, {"--filter-sphere", "0,0,0,1"}});
  EXPECT_GT(first, last);
  EXPECT_EQ(last, left({{"--filter-sphere", "0,0,0,0.5"}}));
  EXPECT_EQ(left({{"--translate", "5,0,0"}, {"--filter-box", "5,-,-,-,-,-"}}), left({{"--filter-box", "0,-,-,-,-,-"}}));
  EXPECT_EQ(left({{"--rotate", "0,0,90"}, {"--filter-value", "y,gt,0.5"}}), left({{"--filter-value", "x,gt,0.5"}}));
  EXPECT_EQ(left({{"--scale", "2"}, {"--filter-value", "scale_0,lt,0.1"}}),
            left({{"--filter-value", "scale_0,lt,0.05"}}));
}

// As splat-transform 3.7 bakes a PLY into its own axes first: turned by half about z, quaternion (0, 0, 0, 1)·q.
TEST(EditFiles, DirectionsInValuesAreAlongTheAxes) {
  const TestFolder folder;
  const GaussianCloud cloud = Splat(2'000, 2, 1);
  const auto input = WithLabels(folder, "a.ply", cloud);
  const auto left = [&](const Words& words, const Axes& axes) {
    const auto report =
        EditFiles({.inputs = {{input, {}}}, .actions = Actions(words, axes), .dry_run = true}, folder / "o.ply");
    EXPECT_TRUE(report.ok());
    return report->convert.gaussians_written;
  };
  for (const char* value : {"x,gt,0.2", "z,gt,0.2", "rot_0,gt,0.1", "rot_3,lt,0.2", "f_rest_4,gt,0.1", "f_rest_11,lt,0",
                            "scale_1,gt,0.01", "opacity,lt,0.4"}) {
    SCOPED_TRACE(value);
    EXPECT_EQ(left({{"--filter-value", value}}, kLuf),
              left({{"--rotate", "0,0,180"}, {"--filter-value", value}}, kRdf));
  }
  const auto above = [&](size_t column, float sign) {
    int64_t count = 0;
    for (size_t i = column; i < cloud.quats.size(); i += 4) count += sign * cloud.quats[i] > 0.1f ? 1 : 0;
    return count;
  };
  EXPECT_EQ(left({{"--filter-value", "rot_0,gt,0.1"}}, kLuf), above(3, -1));
  EXPECT_EQ(left({{"--filter-value", "rot_2,gt,0.1"}}, kLuf), above(1, 1));
  EXPECT_EQ(left({{"--filter-value", "rot_2,gt,0.1"}}, kRdf), above(2, 1));
}

TEST(EditFiles, NormalsAndOtherPropertiesAreNumbersToo) {
  const TestFolder folder;
  const GaussianCloud cloud = Splat(100, 0, 1);
  ExtraProperties extras;
  extras.properties = {{"weight", PlyType::kFloat}};
  extras.normals.resize(300);
  extras.normals[3 * 7 + 1] = NAN;
  std::vector<float> weights(100, 1.0f);
  weights[9] = INFINITY;
  extras.rows.resize(400);
  std::memcpy(extras.rows.data(), weights.data(), 400);
  ASSERT_TRUE(WritePlyWithExtras(folder / "a.ply", cloud, {}, extras).ok());
  EditJob job{.inputs = {{folder / "a.ply", Actions({{"--filter-nan", ""}})}}};
  GaussianCloud kept;
  for (GaussianCloud* const whole : {static_cast<GaussianCloud*>(nullptr), &kept}) {
    job.convert.write.overwrite = true;
    EXPECT_EQ(EditFiles(job, folder / "o.ply", whole)->convert.gaussians_written, 98);
  }
}

TEST(EditFiles, EachActionSaysWhatItTook) {
  const TestFolder folder;
  GaussianCloud cloud = Splat(1'000, 0, 1);
  for (size_t i = 0; i < 1000; ++i) cloud.opacity_logits[i] = i < 400 ? -3.0f : 3.0f;
  cloud.means[0] = NAN;
  const auto input = WithLabels(folder, "a.ply", cloud);
  const auto report = EditFiles(
      {.inputs = {{input, {}}},
       .actions =
           Actions({{"--filter-nan", ""}, {"--filter-value", "opacity,gt,0.5"}, {"--filter-value", "label,lt,600"}})},
      folder / "o.ply");
  ASSERT_TRUE(report.ok());
  ASSERT_EQ(report->steps.size(), 3u);
  EXPECT_EQ(report->steps[0].taken, 1);
  EXPECT_EQ(report->steps[1].taken, 399);
  EXPECT_EQ(report->steps[2].taken, 400);
  EXPECT_EQ(report->steps[2].left, 200);
  ExtraProperties extras;
  const GaussianCloud out = ReadOf(folder / "o.ply", &extras);
  ASSERT_EQ(out.size(), 200);
  for (int32_t i = 0; i < 200; ++i) {
    int32_t label = 0;
    std::memcpy(&label, extras.rows.data() + 4 * i, sizeof label);
    EXPECT_EQ(label, 400 + i);
    EXPECT_EQ(extras.normals[static_cast<size_t>(3 * i)], static_cast<float>(3 * (400 + i) % 7) - 3);
  }
}

TEST(EditFiles, WhatASplatSaysOfItselfStays) {
  const TestFolder folder;
  GaussianCloud cloud = Splat(100, 2, 1);
  cloud.render_mode = RenderMode::kMip;
  const std::string mark = std::string(kEnhancedMark) + "model, 4 times closer";
  cloud.comments = {"credit: somebody", mark, "trained over: 1 1 1", "world up: 0 0 1"};
  const auto input = WithLabels(folder, "a.ply", cloud);
  ASSERT_TRUE(
      EditFiles({.inputs = {{input, Actions({{"--rotate", "90,0,0"}, {"--scale", "3"}})}}}, folder / "o.ply").ok());
  const GaussianCloud out = ReadOf(folder / "o.ply");
  EXPECT_EQ(out.render_mode, RenderMode::kMip);
  EXPECT_THAT(out.comments, ElementsAre("credit: somebody", mark, "trained over: 1 1 1", "world up: 0 -1 0"));
  // A plain splat does not become a marked one, and what up is, is known once it has been said.
  cloud.comments = {};
  const auto plain = WithLabels(folder, "b.ply", cloud);
  ASSERT_TRUE(EditFiles({.inputs = {{plain, Actions({{"--scale", "3"}})}}}, folder / "p.ply").ok());
  EXPECT_THAT(ReadOf(folder / "p.ply").comments, IsEmpty());
  ASSERT_TRUE(EditFiles({.inputs = {{plain, Actions({{"--up", "z"}})}}}, folder / "q.ply").ok());
  EXPECT_THAT(ReadOf(folder / "q.ply").comments, ElementsAre(UpComment(kUsualUp)));
}

TEST(EditFiles, MergedSplatsStandBehindEachOther) {
  const TestFolder folder;
  GaussianCloud a = Splat(50, 1, 1), b = Splat(70, 3, 2);
  a.comments = {"credit: one", std::string(kEnhancedMark) + "model, 4 times closer", "world up: 0 -1 0"};
  b.comments = {"credit: two", "credit: one", "world up: 0 0 1"};
  b.render_mode = RenderMode::kMip;
  const Messages messages;
  const auto report = EditFiles({.inputs = {{WithLabels(folder, "a.ply", a), Actions({{"--translate", "1,0,0"}})},
                                            {WithLabels(folder, "b.ply", b, false), {}}}},
                                folder / "o.ply");
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->convert.gaussians_read, 120);
  ExtraProperties extras;
  const GaussianCloud out = ReadOf(folder / "o.ply", &extras);
  ASSERT_EQ(out.size(), 120);
  EXPECT_EQ(out.sh_degree, 3);
  EXPECT_EQ(out.means[0], a.means[0] + 1);
  EXPECT_EQ(out.means[150], b.means[0]);
  EXPECT_EQ(out.sh[48 * 50 + 47], b.sh[47]);
  EXPECT_EQ(out.sh[12], 0);
  EXPECT_EQ(out.render_mode, std::nullopt);
  EXPECT_TRUE(extras.properties.empty());
  EXPECT_EQ(extras.normals.size(), 360u);
  EXPECT_THAT(out.comments, ElementsAre("credit: one", std::string(kPartEnhancedMark) + "model, 4 times closer",
                                        "world up: 0 -1 0", "credit: two"));
  EXPECT_THAT(messages.warnings(), Contains(HasSubstr("different render modes")));
  EXPECT_THAT(messages.warnings(), Contains(HasSubstr("\"label\" of some")));
}

TEST(EditFiles, MapsComeToWhereFloatsAreFine) {
  const TestFolder folder;
  GaussianCloud cloud = Splat(500, 0, 1);
  for (float& x : cloud.log_scales) x -= 4;
  cloud.origin = {500'000, 4'500'000, 120};
  const auto input = WithLabels(folder, "a.ply", cloud);
  ASSERT_TRUE(EditFiles({.inputs = {{input, Actions({{"--origin", "500000,4500000,120"}})}}}, folder / "o.ply").ok());
  const GaussianCloud out = ReadOf(folder / "o.ply");
  EXPECT_TRUE(IsZero(out.origin));
  EXPECT_TRUE(SameBits(out.means, cloud.means));
  ASSERT_TRUE(
      EditFiles({.inputs = {{folder / "o.ply", Actions({{"--translate", "500000,4500000,120"}})}}}, folder / "p.ply")
          .ok());
  const GaussianCloud back = ReadOf(folder / "p.ply");
  EXPECT_FALSE(IsZero(back.origin));
  for (size_t i = 0; i < 30; ++i) {
    EXPECT_NEAR(back.origin[i % 3] + double{back.means[i]}, cloud.origin[i % 3] + double{cloud.means[i]}, 1e-4);
  }
  // A short way is not worth an origin, which other programs do not know.
  ASSERT_TRUE(
      EditFiles({.inputs = {{folder / "o.ply", Actions({{"--translate", "100,0,0"}})}}}, folder / "q.ply").ok());
  EXPECT_TRUE(IsZero(ReadOf(folder / "q.ply").origin));
}

TEST(EditFiles, OtherFormatsAreEditedInMemory) {
  const TestFolder folder;
  const auto input = WithLabels(folder, "a.ply", Splat(800, 3, 4));
  const Words words = {{"--rotate", "5,6,7"}, {"--filter-value", "opacity,gt,0.4"}};
  ASSERT_TRUE(EditFiles({.inputs = {{input, Actions(words)}}}, folder / "o.spz").ok());
  ASSERT_TRUE(EditFiles({.inputs = {{input, Actions(words)}}}, folder / "o.ply").ok());
  ASSERT_TRUE(ConvertFile(folder / "o.ply", folder / "p.spz", {}).ok());
  EXPECT_EQ(FileBytes(folder / "o.spz"), FileBytes(folder / "p.spz"));
  EditJob most{.inputs = {{folder / "o.spz", Actions({{"--filter-sphere", "0,0,0,9"}})}}};
  most.convert.max_gaussians = 100;
  const auto report = EditFiles(most, folder / "q.ply");
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->convert.gaussians_written, 100);
  EXPECT_EQ(report->steps.back().action, "--max-gaussians 100");
}

TEST(EditFiles, ErrorsNameTheActionAndTheFile) {
  const TestFolder folder;
  const auto input = WithLabels(folder, "a.ply", Splat(20, 1, 4));
  const auto error = [&](const Words& words, const std::filesystem::path& output) {
    const auto report = EditFiles({.inputs = {{input, Actions(words)}}}, output);
    EXPECT_FALSE(report.ok());
    return report.ok() ? "" : report.error().message;
  };
  EXPECT_THAT(error({{"--filter-value", "confidence,gt,1"}}, folder / "o.ply"),
              HasSubstr(input.string() + ": --filter-value confidence,gt,1: there is no property 'confidence'"));
  EXPECT_THAT(error({{"--filter-value", "f_rest_9,gt,1"}}, folder / "o.ply"),
              HasSubstr("there is no property 'f_rest_9'"));
  EXPECT_THAT(error({{"--filter-sphere", "50,0,0,1"}}, folder / "o.ply"),
              HasSubstr("--filter-sphere 50,0,0,1 removes the last 20 Gaussians: nothing to write"));
  EXPECT_THAT(error({{"--scale", "2"}}, input), HasSubstr("a.ply"));
  EXPECT_THAT(error({{"--scale", "2"}}, folder / "o.txt"), HasSubstr("no splat extension"));
}

}  // namespace
}  // namespace anchorsplat
