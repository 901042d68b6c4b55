#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/result.h"
#include "dataset/object_record.h"

namespace anchorsplat {

// A defect of a data set.
struct DatasetProblem {
  std::string object;    // empty: concerns the whole data set
  std::string sentence;  // names the file
};

struct DatasetCheckOptions {
  bool decode = false;  // decodes every picture instead of reading only its size
};

// Verifies a data set. Every object of the manifest exists with the same record, all views at their sizes, and a finite
// splat with the recorded number of Gaussians in both files. There are no objects outside the manifest, no model in two
// splits, and nothing unfinished from a build that was killed or still runs. Returns problems sorted by object.
// Errors: kNotFound: no manifest; kBadFile: of the manifest or the list of failures.
Result<std::vector<DatasetProblem>> CheckDataset(const std::filesystem::path& dataset,
                                                 const DatasetCheckOptions& options = {});

// Statistics of a data set.
struct DatasetSummary {
  struct Part {
    int64_t objects = 0;
    double train_psnr = 0;  // means over the part's objects
    double held_out_psnr = 0;
    double gaussians = 0;
  };
  int64_t objects = 0;  // without rejected ones
  int64_t rejected = 0;
  int64_t failed = 0;
  int64_t unfinished = 0;                 // begun or listed by a build, but neither done nor failed
  Part all;                               // without rejected ones
  std::map<std::string, Part> recipes;    // by entry
  std::map<std::string, int64_t> splits;  // objects; empty without splits.json
  std::map<std::string, int64_t> licences;
  std::map<std::string, int64_t> failures;                     // by stage
  double read_seconds = 0, view_seconds = 0, fit_seconds = 0;  // totals, including rejected ones
  uint64_t bytes = 0;                                          // on disk
};
Result<DatasetSummary> SummarizeDataset(const std::filesystem::path& dataset);

}  // namespace anchorsplat
