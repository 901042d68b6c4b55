#pragma once

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/format_facts.h"
#include "io/input_file.h"

namespace anchorsplat {

// Reads PlayCanvas's SOG, version 2 or 1: a ZIP archive with a meta.json, or a meta.json with the other files beside
// it. Attributes are lossless WebP images with a pixel per Gaussian, row by row:
//
//   means_l, means_u  low and high bytes of 16 bits per axis, in the range mins … maxs of sign(x)·ln(|x| + 1)
//   quats             three components of q·√2, ·127.5 + 127.5, and 252 + the index of the dropped largest (0 = w)
//   scales            log-scales: version 2 indices into `codebook`, version 1 eighths of a byte in mins … maxs
//   sh0               f_dc likewise; alpha is opacity·255 (version 1: the logit in mins[3] … maxs[3])
//   shN_labels        16 bits, an entry of the palette
//   shN_centroids     64 entries per row, a pixel per coefficient: indices into `codebook` or bytes in mins … maxs
//
// "model": "antialiased" sets the render mode; otherwise it is not stated.
//
// Errors (kBadFile): an invalid or damaged ZIP archive, JSON or image; missing members or wrong types; names in another
// folder; images too small or far too large for the count; labels beyond the palette; more than `limits.max_gaussians`;
// a decompression bomb.
Result<GaussianCloud> ReadSog(const InputFile& file, const ReadLimits& limits = {});

// Bytes of the file and, for a meta.json, of the images beside it.
uint64_t SogSize(const InputFile& file);

// Version, location of the members, generator, palette size. Errors: those of ReadSog.
Result<FormatFacts> DescribeSog(const InputFile& file);

}  // namespace anchorsplat
