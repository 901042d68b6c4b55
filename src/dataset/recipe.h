#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"
#include "dataset/object_settings.h"

namespace anchorsplat {

// One way to make an object, and how often it is drawn compared with the others.
struct RecipeEntry {
  std::string name;  // [A-Za-z0-9._-]+, unique in the recipe
  double weight = 1;
  ObjectSettings settings;
};

// How a data set's objects are made. A network trained on splats of one schedule and one resolution fails on others, so
// a recipe mixes several; every object draws its own, by name and seed, whatever else is built beside it.
struct Recipe {
  std::vector<RecipeEntry> entries;  // at least one
  int draws = 1;                     // entries per object, all different; several make several folders of one model
  uint64_t seed = 0;
};

// All objects with the same settings.
Recipe SingleRecipe(const ObjectSettings& settings);

// A TOML file. Values at the top hold for all entries; each [[mix]] may change them. What is not said is taken from
// `defaults`.
//
//   seed = 7
//   draws = 1
//   views = 146               # as the flags of `views`: rig, radius, fov, size, low_size, samples, background, …
//   min_train_psnr = 34
//   [[mix]]
//   name = "15k-256"
//   weight = 3
//   steps = 15000
//   [[mix]]
//   name = "7k-128"
//   steps = 7000
//   low_size = 128
//
// Errors: kNotFound, kIo; kBadFile with line: syntax, unknown keys, wrong types, settings that cannot be built.
Result<Recipe> ReadRecipe(const std::filesystem::path& path, const ObjectSettings& defaults);

// The entries (indices) that object `name` draws: recipe.draws of them, without repetition, each with the probability
// its weight says.
std::vector<size_t> DrawEntries(const Recipe& recipe, const std::string& name);

}  // namespace anchorsplat
