#include "train/true_views.h"

#include <gtest/gtest.h>

#include <fstream>

#include "dataset/small_dataset_for_test.h"
#include "io/folder_for_test.h"
#include "train/training_data.h"
#include "train/training_object.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

void ExpectSame(const TrueView& a, const TrueView& b) {
  EXPECT_EQ(a.picture.pixels, b.picture.pixels);
  EXPECT_EQ(a.object, b.object);
  EXPECT_EQ(a.background, b.background);
}

TEST(TrueViews, RenderedOnceTheyAreThoseThatWouldHaveBeenStored) {
  const TestFolder folder;
  ObjectJob job = SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra");
  job.settings.views.background = {0.25f, 0, 1};
  ASSERT_TRUE(BuildObject(job, folder / "stored").ok());
  job.settings.views.store_high = false;
  ASSERT_TRUE(BuildObject(job, folder / "demand").ok());
  const SceneEntry stored_entry{"tetra", folder / "stored/tetra"}, entry{"tetra", folder / "demand/tetra"};
  const auto stored_scene = Scene::Open(stored_entry), scene = Scene::Open(entry);
  ASSERT_TRUE(stored_scene.ok() && scene.ok());
  const TrueViews stored(stored_entry, *stored_scene, folder / "cache"), demand(entry, *scene, folder / "cache");
  const auto expected = stored.Load(3), first = demand.Load(3);
  ASSERT_TRUE(expected.ok() && first.ok()) << (first.ok() ? "" : first.error().message);
  ExpectSame(*expected, *first);
  EXPECT_EQ(first->background[2], 1);
  EXPECT_EQ(first->picture.at(2, 0, 0), 1);
  bool cut = false;
  for (size_t view = 0; view < 9; ++view) {
    const auto a = stored.Load(view), b = demand.Load(view), c = demand.Load(view);
    ASSERT_TRUE(a.ok() && b.ok() && c.ok());
    ExpectSame(*a, *b);
    ExpectSame(*a, *c);
    cut = cut || a->object.x0 > 0 || a->object.y0 > 0;
  }
  EXPECT_TRUE(cut) << "no view shows whether the parts lie where they should";

  // Windows, of which one may hold nothing of the object.
  const Image& picture = expected->picture;
  for (const PixelBox& window : {PixelBox{0, 0, picture.width, picture.height}, PixelBox{3, 5, 10, 9},
                                 PixelBox{0, 0, 2, 2}, PixelBox{picture.width - 9, 1, picture.width, 12}}) {
    const auto a = stored.LoadWindow(3, window), b = demand.LoadWindow(3, window);
    ASSERT_TRUE(a.ok() && b.ok());
    ExpectSame(*a, *b);
    EXPECT_EQ(a->background, expected->background);
    const PixelBox& all = expected->object;
    PixelBox object = {std::max(all.x0, window.x0) - window.x0, std::max(all.y0, window.y0) - window.y0,
                       std::min(all.x1, window.x1) - window.x0, std::min(all.y1, window.y1) - window.y0};
    EXPECT_EQ(a->object, object.empty() ? PixelBox{} : object);
    ASSERT_EQ(a->picture.width, window.x1 - window.x0);
    ASSERT_EQ(a->picture.height, window.y1 - window.y0);
    for (int c = 0; c < 3; ++c) {
      for (int y = 0; y < a->picture.height; ++y) {
        for (int x = 0; x < a->picture.width; ++x) {
          ASSERT_EQ(a->picture.at(c, y, x), picture.at(c, y + window.y0, x + window.x0));
        }
      }
    }
  }
  EXPECT_EQ(*stored.Box(3), expected->object);

  // From the folder now: the mesh is not needed any more.
  fs::remove(entry.folder / kMeshName);
  const TrueViews again(entry, *scene, folder / "cache");
  EXPECT_FALSE(again.Load(3).ok()) << "another mesh, or none: another object";
  const auto second = demand.Load(3);
  ASSERT_TRUE(second.ok()) << second.error().message;
  ExpectSame(*expected, *second);

  // A damaged file is an error that names it.
  for (const auto& file : fs::recursive_directory_iterator(folder / "cache")) {
    if (file.is_regular_file()) std::ofstream(file.path()) << "PNG";
  }
  const auto damaged = demand.Load(3);
  ASSERT_FALSE(damaged.ok());
  EXPECT_NE(damaged.error().message.find("003_"), std::string::npos) << damaged.error().message;
  EXPECT_TRUE(demand.LoadWindow(3, {0, 0, 4, 4}).ok()) << "in memory since a window was asked for";
}

TEST(TrueViews, TheObjectsBoxOfPicturesWithAndWithoutAlpha) {
  Image opaque(8, 6, 3);
  std::fill(opaque.pixels.begin(), opaque.pixels.end(), 0.5f);
  EXPECT_TRUE(ObjectBox(opaque, {0.5f, 0.5f, 0.5f}).empty());
  opaque.at(1, 2, 3) = 0;
  opaque.at(0, 4, 5) = 1;
  EXPECT_EQ(ObjectBox(opaque, {0.5f, 0.5f, 0.5f}), (PixelBox{3, 2, 6, 5}));
  Image clear(8, 6, 4);
  std::fill(clear.pixels.begin(), clear.pixels.end(), 0.0f);
  clear.at(3, 5, 0) = 0.1f;  // black, but there
  EXPECT_EQ(ObjectBox(clear, {0, 0, 0}), (PixelBox{0, 5, 1, 6}));
}

TEST(TrainingObject, ViewsMadeOnDemandHaveTheSizeThatIsDrawn) {
  const TestFolder folder;
  ObjectJob job = SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra");
  ASSERT_TRUE(BuildObject(job, folder / "stored").ok());
  job.settings.views.store_high = false;
  ASSERT_TRUE(BuildObject(job, folder / "demand").ok());
  job.settings.views.high_size = 60;
  ASSERT_TRUE(BuildObject(job, folder / "larger").ok());
  SceneEntry entry{"tetra", folder / "demand/tetra"};
  entry.high_size = 60;
  const auto object = OpenTrainingObject(entry, 0, folder / "cache"),
             larger = OpenTrainingObject({"tetra", folder / "larger/tetra"}, 0, folder / "cache");
  ASSERT_TRUE(object.ok() && larger.ok());
  EXPECT_EQ((*object)->upscale, 5);
  EXPECT_EQ((*object)->strength, (*larger)->strength);
  EXPECT_NEAR((*object)->views[3].intrinsics.fx, (*larger)->views[3].intrinsics.fx, 1e-3);
  const auto view = (*object)->truth->Load(3), expected = (*larger)->truth->Load(3);
  ASSERT_TRUE(view.ok() && expected.ok());
  ExpectSame(*view, *expected);

  std::vector<SceneEntry> drawn(2, {"tetra", folder / "demand/tetra"});
  drawn[1].name = "other";
  ASSERT_TRUE(DrawUpscales(2, 8, drawn).ok());
  EXPECT_NE(drawn[0].high_size, drawn[1].high_size);
  for (const SceneEntry& scene : drawn) {
    EXPECT_GE(scene.high_size, 24);
    EXPECT_LE(scene.high_size, 96);
  }
  std::vector<SceneEntry> stored = {{"tetra", folder / "stored/tetra"}};
  const Status refused = DrawUpscales(2, 8, stored);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("--hr on-demand"), std::string::npos) << refused.error().message;
}

TEST(TrainingObject, HeldOutViewsAreNeverTrainedOn) {
  const TestFolder folder;
  ASSERT_TRUE(BuildObject(SmallJob(WriteTetrahedron(folder.path(), "tetra"), "tetra"), folder / "set").ok());
  const SceneEntry entry{"tetra", folder / "set/tetra"};
  const auto all = OpenTrainingObject(entry, 0, folder / "cache"),
             some = OpenTrainingObject(entry, 3, folder / "cache");
  ASSERT_TRUE(all.ok() && some.ok());
  EXPECT_EQ((*all)->validation, (std::vector<size_t>{0, 8}));
  EXPECT_EQ((*all)->training, (std::vector<size_t>{1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ((*some)->training.size(), 3u);
  for (const size_t view : (*some)->training) EXPECT_EQ(view % 8 == 0, false);
  EXPECT_EQ((*all)->upscale, 2);
  EXPECT_EQ((*all)->pixel_sizes.size(), static_cast<size_t>((*all)->cloud.size()));

  ObjectStore store({entry, entry, entry}, {}, 2, folder / "cache", 2);
  const auto kept = store.Get(0);
  ASSERT_TRUE(kept.ok());
  EXPECT_EQ(*store.Get(0), *kept);
  ASSERT_TRUE(store.Get(1).ok() && store.Get(2).ok());
  EXPECT_NE(*store.Get(0), *kept) << "only two are kept";
}

}  // namespace
}  // namespace anchorsplat
