#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// Times the conversion of a PLY to other formats, relative to moving its bytes in the same run.
struct ConvertBenchOptions {
  std::filesystem::path file = {};  // a PLY; empty: a made-up cloud of `gaussians`
  int64_t gaussians = 2'000'000;
  int sh_degree = 3;
  int repeats = 3;  // the fastest counts
  // File name endings; ".3.spz" is version 3 of SPZ.
  std::vector<std::string> targets = {".ply", ".compressed.ply", ".spz", ".3.spz", ".sog", ".splat", ".glb"};
  std::filesystem::path folder = {};  // for temporary files; empty: the system's temporary folder
};

struct ConvertBenchRow {
  std::string target;
  double seconds = 0, read_seconds = 0, write_seconds = 0;  // total of ConvertFile, and its parts
  uint64_t bytes = 0;
  uint64_t peak_bytes = 0;  // peak growth of anonymous memory
  // Seconds over read() of the input + one fresh copy of it + write() of the output's size.
  double bare_ratio = 0;
  double memory_ratio = 0;  // peak over the cloud's size
};

struct ConvertBenchReport {
  int64_t gaussians = 0;
  int sh_degree = 0;
  uint64_t input_bytes = 0, cloud_bytes = 0;
  double cat_seconds = 0, fresh_copy_seconds = 0;
  double write_seconds = 0;  // bare write() of the input's size
  std::vector<ConvertBenchRow> rows;
};

// Errors: those of ConvertFile; kBadArgument: options out of range; kIo: too little space (the message says how much is
// needed).
Result<ConvertBenchReport> RunConvertBench(const ConvertBenchOptions& options);

// Normally distributed values in the range of real splats (ln scales −5 ± 0.8, SH ± 0.3, less for higher degrees),
// without correlation between neighbours: harder to compress than a real splat. The same on every machine.
GaussianCloud MadeUpSplat(int64_t count, int sh_degree);

}  // namespace anchorsplat
