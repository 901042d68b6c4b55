#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"
#include "dataset/object_settings.h"

namespace anchorsplat {

// A way to build an object, and its weight in random draws.
struct RecipeEntry {
  std::string name;  // [A-Za-z0-9._-]+, unique in the recipe
  double weight = 1;
  int64_t objects = 0;  // only the first N objects of the list may draw it; 0: all
  ObjectSettings settings;
};

// How a data set's objects are built. A network trained on splats of a single schedule and resolution fails on others,
// so a recipe mixes several. Each object's draw depends only on its name and the seed.
struct Recipe {
  std::vector<RecipeEntry> entries;  // at least one
  int draws = 1;                     // distinct entries per object; several give several folders per model
  bool draws_all = false;            // instead: every entry that the object may draw
  uint64_t seed = 0;

  // Whether folder names include the entry.
  bool NamesEntries() const { return draws_all || draws > 1; }
};

// A recipe with the same settings for all objects.
Recipe SingleRecipe(const ObjectSettings& settings);

// Reads a TOML file. Values at the top apply to all entries, and each [[mix]] may override them. Missing values come
// from `defaults`.
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
// `from` requires draws = "all" and a fitted entry for at least as many objects, whose settings it takes.
//
// Errors: kNotFound, kIo; kBadFile with line: syntax, unknown keys, wrong types, settings that cannot be built.
Result<Recipe> ReadRecipe(const std::filesystem::path& path, const ObjectSettings& defaults);

// The entries (indices) drawn by object `name` at index `place` of the list: recipe.draws distinct ones of those it may
// have, with probabilities by weight; or all of them in order. Fewer or none if it may not have as many.
std::vector<size_t> DrawEntries(const Recipe& recipe, const std::string& name, int64_t place = 0);

}  // namespace anchorsplat
