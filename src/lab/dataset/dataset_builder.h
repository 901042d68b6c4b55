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
  int jobs = 1;                   // objects built concurrently, one process each
  int threads = 1;                // per process
  double timeout_seconds = 0;     // per object; 0: none
  bool overwrite = false;         // rebuilds existing objects
  bool retry = false;             // retries objects that failed earlier
  std::string licence;            // for meshes that state none
  std::string creator;            // likewise
  std::filesystem::path program;  // this program, run as `dataset object JOB -o DATASET`
};

struct DatasetBuildReport {
  int64_t objects = 0;  // requested
  int64_t built = 0;    // in this run
  int64_t there_already = 0;
  int64_t other_settings = 0;  // of those, built with other settings and left unchanged
  int64_t failed = 0;          // in this run or, without `retry`, in an earlier one
  int64_t rejected = 0;        // existing objects that match their own training views too poorly
  bool interrupted = false;
  double seconds = 0;
};

// An object that BuildDataset would build, for callers who run the processes elsewhere.
struct PlannedObject {
  std::string name;
  std::string source;
  std::string base;           // for derived objects, the name of the object they derive from; else empty
  std::filesystem::path job;  // argument of `dataset object JOB -o DATASET`
};

struct DatasetPlan {
  std::vector<PlannedObject> wanted;  // by name, bases before derived objects
  DatasetBuildReport report;          // as if none of them were built
};

// Writes DATASET's current lists and a job for every wanted object, without building any. Errors: those of
// BuildDataset.
Result<DatasetPlan> PlanDataset(const std::vector<std::string>& meshes, const std::filesystem::path& dataset,
                                const DatasetBuildOptions& options);

// Builds DATASET/NAME for every mesh (address of a file, of an object of a furniture library, of a whole library, or a
// folder of pictures with cameras) and every recipe entry it draws. Updates DATASET/manifest.jsonl and failures.jsonl
// after every object. Each object is built in a separate process (object_builder.h), so that a failure, crash or hang
// does not affect others, nor does an unreadable library. Derived objects (ObjectSettings::from) are built after all
// others, and fail if their base failed. After any kind of end, calling again continues. Naming: job_list.h.
//
// Errors: kBadArgument: no meshes; kExists: another build uses the folder; kIo.
Result<DatasetBuildReport> BuildDataset(const std::vector<std::string>& meshes, const std::filesystem::path& dataset,
                                        const DatasetBuildOptions& options);

}  // namespace anchorsplat
