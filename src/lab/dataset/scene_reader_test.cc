#include "dataset/scene_reader.h"

#include <gtest/gtest.h>

#include "dataset/dataset_split.h"
#include "dataset/small_dataset_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

TEST(SceneReader, HighViewsOnDemandAreTheStoredOnesBitByBit) {
  const TestFolder folder;
  ObjectJob job = SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra");
  ASSERT_TRUE(BuildObject(job, folder / "stored").ok());
  job.settings.views.store_high = false;
  ASSERT_TRUE(BuildObject(job, folder / "demand").ok());
  const auto stored = Scene::Open({"tetra", folder / "stored/tetra"});
  const auto demand = Scene::Open({"tetra", folder / "demand/tetra"});
  ASSERT_TRUE(stored.ok() && demand.ok());
  EXPECT_FALSE(fs::exists(folder / "demand/tetra/24/images"));
  for (size_t i = 0; i < 9; ++i) {
    const auto a = stored->HighPicture(i), b = demand->HighPicture(i);
    ASSERT_TRUE(a.ok() && b.ok()) << (b.ok() ? "" : b.error().message);
    EXPECT_EQ(a->channels, b->channels);
    EXPECT_TRUE(a->pixels == b->pixels) << i;
  }
  fs::remove(folder / "demand/tetra/mesh.safetensors");
  const auto gone = Scene::Open({"tetra", folder / "demand/tetra"});
  ASSERT_TRUE(gone.ok());
  EXPECT_EQ(gone->HighPicture(0).error().code, ErrorCode::kNotFound);
}

TEST(SceneReader, ViewsOfBothResolutionsAreTheSamePlaces) {
  const TestFolder folder;
  ASSERT_TRUE(BuildObject(SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra"), folder / "set").ok());
  const auto scene = Scene::Open({"tetra", folder / "set/tetra"});
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  ASSERT_EQ(scene->low_views().size(), 9u);
  ASSERT_EQ(scene->high_views().size(), 9u);
  EXPECT_EQ(scene->held_out(), (std::vector<size_t>{0, 8}));
  for (size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(scene->low_views()[i].name, scene->high_views()[i].name);
    EXPECT_EQ(scene->low_views()[i].world_to_camera.rotation, scene->high_views()[i].world_to_camera.rotation);
    EXPECT_EQ(scene->low_views()[i].intrinsics.width, 12);
    EXPECT_EQ(scene->high_views()[i].intrinsics.width, 24);
    EXPECT_EQ(scene->LowPicture(i)->width, 12);
  }
  const auto cloud = scene->LowSplat();
  ASSERT_TRUE(cloud.ok());
  EXPECT_EQ(cloud->size(), scene->record()->gaussians);
  EXPECT_EQ(cloud->sh_degree, 3);
}

TEST(SceneReader, ReadsDataSetsWithoutOurRecords) {
  // As the published ones: no manifest, no record.
  const TestFolder folder;
  ASSERT_TRUE(BuildObject(SmallJob(WriteTetrahedron(folder.path(), "tetra"), "b"), folder / "set").ok());
  fs::copy(folder / "set/b", folder / "set/a", fs::copy_options::recursive);
  for (const char* name : {"a", "b"}) fs::remove(folder / "set" / name / kRecordName);
  fs::create_directories(folder / "set/notes");
  const auto scenes = ListScenes(folder / "set");
  ASSERT_TRUE(scenes.ok());
  ASSERT_EQ(scenes->size(), 2u);
  EXPECT_EQ((*scenes)[0].name, "a");
  const auto scene = Scene::Open((*scenes)[0]);
  ASSERT_TRUE(scene.ok());
  EXPECT_FALSE(scene->record());
  EXPECT_EQ(scene->held_out(), (std::vector<size_t>{0, 8}));
  EXPECT_TRUE(scene->LowSplat().ok());
  EXPECT_EQ(ListScenes(folder / "set/a")->size(), 1u);  // one object by itself
  EXPECT_EQ(ListScenes(folder / "set/notes").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(ListScenes(folder / "nothing").error().code, ErrorCode::kNotFound);
}

TEST(SceneReader, ListsWhatTheManifestAndTheSplitSay) {
  const TestFolder folder;
  const std::string mesh = WriteTetrahedron(folder.path(), "tetra");
  Manifest manifest;
  for (const char* name : {"a", "b", "c"}) {
    auto record = BuildObject(SmallJob(mesh, name), folder / "set");
    ASSERT_TRUE(record.ok());
    record->rejected = record->name == "b";
    manifest.emplace(name, *record);
  }
  ASSERT_TRUE(WriteManifest(folder / "set", manifest).ok());
  EXPECT_EQ(ListScenes(folder / "set")->size(), 2u);
  EXPECT_EQ(ListScenes(folder / "set", {.rejected = true})->size(), 3u);
  EXPECT_FALSE(ListScenes(folder / "set", {.split = "test"}).ok());
  ASSERT_TRUE(WriteSplits(folder / "set", {{"a", "train"}, {"c", "test"}}).ok());
  const auto test = ListScenes(folder / "set", {.split = "test"});
  ASSERT_TRUE(test.ok());
  ASSERT_EQ(test->size(), 1u);
  EXPECT_EQ((*test)[0].name, "c");
}

TEST(SceneReader, RefusesWhatDoesNotFit) {
  const TestFolder folder;
  ASSERT_TRUE(BuildObject(SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra"), folder / "set").ok());
  const fs::path object = folder / "set/tetra";
  std::ofstream(object / "24/cameras.txt", std::ios::app) << "2 PINHOLE 30 24 30 30 15 12\n";
  EXPECT_EQ(Scene::Open({"tetra", object}).error().code, ErrorCode::kBadFile);
  fs::copy_file(object / "12/cameras.txt", object / "24/cameras.txt", fs::copy_options::overwrite_existing);
  const auto wrong = Scene::Open({"tetra", object});
  ASSERT_TRUE(wrong.ok());
  EXPECT_EQ(wrong->HighPicture(0).error().code, ErrorCode::kBadFile);  // 24 pixels, the camera says 12
  fs::remove_all(object / "12/gaussian_splatting");
  EXPECT_EQ(wrong->LowSplat().error().code, ErrorCode::kNotFound);
  fs::remove_all(object / "24");
  EXPECT_EQ(Scene::Open({"tetra", object}).error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace anchorsplat
