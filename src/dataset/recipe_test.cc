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

}  // namespace
}  // namespace anchorsplat
