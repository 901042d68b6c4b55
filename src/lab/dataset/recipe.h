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
  int64_t objects = 0;  // only the first so many objects of the list may have it; 0: all
  ObjectSettings settings;
};

// How a data set's objects are made. A network trained on splats of one schedule and one resolution fails on others, so
// a recipe mixes several; every object draws its own, by name and seed, whatever else is built beside it.
struct Recipe {
  std::vector<RecipeEntry> entries;  // at least one
  int draws = 1;                     // entries per object, all different; several make several folders of one model
  bool draws_all = false;            // instead: every entry that the object may have
  uint64_t seed = 0;

  // Whether folders are called after their entry, too.
  bool NamesEntries() const { return draws_all || draws > 1; }
};

// All objects with the same settings.
Recipe SingleRecipe(const ObjectSettings& settings);

// A TOML file. Values at the top hold for all entries; each [[mix]] may change them. What is not said is taken from
// `defaults`.
//
//   seed = 7
//   draws = 1                 # "all": every object gets every entry
//   views = 146               # as the flags of `views`: rig, radius, fov, size, low_size, samples, background, …
//   min_train_psnr = 34
//   [[mix]]
//   name = "15k-256"
//   weight = 3
//   steps = 15000
//   [[mix]]
//   name = "7k-128"
//   objects = 3               # only the first three of the list
//   steps = 7000
//   low_size = 128
//   [[mix]]
//   name = "7k-128-spz"       # no fit of its own: the splat of another entry, passed through a format
//   from = "7k-128"
//   after = "spz"
//
// `from` needs draws = "all" and a fitted entry that no fewer objects have; all settings are that entry's.
//
// Errors: kNotFound, kIo; kBadFile with line: syntax, unknown keys, wrong types, settings that cannot be built.
Result<Recipe> ReadRecipe(const std::filesystem::path& path, const ObjectSettings& defaults);

// The entries (indices) that object `name`, the `place`-th of the list, from 0, draws: recipe.draws of those it may
// have, without repetition, each with the probability its weight says; or all of them, in the recipe's order. Fewer, or
// none, where it may not have as many.
std::vector<size_t> DrawEntries(const Recipe& recipe, const std::string& name, int64_t place = 0);

}  // namespace anchorsplat
