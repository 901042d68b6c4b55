#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/result.h"
#include "dataset/object_record.h"

namespace anchorsplat {

// Something that is not as it should be.
struct DatasetProblem {
  std::string object;    // empty: the data set as a whole
  std::string sentence;  // with the file
};

struct DatasetCheckOptions {
  bool decode = false;  // read every picture's pixels, not only its size
};

// Looks at everything a data set promises: every object of the manifest is there and says the same, has all its views
// at their sizes, a splat of as many Gaussians as its record says, in both files, all finite; no objects that the
// manifest does not know; no model in two splits; nothing that a build was to make and has not, because it was killed
// or is still at work. Problems come sorted by object. Errors: kNotFound: no manifest; kBadFile: of the manifest or the
// list of failures.
Result<std::vector<DatasetProblem>> CheckDataset(const std::filesystem::path& dataset,
                                                 const DatasetCheckOptions& options = {});

// Numbers of a data set as a whole.
struct DatasetSummary {
  struct Part {
    int64_t objects = 0;
    double train_psnr = 0;  // means over the part's objects
    double held_out_psnr = 0;
    double gaussians = 0;
  };
  int64_t objects = 0;  // that are no rejects
  int64_t rejected = 0;
  int64_t failed = 0;
  int64_t unfinished = 0;                 // begun or listed by a build, neither done nor failed
  Part all;                               // without rejects
  std::map<std::string, Part> recipes;    // by entry
  std::map<std::string, int64_t> splits;  // objects; empty without splits.json
  std::map<std::string, int64_t> licences;
  std::map<std::string, int64_t> failures;                     // by stage
  double read_seconds = 0, view_seconds = 0, fit_seconds = 0;  // sums, rejects included
  uint64_t bytes = 0;                                          // on disk
};
Result<DatasetSummary> SummarizeDataset(const std::filesystem::path& dataset);

}  // namespace anchorsplat
