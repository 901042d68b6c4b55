#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// How long a PLY takes to become a file of another format, against what moving its bytes costs in the same run.
struct ConvertBenchOptions {
  std::filesystem::path file = {};  // a PLY; empty: a made-up cloud of `gaussians`
  int64_t gaussians = 2'000'000;
  int sh_degree = 3;
  int repeats = 3;  // the fastest counts
  // Ends of file names; ".3.spz" is version 3 of SPZ.
  std::vector<std::string> targets = {".ply", ".compressed.ply", ".spz", ".3.spz", ".sog", ".splat", ".glb"};
  std::filesystem::path folder = {};  // for the files, which are removed; empty: the system's temporary folder
};

struct ConvertBenchRow {
  std::string target;
  double seconds = 0, read_seconds = 0, write_seconds = 0;  // ConvertFile as a whole, and its parts
  uint64_t bytes = 0;
  uint64_t peak_bytes = 0;  // growth of anonymous memory, at its highest
  double bare_ratio =
      0;  // seconds over read() of the input + one fresh copy of it + write() of as many bytes as came out
  double memory_ratio = 0;  // peak over the cloud
};

struct ConvertBenchReport {
  int64_t gaussians = 0;
  int sh_degree = 0;
  uint64_t input_bytes = 0, cloud_bytes = 0;
  double cat_seconds = 0, fresh_copy_seconds = 0;
  double write_seconds = 0;  // bare write() of as many bytes as the input has
  std::vector<ConvertBenchRow> rows;
};

// Errors: those of ConvertFile; kBadArgument for options out of range, kIo where there is no room (the message says how
// much is needed).
Result<ConvertBenchReport> RunConvertBench(const ConvertBenchOptions& options);

// Normally distributed values of the sizes that real splats have (ln scales −5 ± 0.8, SH ± 0.3 and less with the
// degree), without the likeness of neighbours: harder to compress than a real one. The same on every machine.
GaussianCloud MadeUpSplat(int64_t count, int sh_degree);

}  // namespace anchorsplat
