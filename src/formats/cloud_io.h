#pragma once

#include <cstdint>
#include <filesystem>

#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// Bounds on what a file may make us allocate.
struct ReadLimits {
  int64_t max_gaussians = int64_t{1} << 28;  // 268 million: 63 GB at SH 3, more than any published scene
};

struct WriteOptions {
  bool overwrite = false;  // an existing file is kExists otherwise
};

// Reads a splat file of any known format, found by its content first and its extension second.
// Errors: kNotFound, kIo, kBadFile (file, byte or line, property, what was expected).
Result<GaussianCloud> ReadCloud(const std::filesystem::path& path, const ReadLimits& limits = {});

// Writes a splat file; the format is found by the extension. The file appears whole or not at all: it is written under
// a temporary name beside the target and renamed. Errors: kExists, kIo, kBadArgument (unknown extension, bad cloud).
Status WriteCloud(const std::filesystem::path& path, const GaussianCloud& cloud, const WriteOptions& options = {});

}  // namespace anchorsplat
