#pragma once

#include <filesystem>
#include <string>

#include "core/result.h"
#include "dataset/object_record.h"
#include "dataset/object_settings.h"

namespace anchorsplat {

// An object to build.
struct ObjectJob {
  std::string name;    // of its folder
  std::string source;  // address of the mesh, or folder of a project of pictures (picture_project.h)
  std::string recipe;  // name of the recipe's entry
  std::string base;    // for derived objects (ObjectSettings::from), the base's folder; else empty
  ObjectSettings settings;
  std::string licence;  // for the record if the mesh states none
  std::string creator;  // likewise
};

std::string ToJsonText(const ObjectJob& job);
Result<ObjectJob> ReadObjectJob(const std::filesystem::path& path);

// Folder in which an object is built before it becomes DATASET/NAME: DATASET/.building/NAME.
std::filesystem::path BuildingFolder(const std::filesystem::path& dataset, const std::string& name);
inline constexpr const char* kBuildingName = ".building";
inline constexpr const char* kStageName = "stage";  // file there that names the current stage

// Files of a finished object other than view_set.h's.
inline constexpr const char* kSplatName = "splat.ply";
std::filesystem::path CheckpointPath(const std::filesystem::path& low_folder, int64_t steps);  // as in gsplat's trainer

// Builds an object: mesh → views → low-quality splat → files, in BuildingFolder, which is finally renamed to
// DATASET/NAME. With defects (picture_defects.h) the fit uses a folder of its own, captured/; everything else is
// unaffected. A derived object takes its base's views, and its splat processed by a format or by `program`
// (derived_object.h). Continues an earlier attempt of the same job: finished views are reused, and the fit resumes from
// its checkpoint. Deterministic except for the seconds in the record.
//
// When asked to stop (core/run_context.h) the fit ends in order (kInterrupted), and the next attempt continues. Other
// errors: kExists: a file has the object's name; those of the mesh, the views and the fit; the file `stage` tells
// which.
Result<ObjectRecord> BuildObject(const ObjectJob& job, const std::filesystem::path& dataset,
                                 const std::filesystem::path& program = {});

}  // namespace anchorsplat
