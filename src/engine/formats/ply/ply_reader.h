#pragma once

#include <filesystem>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/extra_properties.h"
#include "formats/format_facts.h"
#include "io/input_file.h"

namespace anchorsplat {

// Reads a Gaussian splat from a PLY file in the INRIA convention, ASCII or binary of either byte order: properties are
// found by name, extra ones (lists too) and extra elements are skipped. Values stay as stored: log-scales, opacity
// logits, wxyz quaternions of any norm; doubles are rounded to float. f_rest_* (channel-major in the file) becomes
// coefficient-major `sh`; clouds without f_rest have SH degree 0. Render mode and comments are kept. The 3-D
// filter of Mip-Splatting's own files (property filter_3D, a size per Gaussian) becomes a part of scales and opacities,
// and the render mode kMip where no tag says another; a message says so. A tag that names no known mode is a warning.
//
// Errors (kBadFile): not a PLY, a required property missing or of list or integer type, f_rest not 0, 9, 24 or 45, no
// Gaussians, fewer bytes than the header promises (checked before anything is allocated), more than
// `limits.max_gaussians`, in ASCII a value that is no number (the message gives the line), a filter_3D that is no
// size (negative, NaN or infinite).
Result<GaussianCloud> ReadPly(const InputFile& file, const ReadLimits& limits = {});

// The same with what the file says of its Gaussians beside them; in ASCII these values are checked too. Errors as
// ReadPly.
Result<GaussianCloud> ReadPlyWithExtras(const InputFile& file, const ReadLimits& limits, ExtraProperties& extras);

// What the header says. Errors as ReadPly.
Result<CloudExtent> ExtentOfPly(const InputFile& file);

// The encoding, and what a file has beside its Gaussians. Errors as ReadPly.
Result<FormatFacts> DescribePly(const InputFile& file);

}  // namespace anchorsplat
