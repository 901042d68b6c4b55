#include "dataset/dataset_check.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "dataset/dataset_split.h"
#include "dataset/small_dataset_for_test.h"
#include "dataset/unfinished_objects.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

class DatasetCheckTest : public testing::Test {
 protected:
  void SetUp() override {
    const std::string mesh = WriteTetrahedron(folder_.path(), "tetra");
    for (const char* name : {"a", "b"}) {
      ObjectJob job = SmallJob(mesh, name);
      job.settings.views.store_high = job.name == "a";
      const auto record = BuildObject(job, set_);
      ASSERT_TRUE(record.ok()) << record.error().message;
      manifest_.emplace(name, *record);
    }
    ASSERT_TRUE(WriteManifest(set_, manifest_).ok());
  }

  // All problems in one text.
  std::string Problems(bool decode = false) {
    const auto problems = CheckDataset(set_, {.decode = decode});
    EXPECT_TRUE(problems.ok());
    std::string text;
    for (const DatasetProblem& p : *problems) text += p.object + " | " + p.sentence + "\n";
    return text;
  }

  TestFolder folder_;
  fs::path set_ = folder_ / "set";
  Manifest manifest_;
};

TEST_F(DatasetCheckTest, NothingToComplainAbout) {
  EXPECT_EQ(Problems(), "");
  EXPECT_EQ(Problems(true), "");
}

TEST_F(DatasetCheckTest, FindsWhatIsMissing) {
  fs::remove(set_ / "a/24/images/003.png");
  EXPECT_NE(Problems().find("picture 003 is missing"), std::string::npos);
  fs::remove(set_ / "b/mesh.safetensors");
  EXPECT_NE(Problems().find("mesh.safetensors"), std::string::npos);
  fs::remove(set_ / "b/splat.ply");
  EXPECT_NE(Problems().find("b | "), std::string::npos);
  fs::remove_all(set_ / "a");
  EXPECT_NE(Problems().find("a | "), std::string::npos);
}

TEST_F(DatasetCheckTest, FindsPicturesOfAnotherSize) {
  fs::copy_file(set_ / "a/12/images/000.png", set_ / "a/24/images/000.png", fs::copy_options::overwrite_existing);
  EXPECT_NE(Problems().find("12 x 12"), std::string::npos);
}

TEST_F(DatasetCheckTest, DecodingFindsDamagedPixels) {
  const fs::path path = set_ / "a/12/images/004.png";
  fs::resize_file(path, fs::file_size(path) - 20);
  EXPECT_EQ(Problems(false), "");
  EXPECT_NE(Problems(true).find("004.png"), std::string::npos);
}

TEST_F(DatasetCheckTest, FindsOtherSplatsAndOtherRecords) {
  fs::copy_file(set_ / "b/record.json", set_ / "a/record.json", fs::copy_options::overwrite_existing);
  manifest_.at("b").gaussians += 1;
  ASSERT_TRUE(WriteManifest(set_, manifest_).ok());
  const std::string problems = Problems();
  EXPECT_NE(problems.find("differs from the manifest"), std::string::npos);
  EXPECT_NE(problems.find("Gaussians, not"), std::string::npos);
}

TEST_F(DatasetCheckTest, FindsPartedModelsAndUnknownObjects) {
  ASSERT_TRUE(WriteSplits(set_, {{"a", "train"}, {"b", "test"}, {"c", "test"}}).ok());
  const std::string problems = Problems();
  EXPECT_NE(problems.find("variants of one model"), std::string::npos);
  EXPECT_NE(problems.find("c | "), std::string::npos);
  manifest_.erase("b");
  ASSERT_TRUE(WriteManifest(set_, manifest_).ok());
  EXPECT_NE(Problems().find("is not in the manifest"), std::string::npos);
}

TEST_F(DatasetCheckTest, FindsWhatAKilledBuildLeft) {
  ASSERT_TRUE(WriteUnfinished(set_, {"b", "c"}).ok());
  fs::create_directories(BuildingFolder(set_, "d"));
  fs::create_directories(BuildingFolder(set_, "broken"));
  ASSERT_TRUE(WriteFailures(set_, {{"broken", "x.obj", "mesh", "broken"}}).ok());
  const std::string problems = Problems();
  EXPECT_NE(problems.find("b | " + (set_ / "b").string() + ": is outdated"), std::string::npos) << problems;
  EXPECT_NE(problems.find("c | " + (set_ / "c").string() + ": is missing: its build was interrupted"),
            std::string::npos);
  EXPECT_NE(problems.find("d | "), std::string::npos);
  EXPECT_EQ(std::count(problems.begin(), problems.end(), '\n'), 3) << "what failed is no part of it";
  EXPECT_EQ(SummarizeDataset(set_)->unfinished, 3);
}

TEST_F(DatasetCheckTest, SummaryCounts) {
  manifest_.at("b").rejected = true;
  ASSERT_TRUE(WriteManifest(set_, manifest_).ok());
  ASSERT_TRUE(WriteFailures(set_, {{"x", "x.obj", "mesh", "broken"}}).ok());
  ASSERT_TRUE(WriteSplits(set_, {{"a", "train"}, {"b", "train"}}).ok());
  const auto summary = SummarizeDataset(set_);
  ASSERT_TRUE(summary.ok());
  EXPECT_EQ(summary->objects, 1);
  EXPECT_EQ(summary->rejected, 1);
  EXPECT_EQ(summary->failed, 1);
  EXPECT_EQ(summary->failures.at("mesh"), 1);
  EXPECT_EQ(summary->splits.at("train"), 1);
  EXPECT_EQ(summary->recipes.at("small").objects, 1);
  EXPECT_NEAR(summary->all.train_psnr, manifest_.at("a").train_psnr, 1e-9);
  EXPECT_GT(summary->bytes, 10000u);
}

TEST(DatasetCheck, WithoutManifestIsAnError) {
  const TestFolder folder;
  EXPECT_EQ(CheckDataset(folder.path()).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(SummarizeDataset(folder.path()).error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace anchorsplat
