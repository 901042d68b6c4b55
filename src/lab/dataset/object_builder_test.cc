#include "dataset/object_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>

#include "core/run_context.h"
#include "dataset/scene_reader.h"
#include "dataset/small_dataset_for_test.h"
#include "formats/cloud_io.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

TEST(ObjectBuilder, MakesTheBenchmarksFiles) {
  const TestFolder folder;
  const ObjectJob job = SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra");
  const auto record = BuildObject(job, folder / "set");
  ASSERT_TRUE(record.ok()) << record.error().message;
  EXPECT_EQ(record->triangles, 4);
  EXPECT_EQ(record->initial_points, 60);
  EXPECT_GT(record->gaussians, 0);
  EXPECT_GT(record->train_psnr, 10);
  EXPECT_FALSE(record->rejected);
  for (const char* name : {"record.json", "splat.ply", "12/images/008.png", "12/sparse/0/points3D.bin",
                           "12/gaussian_splatting/ckpts/ckpt_59_rank0.pt", "24/cameras.txt", "24/images/000.png"}) {
    EXPECT_TRUE(fs::exists(folder / "set/tetra" / name)) << name;
  }
  for (const char* name : {"job.json", "views.json", "fit.checkpoint", "stage"}) {
    EXPECT_FALSE(fs::exists(folder / "set/tetra" / name)) << name;
  }
  EXPECT_FALSE(fs::exists(BuildingFolder(folder / "set", "tetra")));
}

TEST(ObjectBuilder, GoesOnWhereItWasStoppedAndGetsTheSame) {
  const TestFolder folder;
  const ObjectJob job = SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra");
  ASSERT_TRUE(BuildObject(job, folder / "whole").ok());

  std::atomic<bool> stop = true;
  const RunScope run({.stop = &stop});
  EXPECT_EQ(BuildObject(job, folder / "cut").error().code, ErrorCode::kInterrupted);
  EXPECT_FALSE(fs::exists(folder / "cut/tetra"));
  stop = false;
  // Views that were cut off are made anew, views that are done are not touched again.
  ASSERT_TRUE(BuildObject(job, folder / "cut").ok());
  for (const char* name : {"splat.ply", "12/images/003.png", "24/images/003.png", "12/sparse/0/points3D.bin",
                           "12/gaussian_splatting/ckpts/ckpt_59_rank0.pt"}) {
    EXPECT_TRUE(FileBytes(folder / "whole/tetra" / name) == FileBytes(folder / "cut/tetra" / name)) << name;
  }
}

TEST(ObjectBuilder, KeepsFinishedViewsOfTheSameJobOnly) {
  const TestFolder folder;
  ObjectJob job = SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra");
  job.settings.fit_steps = 200000;
  // Stopped by a fit that cannot begin: the project's pictures are gone.
  const fs::path building = BuildingFolder(folder.path(), "tetra");
  ASSERT_TRUE(BuildObject(SmallJob(job.source, "other"), folder.path()).ok());
  fs::create_directories(building);
  fs::copy(folder / "other", building, fs::copy_options::recursive);
  std::ofstream(building / "views.json") << FileBytes(folder / "other/record.json");
  // Another job's work: begun anew, so that the stop finds no views.
  const std::atomic<bool> stop = true;
  const RunScope run({.stop = &stop});
  EXPECT_EQ(BuildObject(job, folder.path()).error().code, ErrorCode::kInterrupted);
  EXPECT_FALSE(fs::exists(building / "views.json"));
}

// A building folder whose views are done and whose fit was stopped at its first step.
fs::path StoppedInItsFit(const ObjectJob& job, const fs::path& set) {
  const fs::path building = BuildingFolder(set, job.name);
  EXPECT_TRUE(BuildObject(job, set).ok());
  fs::rename(set / job.name, building);
  fs::rename(building / "record.json", building / "views.json");
  std::ofstream(building / "job.json") << ToJsonText(job);
  const std::atomic<bool> stop = true;
  const RunScope run({.stop = &stop});
  EXPECT_EQ(BuildObject(job, set).error().code, ErrorCode::kInterrupted);
  EXPECT_TRUE(fs::exists(building / "fit.checkpoint"));
  return building;
}

TEST(ObjectBuilder, APictureAtFaultCostsNoCheckpoint) {
  const TestFolder folder;
  const ObjectJob job = SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra");
  const fs::path building = StoppedInItsFit(job, folder / "set");
  const std::string checkpoint = FileBytes(building / "fit.checkpoint");
  const fs::path picture = building / "12/images/004.png";
  const std::string whole = FileBytes(picture);
  fs::resize_file(picture, whole.size() / 2);
  const auto failed = BuildObject(job, folder / "set");
  ASSERT_FALSE(failed.ok());
  EXPECT_EQ(failed.error().code, ErrorCode::kBadFile);
  EXPECT_NE(failed.error().message.find("004.png"), std::string::npos) << failed.error().message;
  EXPECT_TRUE(FileBytes(building / "fit.checkpoint") == checkpoint);
  std::ofstream(picture, std::ios::binary) << whole;
  EXPECT_TRUE(BuildObject(job, folder / "set").ok());
}

TEST(ObjectBuilder, ACheckpointAtFaultCostsNoObject) {
  const TestFolder folder;
  const ObjectJob job = SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra");
  const fs::path building = StoppedInItsFit(job, folder / "set");
  fs::resize_file(building / "fit.checkpoint", fs::file_size(building / "fit.checkpoint") - 20);
  const auto record = BuildObject(job, folder / "set");
  ASSERT_TRUE(record.ok()) << record.error().message;
  EXPECT_FALSE(fs::exists(folder / "set/tetra/fit.checkpoint"));
}

TEST(ObjectBuilder, ReplacesAnOlderObject) {
  const TestFolder folder;
  ObjectJob job = SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra");
  ASSERT_TRUE(BuildObject(job, folder / "set").ok());
  job.settings.views.rig.views = 3;
  ASSERT_TRUE(BuildObject(job, folder / "set").ok());
  EXPECT_FALSE(fs::exists(folder / "set/tetra/12/images/008.png"));
  EXPECT_FALSE(fs::exists(BuildingFolder(folder / "set", "tetra.replaced")));
}

TEST(ObjectBuilder, ReplacesNothingThatIsNoFolder) {
  const TestFolder folder;
  ObjectJob job = SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra");
  fs::create_directories(folder / "set");
  std::ofstream(folder / "set/tetra") << "mine";
  const auto record = BuildObject(job, folder / "set");
  ASSERT_FALSE(record.ok());
  EXPECT_EQ(record.error().code, ErrorCode::kExists);
  EXPECT_NE(record.error().message.find("is a file where"), std::string::npos);
  EXPECT_EQ(FileBytes(folder / "set/tetra"), "mine");
  // What was made waits for its place.
  fs::remove(folder / "set/tetra");
  EXPECT_TRUE(BuildObject(job, folder / "set").ok());
}

TEST(ObjectBuilder, LicencesOfTheBuildAreForMeshesThatNameNone) {
  const TestFolder folder;
  ObjectJob job = SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra");
  job.licence = "GPL-2.0-or-later";
  job.creator = "somebody";
  const auto record = BuildObject(job, folder / "set");
  ASSERT_TRUE(record.ok()) << record.error().message;
  EXPECT_EQ(record->origin.licence, "GPL-2.0-or-later");
  EXPECT_EQ(record->origin.licence_source, "--licence");
  EXPECT_EQ(record->origin.creator, "somebody");
  std::ofstream(folder / "LICENSE.txt") << "CC0";
  const auto own = BuildObject(job, folder / "set2");
  ASSERT_TRUE(own.ok());
  EXPECT_EQ(own->origin.licence, "CC0-1.0");
  EXPECT_EQ(own->origin.licence_source, "LICENSE.txt");
}

TEST(ObjectBuilder, RejectsFitsFarFromTheirOwnViews) {
  const TestFolder folder;
  ObjectJob job = SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra");
  job.settings.min_train_psnr = 90;
  const auto record = BuildObject(job, folder / "set");
  ASSERT_TRUE(record.ok());
  EXPECT_TRUE(record->rejected);
  EXPECT_NE(record->reason.find("90"), std::string::npos);
  EXPECT_TRUE(fs::exists(folder / "set/tetra/splat.ply"));  // kept, but marked
}

TEST(ObjectBuilder, BadMeshesAreErrorsWithTheirStage) {
  const TestFolder folder;
  std::ofstream(folder / "empty.obj") << "v 0 0 0\n";
  EXPECT_FALSE(BuildObject(SmallJob((folder / "empty.obj").string(), "empty"), folder / "set").ok());
  EXPECT_EQ(FileBytes(BuildingFolder(folder / "set", "empty") / kStageName), "mesh");
  EXPECT_EQ(BuildObject(SmallJob((folder / "none.obj").string(), "none"), folder / "set").error().code,
            ErrorCode::kNotFound);
}

TEST(ObjectBuilder, DefectsAreInWhatTheFitSeesAndNowhereElse) {
  const TestFolder folder;
  ObjectJob job = SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra");
  ASSERT_TRUE(BuildObject(job, folder / "set").ok());
  job.name = "poor";
  job.settings.defects = {.noise = 20, .pose = 1};
  ASSERT_TRUE(BuildObject(job, folder / "set").ok());
  const fs::path clean = folder / "set/tetra", poor = folder / "set/poor";
  for (const char* name : {"12/images/003.png", "24/images/003.png", "12/sparse/0/images.bin"}) {
    EXPECT_TRUE(FileBytes(clean / name) == FileBytes(poor / name)) << name;
  }
  EXPECT_FALSE(FileBytes(clean / "splat.ply") == FileBytes(poor / "splat.ply"));
  EXPECT_FALSE(FileBytes(poor / "12/images/003.png") == FileBytes(poor / "captured/images/003.png"));
  EXPECT_TRUE(FileBytes(poor / "12/images/000.png") == FileBytes(poor / "captured/images/000.png"));  // held out
  const auto scene = Scene::Open({"poor", poor});
  ASSERT_TRUE(scene.ok());
  EXPECT_EQ(scene->fitted_project(), poor / "captured");
  EXPECT_EQ(scene->low_views()[3].image, poor / "12/images/003.png");
}

TEST(ObjectBuilder, FitsOfOtherKindsSayWhatTheyAre) {
  const TestFolder folder;
  ObjectJob job = SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra");
  job.settings.mode = RenderMode::kAntialiased;
  job.settings.sh_degree = 1;
  job.settings.start = FitStart::kView;
  job.settings.init_points = 70;
  const auto record = BuildObject(job, folder / "set");
  ASSERT_TRUE(record.ok()) << record.error().message;
  EXPECT_EQ(record->initial_points, 70);
  const auto scene = Scene::Open({"tetra", folder / "set/tetra"});
  ASSERT_TRUE(scene.ok());
  const auto splat = scene->LowSplat();
  ASSERT_TRUE(splat.ok());
  EXPECT_EQ(splat->render_mode, RenderMode::kAntialiased);  // which no checkpoint says
  EXPECT_EQ(splat->sh_degree, 1);
}

TEST(ObjectBuilder, ABackdropIsInEveryPixelOfBothResolutions) {
  const TestFolder folder;
  ObjectJob job = SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra");
  job.settings.backdrop = true;
  job.settings.views.store_high = false;
  job.settings.views.rig.views = 3;
  const auto record = BuildObject(job, folder / "set");
  ASSERT_TRUE(record.ok()) << record.error().message;
  EXPECT_EQ(record->triangles, 4);  // of the object
  const auto scene = Scene::Open({"tetra", folder / "set/tetra"});
  ASSERT_TRUE(scene.ok());
  for (size_t view = 0; view < 3; ++view) {
    for (const auto& picture : {scene->LowPicture(view), scene->HighPicture(view)}) {
      ASSERT_TRUE(picture.ok()) << picture.error().message;
      ASSERT_EQ(picture->channels, 4);
      EXPECT_EQ(*std::min_element(picture->channel(3), picture->channel(3) + picture->plane()), 1);
    }
  }
}

TEST(ObjectBuilder, SplatsThroughAFormatKeepTheirViews) {
  const TestFolder folder;
  const ObjectJob base = SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra--small");
  ObjectJob job = base;
  job.name = "tetra--splat";
  job.base = base.name;
  job.settings.from = "small";
  job.settings.after = "splat";
  const auto early = BuildObject(job, folder / "set");
  ASSERT_FALSE(early.ok());
  EXPECT_NE(early.error().message.find("tetra--small, which is missing"), std::string::npos);
  const auto first = BuildObject(base, folder / "set");
  ASSERT_TRUE(first.ok());
  const auto record = BuildObject(job, folder / "set");
  ASSERT_TRUE(record.ok()) << record.error().message;
  EXPECT_EQ(record->name, "tetra--splat");
  EXPECT_EQ(record->settings.after, "splat");
  EXPECT_NE(record->train_psnr, first->train_psnr) << "its own: without harmonics it is another splat";
  EXPECT_NE(record->train_ssim, first->train_ssim);
  EXPECT_NEAR(record->train_psnr, first->train_psnr, 3);
  EXPECT_GT(record->gaussians, 0);
  const auto scene = Scene::Open({"tetra--splat", folder / "set/tetra--splat"});
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  EXPECT_EQ(scene->LowSplat()->size(), record->gaussians);
  EXPECT_EQ(ReadCloud(folder / "set/tetra--splat/splat.ply")->sh_degree, 0);  // .splat has no more
  EXPECT_TRUE(scene->HighPicture(2).ok());
  EXPECT_EQ(FileBytes(folder / "set/tetra--splat/12/images/002.png"),
            FileBytes(folder / "set/tetra--small/12/images/002.png"));
  // Another recipe than the base was made by.
  job.name = "tetra--other";
  job.settings.fit_steps = 61;
  EXPECT_EQ(BuildObject(job, folder / "set").error().code, ErrorCode::kBadArgument);
  job.settings = base.settings;
  job.settings.from = "small";
  job.settings.after = "enhanced";
  EXPECT_NE(BuildObject(job, folder / "set").error().message.find("no program"), std::string::npos);
}

TEST(ObjectBuilder, JobsComeBack) {
  const TestFolder folder;
  const ObjectJob job = SmallJob("a \"mesh\".obj", "a");
  std::ofstream(folder / "a.job") << ToJsonText(job);
  const auto back = ReadObjectJob(folder / "a.job");
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(ToJsonText(*back), ToJsonText(job));
}

}  // namespace
}  // namespace anchorsplat
