#pragma once

#include <cstdint>
#include <filesystem>

#include "core/buffer.h"
#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"

namespace anchorsplat {

// Writes PlayCanvas's streamed SOG, version 1 (layout: streamed_sog_reader.h): `path`, which must be called
// lod-meta.json, and beside it a folder LEVEL_CHUNK for every chunk with an unbundled SOG in it. Level 0 is the cloud;
// each further one is made of the one before by merging (coarser_cloud.h), leaf by leaf of a tree (lod_tree.h), so that
// memory beside the cloud is bounded by leaves and chunks, not by the cloud. The folder of `path` is made where there
// is none. Chunks have their names before lod-meta.json gets its own, and none of those that an older lod-meta.json
// names is replaced: whoever reads sees the old scene or the new one. The old one's chunks are then removed.
// Lost: Gaussians that nobody draws (IsUsable), which a warning counts; otherwise as SOG.
// Errors: kExists, kIo, kBadArgument (arrays that disagree, nothing to draw, options out of range, another name);
// kInterrupted where the run is asked to stop: then nothing has changed.
Status WriteStreamedSog(const std::filesystem::path& path, const CloudView& cloud,
                        const CloudWriteOptions& options = {});

// Rows of the cloud in the order in which level 0 has them; without those that are dropped.
Buffer<uint32_t> StreamedSogRows(const CloudView& cloud, const CloudWriteOptions& options);

// Of all levels with the default options.
uint64_t EstimatedStreamedSogSize(int64_t count, int sh_degree);

}  // namespace anchorsplat
