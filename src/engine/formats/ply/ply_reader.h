#pragma once

#include <filesystem>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/extra_properties.h"
#include "formats/format_facts.h"
#include "io/input_file.h"

namespace anchorsplat {

// Reads a Gaussian splat from a PLY file in INRIA's convention, ASCII or binary of either byte order. Properties are
// found by name; extra properties (including lists) and elements are skipped. Values stay as stored: log-scales,
// opacity logits, wxyz quaternions of any norm; doubles are rounded to float. f_rest_* (channel-major in the file)
// becomes coefficient-major `sh`; without it the SH degree is 0. Render mode and comments are kept. The 3-D filter in
// Mip-Splatting's own files (property filter_3D, a size per Gaussian) is applied to scales and opacities, with a
// message; the render mode is then kMip unless a tag gives another. Unknown mode tags give a warning.
//
// Errors (kBadFile): not a PLY; a required property missing or of list or integer type; f_rest not 0, 9, 24 or 45; no
// Gaussians; fewer bytes than the header states (checked before allocation); more than `limits.max_gaussians`; in ASCII
// an invalid number (with its line); an invalid filter_3D (negative, NaN or infinite).
Result<GaussianCloud> ReadPly(const InputFile& file, const ReadLimits& limits = {});

// The same with extra properties, whose values are then also validated in ASCII. Errors: those of ReadPly.
Result<GaussianCloud> ReadPlyWithExtras(const InputFile& file, const ReadLimits& limits, ExtraProperties& extras);

// Count and degree from the header. Errors: those of ReadPly.
Result<CloudExtent> ExtentOfPly(const InputFile& file);

// Encoding, and contents besides Gaussians. Errors: those of ReadPly.
Result<FormatFacts> DescribePly(const InputFile& file);

}  // namespace anchorsplat
