#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"
#include "dataset/object_record.h"
#include "dataset/recipe.h"

namespace anchorsplat {

struct DatasetBuildOptions {
  Recipe recipe;
  int jobs = 1;                   // objects at the same time, a process each
  int threads = 1;                // of each
  double timeout_seconds = 0;     // of one object; 0: none
  bool overwrite = false;         // objects that are there are made again
  bool retry = false;             // objects that failed earlier are tried again
  std::string licence;            // of meshes that name none
  std::string creator;            // likewise
  std::filesystem::path program;  // ours: runs `dataset object JOB -o DATASET`
};

struct DatasetBuildReport {
  int64_t objects = 0;  // asked for
  int64_t built = 0;    // in this run
  int64_t there_already = 0;
  int64_t other_settings = 0;  // of those: made by another recipe, and left as they are
  int64_t failed = 0;          // in this run or, without `retry`, in an earlier one
  int64_t rejected = 0;        // of those there now: too unlike their own training views
  bool interrupted = false;
  double seconds = 0;
};

// Objects that BuildDataset would make now, for those who run the processes elsewhere.
struct PlannedObject {
  std::string name;
  std::string source;
  std::string base;           // of objects that are made from another one: its name; else empty
  std::filesystem::path job;  // file to be given to `dataset object JOB -o DATASET`
};

struct DatasetPlan {
  std::vector<PlannedObject> wanted;  // by name, bases before what is made from them
  DatasetBuildReport report;          // what would be, were the wanted ones never made
};

// Writes the lists of DATASET as they are now, and a job for every object that is wanted; makes none. Errors: as below.
Result<DatasetPlan> PlanDataset(const std::vector<std::string>& meshes, const std::filesystem::path& dataset,
                                const DatasetBuildOptions& options);

// Makes DATASET/NAME for every mesh (address of a file, of an object of a furniture library, or of a whole library; or
// a folder of pictures with cameras) and every entry its recipe draws, and DATASET/manifest.jsonl and failures.jsonl,
// which are right after every object. Each object is made by a process of its own (object_builder.h): one that fails,
// crashes or hangs does not stop the others, nor does a library that cannot be read; one that is made from another
// object (ObjectSettings::from) waits for all others, and fails where that failed. Called again after whatever kind
// of end, it goes on where it was. job_list.h says how objects get their names.
//
// Errors: kBadArgument: no meshes; kExists: another build works on the folder; kIo.
Result<DatasetBuildReport> BuildDataset(const std::vector<std::string>& meshes, const std::filesystem::path& dataset,
                                        const DatasetBuildOptions& options);

}  // namespace anchorsplat
