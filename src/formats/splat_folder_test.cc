#include "formats/splat_folder.h"

#include <gtest/gtest.h>

#include "core/messages_for_test.h"
#include "formats/opened_splat.h"
#include "formats/random_cloud_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

void Put(const fs::path& path, int64_t gaussians) {
  fs::create_directories(path.parent_path());
  ASSERT_TRUE(WriteCloud(path, RandomCloud(gaussians, 0, 1)).ok());
}

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
    EXPECT_NE(messages.notes()[0].find("there are also iteration_7000"), std::string::npos) << messages.notes()[0];
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

}  // namespace
}  // namespace anchorsplat
