#include "dataset/recipe.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

Result<Recipe> Read(const std::string& text, const ObjectSettings& defaults = {}) {
  const TestFolder folder;
  std::ofstream(folder / "mix.toml") << text;
  return ReadRecipe(folder / "mix.toml", defaults);
}

TEST(Recipe, EntriesChangeWhatHoldsForAll) {
  ObjectSettings defaults;
  defaults.views.rig.radius = 3;
  const auto recipe = Read(R"(
seed = 7
draws = 2
views = 20
min_train_psnr = 30
background = [1, 0.5, 0]
hr = "on-demand"
[[mix]]
name = "long"
weight = 3
steps = 15000
[[mix]]
steps = 3000
low_size = 128
views = 10
)",
                           defaults);
  ASSERT_TRUE(recipe.ok()) << recipe.error().message;
  ASSERT_EQ(recipe->entries.size(), 2u);
  EXPECT_EQ(recipe->seed, 7u);
  EXPECT_EQ(recipe->draws, 2);
  const RecipeEntry &a = recipe->entries[0], &b = recipe->entries[1];
  EXPECT_EQ(a.name, "long");
  EXPECT_EQ(a.weight, 3);
  EXPECT_EQ(a.settings.fit_steps, 15000);
  EXPECT_EQ(a.settings.views.rig.views, 20);
  EXPECT_EQ(a.settings.views.rig.radius, 3);
  EXPECT_EQ(a.settings.min_train_psnr, 30);
  EXPECT_EQ(a.settings.views.background, (std::array<float, 3>{1, 0.5f, 0}));
  EXPECT_FALSE(a.settings.views.store_high);
  EXPECT_EQ(a.settings.seed, 7u);
  EXPECT_EQ(b.name, "3000-128");
  EXPECT_EQ(b.settings.views.low_size, 128);
  EXPECT_EQ(b.settings.views.rig.views, 10);
}

TEST(Recipe, WithoutMixIsOneEntry) {
  const auto recipe = Read("steps = 500\n");
  ASSERT_TRUE(recipe.ok());
  ASSERT_EQ(recipe->entries.size(), 1u);
  EXPECT_EQ(recipe->entries[0].settings.fit_steps, 500);
}

// Half an hour of fits by the defaults is not what somebody means who gives an empty file.
TEST(Recipe, EmptyIsNone) {
  for (const char* text : {"", "# nothing yet\n"}) {
    const auto recipe = Read(text);
    ASSERT_FALSE(recipe.ok());
    EXPECT_EQ(recipe.error().code, ErrorCode::kBadFile);
    EXPECT_NE(recipe.error().message.find("sets nothing"), std::string::npos);
  }
}

TEST(Recipe, MistakesNameTheirLine) {
  const auto complains = [](const std::string& text, const std::string& about) {
    const auto recipe = Read(text);
    return !recipe.ok() && recipe.error().code == ErrorCode::kBadFile &&
           recipe.error().message.find(about) != std::string::npos;
  };
  EXPECT_TRUE(complains("views = = 3", "line 1: not TOML"));
  EXPECT_TRUE(complains("views = 3\nsteeps = 4", "line 2: steeps"));
  EXPECT_TRUE(complains("views = \"many\"", "line 1: views: expected a whole number"));
  EXPECT_TRUE(complains("views = 2.5", "whole number"));
  EXPECT_TRUE(complains("rig = \"spiral\"", "sphere"));
  EXPECT_TRUE(complains("radius = nan", "expected a number"));
  EXPECT_TRUE(complains("background = [1, 2]", "three"));
  EXPECT_TRUE(complains("hr = true", "string"));
  EXPECT_TRUE(complains("mix = 3", "[[mix]]"));
  EXPECT_TRUE(complains("draws = 2\n[[mix]]\n", "the recipe has 1 entry ([[mix]])"));
  EXPECT_TRUE(complains("draws = 0\n[[mix]]\n", "draws"));
  EXPECT_TRUE(complains("[[mix]]\nweight = 0", "weight"));
  EXPECT_TRUE(complains("[[mix]]\nname = \"../x\"", "name"));
  EXPECT_TRUE(complains("[[mix]]\nname = \"a\"\n[[mix]]\nname = \"a\"", "twice"));
  EXPECT_TRUE(complains("[[mix]]\nlow_size = 4096", "smaller"));
  EXPECT_TRUE(complains("low_size = 4096", "smaller"));
  EXPECT_EQ(ReadRecipe("/nowhere/mix.toml", {}).error().code, ErrorCode::kNotFound);
}

TEST(Recipe, DrawsFollowTheWeightsAndTheNameAlone) {
  Recipe recipe = SingleRecipe({});
  recipe.entries[0].weight = 3;
  recipe.entries.push_back(recipe.entries[0]);
  recipe.entries[1].weight = 1;
  int first = 0;
  for (int i = 0; i < 4000; ++i) first += DrawEntries(recipe, "object" + std::to_string(i))[0] == 0 ? 1 : 0;
  EXPECT_NEAR(first / 4000.0, 0.75, 0.03);
  EXPECT_EQ(DrawEntries(recipe, "chair"), DrawEntries(recipe, "chair"));
  recipe.draws = 2;
  const auto both = DrawEntries(recipe, "chair");
  EXPECT_EQ(std::set<size_t>(both.begin(), both.end()).size(), 2u);
}

TEST(Recipe, AllEntriesForTheFirstObjectsOfTheList) {
  const auto recipe = Read(R"(
draws = "all"
[[mix]]
name = "standard"
[[mix]]
name = "dense"
objects = 2
init = "random"
init_points = 500
init_extent = 0.3
mode = "antialiased"
noise = 4
jpeg = 80
[[mix]]
name = "dense-spz"
from = "dense"
after = "spz"
[[mix]]
from = "standard"
after = "enhanced"
objects = 1
)");
  ASSERT_TRUE(recipe.ok()) << recipe.error().message;
  EXPECT_TRUE(recipe->NamesEntries());
  using Entries = std::vector<size_t>;
  EXPECT_EQ(DrawEntries(*recipe, "a", 0), (Entries{0, 1, 2, 3}));
  EXPECT_EQ(DrawEntries(*recipe, "b", 1), (Entries{0, 1, 2}));
  EXPECT_EQ(DrawEntries(*recipe, "c", 2), (Entries{0}));
  const ObjectSettings &dense = recipe->entries[1].settings, &spz = recipe->entries[2].settings;
  EXPECT_EQ(dense.start, FitStart::kRandom);
  EXPECT_EQ(dense.init_extent, 0.3);
  EXPECT_EQ(dense.mode, RenderMode::kAntialiased);
  EXPECT_EQ(dense.defects, (PictureDefects{.noise = 4, .jpeg = 80}));
  EXPECT_FALSE(dense.IsDerived());
  EXPECT_EQ(spz.from, "dense");
  EXPECT_EQ(spz.after, "spz");
  EXPECT_EQ(spz.init_points, 500);  // all else is the base's
  EXPECT_EQ(recipe->entries[3].name, "standard-enhanced");
}

TEST(Recipe, DrawsAmongWhatAnObjectMayHave) {
  Recipe recipe = SingleRecipe({});
  recipe.entries.push_back(recipe.entries[0]);
  recipe.entries[0].objects = 1;
  recipe.draws = 2;
  EXPECT_EQ(DrawEntries(recipe, "chair", 0).size(), 2u);
  EXPECT_EQ(DrawEntries(recipe, "chair", 1), (std::vector<size_t>{1}));
  recipe.entries[1].objects = 1;
  EXPECT_TRUE(DrawEntries(recipe, "chair", 1).empty());
}

TEST(Recipe, WhatIsMadeFromAnotherNeedsIt) {
  const auto complaint = [](const std::string& entries) {
    const auto recipe = Read("draws = \"all\"\n[[mix]]\nname = \"a\"\nobjects = 2\n[[mix]]\n" + entries);
    return recipe.ok() ? std::string() : recipe.error().message;
  };
  const auto says = [&](const std::string& entries, const std::string& about) {
    return complaint(entries).find(about) != std::string::npos;
  };
  EXPECT_EQ(complaint("from = \"a\"\nafter = \"splat\""), "");
  EXPECT_TRUE(says("from = \"b\"\nafter = \"spz\"", "no earlier entry is called \"b\""));
  EXPECT_TRUE(says("from = \"a\"", "needs after"));
  EXPECT_TRUE(says("after = \"spz\"", "needs from"));
  EXPECT_TRUE(says("from = \"a\"\nafter = \"zip\"", "known are spz, sog, splat and enhanced"));
  EXPECT_TRUE(says("from = \"a\"\nafter = \"spz\"\nsteps = 3", "takes all settings of that entry"));
  EXPECT_TRUE(says("from = \"a\"\nafter = \"spz\"\nobjects = 3", "only 2 objects have"));
  EXPECT_TRUE(says("from = \"a\"\nafter = \"spz\"\n[[mix]]\nfrom = \"a-spz\"\nafter = \"sog\"", "is itself derived"));
  EXPECT_FALSE(Read("[[mix]]\nname = \"a\"\n[[mix]]\nfrom = \"a\"\nafter = \"spz\"").ok());  // one of them is drawn
  EXPECT_FALSE(Read("draws = \"some\"\n[[mix]]").ok());
}

}  // namespace
}  // namespace anchorsplat
