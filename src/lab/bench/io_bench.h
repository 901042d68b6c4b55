#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// How fast splats are read and written, against what the machine can do at best in the same run.
struct IoBenchOptions {
  int64_t gaussians = 2'000'000;
  int sh_degree = 3;
  int repeats = 4;               // the fastest of them counts: everything else is the machine doing other things
  std::filesystem::path folder;  // where the file is made (and removed); empty: the system's temporary folder
};

// One line of the table.
struct IoBenchRow {
  std::string name;
  double seconds = 0;
  uint64_t bytes = 0;
  std::optional<double> ratio;  // to the bare measurements, as `ratio_meaning` says
  std::string ratio_meaning;
};

struct IoBenchReport {
  int64_t gaussians = 0;
  int sh_degree = 0;
  uint64_t file_bytes = 0;
  uint64_t cloud_bytes = 0;

  double cat_seconds = 0;          // read() of the whole file to nowhere, as `cat file >/dev/null`
  double fresh_copy_seconds = 0;   // one copy of as many bytes into pages never touched before
  double bare_write_seconds = 0;   // write() of as many bytes in blocks of 1 MiB
  double read_seconds = 0;         // ReadCloud
  double write_seconds = 0;        // WriteCloud
  uint64_t reader_peak_bytes = 0;  // growth of anonymous memory while reading, at its highest

  double read_ratio() const { return read_seconds / (cat_seconds + fresh_copy_seconds); }  // lower is better
  double write_ratio() const { return bare_write_seconds / write_seconds; }                // higher is better
  double memory_ratio() const { return static_cast<double>(reader_peak_bytes) / static_cast<double>(cloud_bytes); }
  std::vector<IoBenchRow> Rows() const;
};

// Writes a random cloud as PLY and reads it back, all from the page cache. Needs room for two such files and memory for
// three clouds. Errors: kBadArgument, kIo (no room; the message says how much is needed).
Result<IoBenchReport> RunIoBench(const IoBenchOptions& options);

}  // namespace anchorsplat
