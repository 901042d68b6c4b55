#pragma once

#include <filesystem>
#include <string>

#include "core/result.h"
#include "dataset/object_record.h"
#include "dataset/object_settings.h"

namespace anchorsplat {

// One object to make.
struct ObjectJob {
  std::string name;    // its folder's
  std::string source;  // address of the mesh, or folder of a project of pictures (picture_project.h)
  std::string recipe;  // name of the recipe's entry
  std::string base;    // folder of the object that a derived one (ObjectSettings::from) is made from; else empty
  ObjectSettings settings;
  std::string licence;  // the record's where the mesh names none
  std::string creator;  // likewise
};

std::string ToJsonText(const ObjectJob& job);
Result<ObjectJob> ReadObjectJob(const std::filesystem::path& path);

// Where an object is made before it becomes DATASET/NAME: DATASET/.building/NAME.
std::filesystem::path BuildingFolder(const std::filesystem::path& dataset, const std::string& name);
inline constexpr const char* kBuildingName = ".building";
inline constexpr const char* kStageName = "stage";  // a file in there: what is going on

// Files of a finished object that are not view_set.h's.
inline constexpr const char* kSplatName = "splat.ply";
std::filesystem::path CheckpointPath(const std::filesystem::path& low_folder, int64_t steps);  // as gsplat's trainer

// Makes the object: mesh → views → low-quality splat → files, in BuildingFolder, which then becomes DATASET/NAME in one
// step. With defects (picture_defects.h) the fit sees a folder of its own, captured/; all else stays true. A derived
// object takes the views of its base and its splat, passed through a format or through `program` (derived_object.h).
// Whatever an earlier attempt has finished there is kept if it was made by the same job: views as a whole, the
// fit up to its last checkpoint. Deterministic but for the seconds in the record.
//
// Asked to stop (core/run_context.h), the fit ends in order (kInterrupted): the next attempt goes on from there. Other
// errors: kExists: a file, not a folder, has the object's name; those of the mesh, the views and the fit; the file
// `stage` says which.
Result<ObjectRecord> BuildObject(const ObjectJob& job, const std::filesystem::path& dataset,
                                 const std::filesystem::path& program = {});

}  // namespace anchorsplat
