#pragma once

#include <string>
#include <vector>

#include "core/result.h"
#include "dataset/object_builder.h"
#include "dataset/object_record.h"
#include "dataset/recipe.h"

namespace anchorsplat {

// The work of a build.
struct JobList {
  std::vector<ObjectJob> jobs;          // by name
  std::vector<ObjectFailure> failures;  // unreadable libraries; stage kReadStage
};

// Stage of failures before any process was started.
inline constexpr const char* kReadStage = "read";

// Lists the jobs of every mesh (address of a file, of an object of a furniture library, of a whole library, or a folder
// of pictures) for each recipe entry it draws. Duplicate meshes count once.
//
// Names come from ObjectName. Meshes of equal name get their folder's as prefix ("chair/model.obj" and
// "table/model.obj": chair-model and table-model); those still equal are numbered in address order ("-2", "-3"). The
// order of meshes does not affect names; it decides which are the first for RecipeEntry::objects (a library's objects
// in the library's order). Meshes known from `there` or `failed` keep their names, so that a longer list continues with
// the same objects.
JobList ListJobs(const std::vector<std::string>& meshes, const Recipe& recipe, const Manifest& there,
                 const std::vector<ObjectFailure>& failed);

}  // namespace anchorsplat
