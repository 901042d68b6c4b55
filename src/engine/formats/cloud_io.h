#pragma once

#include <cstdint>
#include <filesystem>

#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/streamed_sog/lod_options.h"

namespace anchorsplat {

struct OutputMemory;

// Limits on allocations caused by a file, and which part of it to read.
struct ReadLimits {
  int64_t max_gaussians = int64_t{1} << 28;  // 268 million: 63 GB at SH 3, above any published scene
  int lod_level = 0;                         // for streamed SOG; 0 is the finest
};

// Order of Gaussians in a file (splat_order.h).
enum class SplatOrder {
  kFormat,      // the format's default: importance in .splat, Morton in compressed PLY and SOG, unchanged elsewhere
  kKeep,        // as in the cloud
  kMorton,      // neighbours in space are close in the file
  kImportance,  // largest size × opacity first
};

// WriteOptions (io/write_options.h) of splats.
struct CloudWriteOptions {
  bool overwrite = false;  // false: an existing file is an error (kExists)
  SplatOrder order = SplatOrder::kFormat;
  int spz_version = 4;             // 3: one gzip stream, for older programs; 4: zstd streams
  LodOptions lod = {};             // for streamed SOG
  OutputMemory* memory = nullptr;  // write files there instead of to a folder (io/output_memory.h)
};

// Reads a splat file of any known format, detected by content, then extension. A folder with a meta.json is a SOG, with
// a lod-meta.json a streamed SOG. opened_splat.h offers more control. Errors: kNotFound, kIo, kBadFile (file, byte or
// line, property, what was expected).
Result<GaussianCloud> ReadCloud(const std::filesystem::path& path, const ReadLimits& limits = {});

// Writes a splat file in the format of its extension, all or nothing. Errors: kExists, kIo, kBadArgument (unknown
// extension, invalid cloud).
Status WriteCloud(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});

}  // namespace anchorsplat
