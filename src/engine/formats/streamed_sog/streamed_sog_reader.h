#pragma once

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/format_facts.h"
#include "io/input_file.h"

namespace anchorsplat {

// Reads PlayCanvas's streamed SOG, version 1 or the unnumbered one before: a scene in chunks with several levels of
// detail. `file` is its lod-meta.json:
//
//   lodLevels    how many levels there are; 0 is the finest
//   counts       Gaussians of each
//   filenames    the chunks: the meta.json of an unbundled SOG each, relative to lod-meta.json
//   tree         nodes with a `bound` (min, max) and two `children`, or, the leaves, `lods`: for a level, by its number
//                as text, the Gaussians `offset` to `offset` + `count` of the chunk `file`
//   environment  a SOG that is there at every level, or null
//
// The result is level `limits.lod_level`, leaf by leaf, then the environment. A leaf without that level uses the
// nearest finer one, else the nearest coarser one.
//
// Errors (kBadFile): invalid JSON; missing members or wrong types; no such level; names outside the folder; ranges that
// overlap or exceed their chunk; more than `limits.max_gaussians`; a decompression bomb; bytes in memory, which have no
// chunks; those of ReadSog. kNotFound: a chunk.
Result<GaussianCloud> ReadStreamedSog(const InputFile& file, const ReadLimits& limits = {});

// Bytes of the file and all chunks.
uint64_t StreamedSogSize(const InputFile& file);

// Version, levels, chunks, generator.
Result<FormatFacts> DescribeStreamedSog(const InputFile& file);

}  // namespace anchorsplat
