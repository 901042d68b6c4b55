#include "eval/reading_row.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/source_dir_for_test.h"
#include "core/text.h"
#include "formats/cloud_io.h"
#include "io/folder_for_test.h"
#include "reading/features.h"

namespace anchorsplat {
namespace {

using ::testing::HasSubstr;

std::filesystem::path Lantern() { return SourceDirForTest() / "examples/stone_lantern"; }

// Every sixteenth Gaussian of it, without a tag.
GaussianCloud Sparse() {
  const GaussianCloud cloud = *ReadCloud(Lantern() / "input.ply");
  std::vector<int64_t> rows;
  for (int64_t i = 0; i < cloud.size(); i += 16) rows.push_back(i);
  GaussianCloud out = *Subset(cloud, rows);
  out.render_mode.reset();
  out.comments.clear();
  return out;
}

class ReadingRowMaking : public ::testing::Test {
 protected:
  ReadingTask Task(const GaussianCloud& cloud) {
    ReadingTask task;
    task.id = "it";
    task.labels[3] = "standard";
    task.splat = folder_ / "it.ply";
    task.object = Lantern();
    EXPECT_TRUE(WriteCloud(task.splat, cloud, {.overwrite = true}).ok());
    return task;
  }
  nlohmann::json Make(const ReadingTask& task) {
    ReadingRows rows(1);
    auto row = rows.Make(task);
    EXPECT_TRUE(row.ok()) << (row.ok() ? "" : row.error().message);
    return row.ok() ? *row : nlohmann::json();
  }
  TestFolder folder_;
};

TEST_F(ReadingRowMaking, HasGainsOfBothModesAndWhatIsDoneToday) {
  const nlohmann::json row = Make(Task(Sparse()));
  EXPECT_EQ(row["id"], "it");
  EXPECT_EQ(row["kind"], "standard");
  EXPECT_EQ(row["tag"], nullptr);
  EXPECT_EQ(row["upscale"], 4);
  EXPECT_NEAR(row["pixel"].get<double>(), 1.7 / 309.02, 5e-4);  // distance over focal length
  EXPECT_GT(row["raw"].get<double>(), 10);
  for (const char* mode : {"classic", "antialiased"}) {
    EXPECT_EQ(row["gains"][mode]["filter"].size(), 7u);
    EXPECT_EQ(row["gains"][mode]["network"].size(), 7u);
  }
  EXPECT_EQ(row["features"].size(), FeatureNames().size());
}

TEST_F(ReadingRowMaking, HasPixelsAloneWhereNothingElseIsAskedFor) {
  ReadingTask task = Task(Sparse());
  const nlohmann::json whole = Make(task);
  task.measure = false;
  const nlohmann::json row = Make(task);
  EXPECT_EQ(row["pixel"], whole["pixel"]);
  EXPECT_EQ(row["features"], whole["features"]);
  EXPECT_FALSE(row.contains("gains"));
}

TEST_F(ReadingRowMaking, SaysWhatTheProgramDoesByItself) {
  ReadingTask task = Task(*ReadCloud(Lantern() / "input.ply"));
  task.model = SourceDirForTest() / "models/reading.safetensors";
  const nlohmann::json row = Make(task);
  EXPECT_FALSE(row.contains("gains"));
  EXPECT_EQ(row["method"], "network");
  EXPECT_EQ(row["made"], "classic");
  EXPECT_GT(row["gain"].get<double>(), 1);
  EXPECT_LT(row["low"], row["high"]);
  EXPECT_GT(row["pixel"].get<double>(), 0.2 * row["low"].get<double>());
  task.model = task.splat;
  EXPECT_FALSE(ReadingRows(1).Make(task).ok());
}

TEST_F(ReadingRowMaking, HasPlacesWhereTheyAreAskedFor) {
  ReadingTask task = Task(*ReadCloud(Lantern() / "input.ply"));
  task.measure = false;
  task.places = 2;
  const nlohmann::json row = Make(task);
  ASSERT_EQ(row["places"].size(), 2u);
  for (const nlohmann::json& place : row["places"]) {
    EXPECT_EQ(place["features"].size(), FeatureNames().size());
    EXPECT_NEAR(place["pixel"].get<double>() / row["pixel"].get<double>(), 1, 0.1);
  }
}

TEST_F(ReadingRowMaking, IsOfItsTaskAndItsFiles) {
  const ReadingTask task = Task(Sparse());
  const std::string state = ReadingRows(1).StateOf(task);
  EXPECT_EQ(Make(task)["state"], state);
  EXPECT_NE(ReadingRows(2).StateOf(task), state);
  ReadingTask elsewhere = task;
  elsewhere.object = SourceDirForTest() / "examples/biplane";
  EXPECT_NE(ReadingRows(1).StateOf(elsewhere), state);
  ReadingTask other = task;
  other.words = "others";
  EXPECT_NE(ReadingRows(1).StateOf(other), state);
  ASSERT_TRUE(WriteCloud(task.splat, *Subset(Sparse(), std::vector<int64_t>{0, 1, 2}), {.overwrite = true}).ok());
  EXPECT_NE(ReadingRows(1).StateOf(task), state);
}

TEST_F(ReadingRowMaking, OfATaggedSplatIsInItsMode) {
  GaussianCloud cloud = Sparse();
  cloud.render_mode = RenderMode::kMip;
  const nlohmann::json row = Make(Task(cloud));
  EXPECT_EQ(row["tag"], "mip");
  EXPECT_EQ(row["gains"].size(), 1u);
  EXPECT_TRUE(row["gains"].contains("mip"));
}

// Gains are those of the splat in its own place: cameras follow it.
TEST_F(ReadingRowMaking, FollowsASplatThatWasMoved) {
  const nlohmann::json here = Make(Task(Sparse()));
  GaussianCloud cloud = Sparse();
  for (size_t i = 0; i < cloud.means.size(); ++i) {
    cloud.means[i] = 7 * cloud.means[i] + 3;
    cloud.log_scales[i] += std::log(7.0f);
  }
  ReadingTask task = Task(cloud);
  task.moved.scale = 7;
  task.moved.translation = {3, 3, 3};
  const nlohmann::json there = Make(task);
  EXPECT_NEAR(there["pixel"].get<double>() / here["pixel"].get<double>(), 7, 1e-3);
  EXPECT_NEAR(there["raw"].get<double>(), here["raw"].get<double>(), 1e-2);
  for (size_t k = 0; k < 7; ++k) {
    EXPECT_NEAR(there["gains"]["classic"]["filter"][k].get<double>(),
                here["gains"]["classic"]["filter"][k].get<double>(), 1e-2);
  }
}

// What was added is not drawn, what was cut off is: both show the whole.
TEST_F(ReadingRowMaking, OfEditsIsMeasuredOnTheSubject) {
  const GaussianCloud whole = Sparse();
  const double raw = Make(Task(whole))["raw"];
  GaussianCloud more = whole, far = whole;
  for (size_t i = 0; i < far.means.size(); i += 3) far.means[i] += 5;
  ASSERT_TRUE(Append(more, far).ok());
  ReadingTask merged = Task(more);
  merged.keep = Region{{-1, -1, -1}, {1, 1, 1}, {}};
  merged.others_from = whole.size();
  merged.others_pixel = 0.5;
  const nlohmann::json row = Make(merged);
  EXPECT_NEAR(row["raw"].get<double>(), raw, 1e-3);
  EXPECT_GT(row["pixel_90"].get<double>(), 0.4);
  EXPECT_LT(row["pixel_10"].get<double>(), 0.01);

  std::vector<int64_t> left, right;
  for (int64_t i = 0; i < whole.size(); ++i) (whole.means[static_cast<size_t>(3 * i)] < 0 ? left : right).push_back(i);
  ReadingTask part = Task(*Subset(whole, left));
  part.context = folder_ / "rest.ply";
  ASSERT_TRUE(WriteCloud(part.context, *Subset(whole, right)).ok());
  EXPECT_NEAR(Make(part)["raw"].get<double>(), raw, 3);  // the rest is filtered
}

TEST_F(ReadingRowMaking, OfAStrangersSplatHasFeaturesAlone) {
  ReadingTask task = Task(Sparse());
  task.object.clear();
  const nlohmann::json row = Make(task);
  EXPECT_EQ(row["pixel"], nullptr);
  EXPECT_FALSE(row.contains("gains"));
  EXPECT_EQ(row["features"].size(), FeatureNames().size());
}

TEST_F(ReadingRowMaking, OfTooFewGaussiansHasGainsAlone) {
  const nlohmann::json row = Make(Task(*Subset(Sparse(), std::vector<int64_t>{0, 1, 2})));
  EXPECT_FALSE(row.contains("features"));
  EXPECT_THAT(row["why_no_features"].get<std::string>(), HasSubstr("fewer than"));
  EXPECT_EQ(row["gains"]["classic"]["filter"].size(), 7u);
}

TEST_F(ReadingRowMaking, BadTasksAreRefused) {
  const auto refused = [](const char* text) {
    const auto task = ReadingTaskFrom(nlohmann::json::parse(text));
    return task.ok() ? "" : task.error().message;
  };
  EXPECT_EQ(refused(R"({"id":"a","splat":"a.ply","object":"o","kind":"k","keep":[0,0,0,1,1,1]})"), "");
  EXPECT_THAT(refused(R"({"id":"a","splat":"a.ply","keep":[0,0,0,1,1,1]})"), HasSubstr("need an object"));
  EXPECT_THAT(refused(R"({"id":"a\nb","splat":"a.ply"})"), HasSubstr("an id must be a file name"));
  EXPECT_THAT(refused(R"({"id":"a","splat":"a.ply","downscale":1.5})"), HasSubstr("whole number"));
  EXPECT_THAT(
      refused(
          R"({"id":"a","splat":"a.ply","moved":{"scale":1,"rotation":[1,0,0,0,1,0,0,0,1,0],"translation":[0,0,0]}})"),
      HasSubstr("nine numbers"));
  EXPECT_EQ(
      refused(R"({"id":"an-id-may-be-longer-than-what-messages-quote-of-a-text-of-somebody-else's","splat":"a"})"), "");
  EXPECT_EQ(refused(R"({"id":"a","splat":"a","object":"o","model":"m"})"), "");
  EXPECT_THAT(refused(R"({"id":"a","splat":"a","model":"m"})"), HasSubstr("need an object"));
  EXPECT_THAT(refused(R"({"id":"a","splat":"a","object":"o","model":"m","measure":false})"),
              HasSubstr("model needs measure"));
  EXPECT_EQ(refused(R"({"id":"a","splat":"a","object":"o","places":3})"), "");
  EXPECT_THAT(refused(R"({"id":"a","splat":"a","places":3})"), HasSubstr("need an object"));
  EXPECT_THAT(refused(R"({"id":"a","splat":"a","object":"o","places":1.5})"), HasSubstr("whole number"));
  EXPECT_THAT(refused(R"({"id":"a","splat":"a","object":"o","places":-1})"), HasSubstr("whole number"));
  EXPECT_THAT(refused(R"([])"), HasSubstr("not a JSON object"));
  EXPECT_THAT(refused(R"({"id":"a"})"), HasSubstr("splat is missing"));
  EXPECT_THAT(refused(R"({"id":"a","splat":"a.ply","pixel":3})"), HasSubstr("unknown property pixel"));
  EXPECT_THAT(refused(R"({"id":"a","splat":"a.ply","keep":[0]})"), HasSubstr("neither a box"));
  EXPECT_THAT(refused(R"({"id":"a","splat":3})"), HasSubstr("another type"));
  EXPECT_THAT(
      refused(R"({"id":"a","splat":"a","moved":{"scale":0,"rotation":[1,0,0,0,1,0,0,0,1],"translation":[0,0,0]}})"),
      HasSubstr("scale"));
  for (const char* id : {"../a", "..", ".a"}) {
    EXPECT_THAT(refused(Cat(R"({"id":")", id, R"(","splat":"a.ply"})").c_str()),
                HasSubstr("an id must be a file name"));
  }
  EXPECT_THAT(refused(R"({"id":"a","splat":"a","downscale":0})"), HasSubstr("downscale"));
  EXPECT_THAT(
      refused(R"({"id":"a","splat":"a","moved":{"scale":1,"rotation":[0,0,0,0,0,0,0,0,0],"translation":[0,0,0]}})"),
      HasSubstr("not a rotation"));
  EXPECT_THAT(refused(R"({"id":"a","splat":"a","others":{"from":0,"pixel":1}})"), HasSubstr("others"));
  ReadingTask task = Task(Sparse());
  task.others_from = 1'000'000;
  task.others_pixel = 1;
  ReadingRows rows(1);
  EXPECT_THAT(rows.Make(task).error().message, HasSubstr("others start beyond"));
  ReadingTask elsewhere = Task(Sparse());
  elsewhere.keep = Region{{5, 5, 5}, {6, 6, 6}, {}};
  EXPECT_THAT(rows.Make(elsewhere).error().message, HasSubstr("no Gaussian lies in the region"));
}

}  // namespace
}  // namespace anchorsplat
