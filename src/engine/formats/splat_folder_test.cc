#include "formats/splat_folder.h"

#include <gtest/gtest.h>

#include "core/messages_for_test.h"
#include "formats/opened_splat.h"
#include "formats/random_cloud_for_test.h"
#include "io/atomic_file.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

void Put(const fs::path& path, int64_t gaussians) {
  fs::create_directories(path.parent_path());
  ASSERT_TRUE(WriteCloud(path, RandomCloud(gaussians, 0, 1)).ok());
}

void Touch(const fs::path& path) { ASSERT_TRUE(WriteWholeFile(path, "x", true).ok()); }

TEST(SplatFolder, TheLatestOfATrainersResults) {
  const TestFolder folder;
  const fs::path scene = folder / "scene";
  Put(scene / "point_cloud" / "iteration_7000" / "point_cloud.ply", 2);
  Put(scene / "point_cloud" / "iteration_30000" / "point_cloud.ply", 3);
  fs::create_directories(scene / "point_cloud" / "iteration_40000");  // is being written
  fs::create_directories(scene / "point_cloud" / "iteration_best");
  for (const fs::path& path : {scene, scene / "point_cloud"}) {
    const Messages messages;
    const auto cloud = ReadCloud(path);
    ASSERT_TRUE(cloud.ok()) << cloud.error().message;
    EXPECT_EQ(cloud->size(), 3);
    ASSERT_EQ(messages.notes().size(), 1u);
    EXPECT_NE(messages.notes()[0].find("others: iteration_7000"), std::string::npos) << messages.notes()[0];
  }
  const Messages messages;
  EXPECT_EQ(ReadCloud(scene / "point_cloud" / "iteration_7000")->size(), 2);
  EXPECT_EQ(ReadCloud((scene / "point_cloud" / "iteration_7000").string() + "/")->size(), 2);
  EXPECT_TRUE(messages.notes().empty());
}

TEST(SplatFolder, CheckpointsByTheirSteps) {
  const TestFolder folder;
  for (const char* name : {"ckpts/ckpt_6999_rank0.pt", "ckpts/ckpt_29999_rank0.pt", "ckpts/ckpt_29999_rank1.pt"}) {
    Put(folder / "results" / (std::string(name) + ".ply"), 1);
    fs::rename(folder / "results" / (std::string(name) + ".ply"), folder / "results" / name);
  }
  const FoundSplat found = FindSplat(folder / "results");
  EXPECT_EQ(found.path, folder / "results" / "ckpts" / "ckpt_29999_rank0.pt");
  EXPECT_EQ(found.others, "ckpt_6999_rank0.pt");
  EXPECT_EQ(FindSplat(folder / "results" / "ckpts").path, found.path);
  Put(folder / "run" / "nerfstudio_models" / "step-000029999.ply", 1);
  fs::rename(folder / "run" / "nerfstudio_models" / "step-000029999.ply",
             folder / "run" / "nerfstudio_models" / "step-000029999.ckpt");
  EXPECT_EQ(FindSplat(folder / "run").path, folder / "run" / "nerfstudio_models" / "step-000029999.ckpt");
  EXPECT_EQ(FindSplat(folder.path()).path, folder.path());
}

TEST(SplatFolder, RanksOfTheLatestStepOnly) {
  const TestFolder folder;
  Touch(folder / "ckpt_6999_rank0.pt");
  Touch(folder / "ckpt_29999_rank2.pt");
  const FoundSplat found = FindSplat(folder.path());
  EXPECT_EQ(found.path, folder / "ckpt_29999_rank2.pt") << "reading it says what is missing";
  EXPECT_EQ(found.others, "ckpt_6999_rank0.pt");
  Touch(folder / "ckpt_29999_rank1.pt");
  Touch(folder / "ckpt_29999_rankx.pt");
  EXPECT_EQ(FindSplat(folder.path()).path, folder / "ckpt_29999_rank1.pt");
}

TEST(SplatFolder, ATrainersCheckpointsWhereThereIsNoSplat) {
  const TestFolder folder;
  const fs::path scene = folder / "scene";
  fs::create_directories(scene);
  Touch(scene / "chkpnt7000.pth");
  Touch(scene / "chkpnt30000.pth");
  Touch(scene / "chkpnt.pth");
  const FoundSplat alone = FindSplat(scene);
  EXPECT_EQ(alone.path, scene / "chkpnt30000.pth");
  EXPECT_EQ(alone.others, "chkpnt7000.pth");
  EXPECT_TRUE(alone.by_step) << "which is said";
  Put(scene / "point_cloud" / "iteration_7000" / "point_cloud.ply", 2);
  const FoundSplat both = FindSplat(scene);
  EXPECT_EQ(both.path, scene / "point_cloud" / "iteration_7000" / "point_cloud.ply");
  EXPECT_EQ(both.others, "chkpnt7000.pth, chkpnt30000.pth");
}

}  // namespace
}  // namespace anchorsplat
