#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// Times reading and writing of splats, relative to the machine's best in the same run.
struct IoBenchOptions {
  int64_t gaussians = 2'000'000;
  int sh_degree = 3;
  int repeats = 4;               // the fastest counts; slower ones were disturbed
  std::filesystem::path folder;  // for the temporary file; empty: the system's temporary folder
};

// A line of the table.
struct IoBenchRow {
  std::string name;
  double seconds = 0;
  uint64_t bytes = 0;
  std::optional<double> ratio;  // to bare measurements, see `ratio_meaning`
  std::string ratio_meaning;
};

struct IoBenchReport {
  int64_t gaussians = 0;
  int sh_degree = 0;
  uint64_t file_bytes = 0;
  uint64_t cloud_bytes = 0;

  double cat_seconds = 0;          // read() of the whole file, like `cat file >/dev/null`
  double fresh_copy_seconds = 0;   // one copy of the same size to untouched pages
  double bare_write_seconds = 0;   // write() of the same size in blocks of 1 MiB
  double read_seconds = 0;         // ReadCloud
  double write_seconds = 0;        // WriteCloud
  uint64_t reader_peak_bytes = 0;  // peak growth of anonymous memory while reading

  double read_ratio() const { return read_seconds / (cat_seconds + fresh_copy_seconds); }  // lower is better
  double write_ratio() const { return bare_write_seconds / write_seconds; }                // higher is better
  double memory_ratio() const { return static_cast<double>(reader_peak_bytes) / static_cast<double>(cloud_bytes); }
  std::vector<IoBenchRow> Rows() const;
};

// Writes a random cloud as PLY and reads it back from the page cache. Needs space for two such files and memory for
// three clouds. Errors: kBadArgument; kIo: too little space (the message says how much is needed).
Result<IoBenchReport> RunIoBench(const IoBenchOptions& options);

}  // namespace anchorsplat
