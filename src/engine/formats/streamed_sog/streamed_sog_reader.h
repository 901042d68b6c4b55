#pragma once

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/format_facts.h"
#include "io/input_file.h"

namespace anchorsplat {

// Reads PlayCanvas's streamed SOG, version 1 or the one before there were numbers: a scene at several levels of detail,
// in chunks. `file` is its lod-meta.json:
//
//   lodLevels    how many levels there are; 0 is the finest
//   counts       Gaussians of each
//   filenames    the chunks: the meta.json of an unbundled SOG each, relative to lod-meta.json
//   tree         nodes with a `bound` (min, max) and two `children`, or, the leaves, `lods`: for a level, by its number
//                as text, the Gaussians `offset` to `offset` + `count` of the chunk `file`
//   environment  a SOG that is there at every level, or null
//
// The cloud is level `limits.lod_level`, leaf by leaf, then the environment. Of a leaf without that level it is the
// nearest finer one, or else the nearest coarser one.
//
// Errors (kBadFile): JSON that is none, members missing or of the wrong kind, a level that is not there, names that
// lead out of the folder, ranges that overlap or leave their chunk, more than `limits.max_gaussians`, sizes that only a
// decompression bomb has, bytes in memory, beside which there are no chunks; those of ReadSog. kNotFound: a chunk.
Result<GaussianCloud> ReadStreamedSog(const InputFile& file, const ReadLimits& limits = {});

// Bytes of the file and of all chunks.
uint64_t StreamedSogSize(const InputFile& file);

// Version, levels, chunks, who wrote it.
Result<FormatFacts> DescribeStreamedSog(const InputFile& file);

}  // namespace anchorsplat
