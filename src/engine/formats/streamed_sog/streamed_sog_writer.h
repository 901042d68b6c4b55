#pragma once

#include <cstdint>
#include <filesystem>

#include "core/buffer.h"
#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"

namespace anchorsplat {

// Writes PlayCanvas's streamed SOG, version 1 (layout: streamed_sog_reader.h): `path`, which must be named
// lod-meta.json, and beside it a folder LEVEL_CHUNK with an unbundled SOG per chunk. Level 0 is the cloud; each further
// level merges the previous one (coarser_cloud.h) per leaf of a tree (lod_tree.h), so that extra memory is bounded by
// leaves and chunks. Creates the folder of `path` if needed. Chunks are published before lod-meta.json, and chunks of
// an older lod-meta.json are not replaced, so readers see the old or the new scene; the old chunks are removed
// afterwards. Lost: unusable Gaussians (IsUsable), counted in a warning; rounding as in SOG. Errors: kExists, kIo,
// kBadArgument (inconsistent arrays, nothing to draw, options out of range, another name); kInterrupted: the run was
// stopped, and nothing has changed.
Status WriteStreamedSog(const std::filesystem::path& path, const CloudView& cloud,
                        const CloudWriteOptions& options = {});

// Rows of the cloud in the order of level 0, without dropped ones.
Buffer<uint32_t> StreamedSogRows(const CloudView& cloud, const CloudWriteOptions& options);

// Estimated for all levels with default options.
uint64_t EstimatedStreamedSogSize(int64_t count, int sh_degree);

}  // namespace anchorsplat
