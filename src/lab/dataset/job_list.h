#pragma once

#include <string>
#include <vector>

#include "core/result.h"
#include "dataset/object_builder.h"
#include "dataset/object_record.h"
#include "dataset/recipe.h"

namespace anchorsplat {

// What a build has to do.
struct JobList {
  std::vector<ObjectJob> jobs;          // by name
  std::vector<ObjectFailure> failures;  // libraries that cannot be read; stage kReadStage
};

// Stage of a failure of which no process was begun.
inline constexpr const char* kReadStage = "read";

// The jobs of every mesh (address of a file, of an object of a furniture library, or of a whole library; or a folder of
// pictures) for each entry that its recipe draws. A mesh that is given twice is one.
//
// Names are ObjectName's. Meshes of one name get their folder's in front ("chair/model.obj" and "table/model.obj":
// chair-model and table-model); those that still share one are numbered in the order of their addresses ("-2", "-3").
// The order in which meshes are given has no part in names; it says which are the first for RecipeEntry::objects, the
// objects of a library in the library's order. Meshes that `there` or `failed` know keep their names, so that
// a list that has grown goes on with the same objects.
JobList ListJobs(const std::vector<std::string>& meshes, const Recipe& recipe, const Manifest& there,
                 const std::vector<ObjectFailure>& failed);

}  // namespace anchorsplat
