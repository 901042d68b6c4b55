#pragma once

#include <cstdint>
#include <filesystem>

#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/streamed_sog/lod_options.h"

namespace anchorsplat {

struct OutputMemory;

// Bounds on what a file may make us allocate, and on what is wanted of it.
struct ReadLimits {
  int64_t max_gaussians = int64_t{1} << 28;  // 268 million: 63 GB at SH 3, more than any published scene
  int lod_level = 0;                         // of a streamed SOG; 0 is the finest
};

// In which order Gaussians go into a file (splat_order.h).
enum class SplatOrder {
  kFormat,      // as the format likes it: importance in .splat, Morton in compressed PLY and SOG, kept elsewhere
  kKeep,        // as in the cloud
  kMorton,      // neighbours in space are neighbours in the file
  kImportance,  // largest size × opacity first
};

// WriteOptions (io/write_options.h) of splats.
struct CloudWriteOptions {
  bool overwrite = false;  // an existing file is kExists otherwise
  SplatOrder order = SplatOrder::kFormat;
  int spz_version = 4;             // 3: one gzip stream, which older programs read; 4: zstd streams
  LodOptions lod = {};             // of a streamed SOG
  OutputMemory* memory = nullptr;  // the files go there instead of a folder (io/output_memory.h)
};

// Reads a splat file of any known format, found by its content first and its extension second; a folder with a
// meta.json is a SOG, one with a lod-meta.json a streamed SOG. More control over that: opened_splat.h.
// Errors: kNotFound, kIo, kBadFile (file, byte or line, property, what was expected).
Result<GaussianCloud> ReadCloud(const std::filesystem::path& path, const ReadLimits& limits = {});

// Writes a splat file; the format is found by the extension. The file appears whole or not at all: it is written under
// a temporary name beside the target and renamed. Errors: kExists, kIo, kBadArgument (unknown extension, bad cloud).
Status WriteCloud(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});

}  // namespace anchorsplat
