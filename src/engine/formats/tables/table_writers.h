#pragma once

#include <cstdint>
#include <filesystem>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"

namespace anchorsplat {

// Writers for notebooks and spreadsheets. Both keep all stored values (log-scales, logits, wxyz) in the order of the
// cloud. Errors: kExists, kIo, kBadArgument (inconsistent arrays, no Gaussians).

// CSV: a header with the names of an INRIA PLY (x,y,z,f_dc_0 … f_rest_* channel-major …,opacity,scale_0 …,rot_0 …),
// then a line per Gaussian with the shortest decimals that parse to the same floats.
Status WriteCsv(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});

// For typical numbers of 9 digits; 0 and round ones are shorter, very small ones longer.
uint64_t EstimatedCsvSize(int64_t count, int sh_degree);

// NumPy archive of float32 arrays: means [N,3], log_scales [N,3], quats [N,4] wxyz, opacity_logits [N], sh
// [N,(degree+1)²,3]. Read with numpy.load(path)["means"].
Status WriteNpz(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});
uint64_t PredictedNpzSize(int64_t count, int sh_degree);

}  // namespace anchorsplat
