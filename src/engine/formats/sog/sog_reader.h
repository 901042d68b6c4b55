#pragma once

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/format_facts.h"
#include "io/input_file.h"

namespace anchorsplat {

// Reads PlayCanvas's SOG, version 2 or 1: a ZIP archive with meta.json in it, or a meta.json with the other files
// beside it. The attributes are lossless WebP pictures whose pixels, row by row, belong to the Gaussians:
//
//   means_l, means_u  low and high bytes of 16 bits per axis, in the range mins … maxs of sign(x)·ln(|x| + 1)
//   quats             three components of q·√2, ·127.5 + 127.5, and 252 + the index of the dropped largest (0 = w)
//   scales            log-scales: version 2 indices into `codebook`, version 1 eighths of a byte in mins … maxs
//   sh0               f_dc likewise; alpha is opacity·255 (version 1: the logit in mins[3] … maxs[3])
//   shN_labels        16 bits, an entry of the palette
//   shN_centroids     64 entries per row, a pixel per coefficient: indices into `codebook` or bytes in mins … maxs
//
// "model": "antialiased" becomes the render mode; without it nothing is said.
//
// Errors (kBadFile): a ZIP archive, JSON or picture that is none or damaged, members missing or of the wrong kind,
// names that lead to another folder, pictures too small or far too large for the count, labels beyond the palette, more
// than `limits.max_gaussians`, sizes that only a decompression bomb has.
Result<GaussianCloud> ReadSog(const InputFile& file, const ReadLimits& limits = {});

// Bytes of the file, and of the pictures beside it where it is the meta.json of a folder.
uint64_t SogSize(const InputFile& file);

// Version, where the members are, who wrote them, how large the palette is. Errors as ReadSog.
Result<FormatFacts> DescribeSog(const InputFile& file);

}  // namespace anchorsplat
