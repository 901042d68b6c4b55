#pragma once

#include <cstdint>
#include <filesystem>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"

namespace anchorsplat {

// For notebooks and spreadsheets. Both keep every stored value as it is (log-scales, logits, wxyz), in the order of the
// cloud. Errors: kExists, kIo, kBadArgument (arrays that disagree, no Gaussians).

// Text: a line of names as in an INRIA PLY (x,y,z,f_dc_0 … f_rest_* channel-major …,opacity,scale_0 …,rot_0 …), then a
// line per Gaussian with the shortest decimal numbers that read back as the same floats.
Status WriteCsv(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});

// Of numbers as fits have them, 9 digits each: 0 and round ones take less, very small ones more.
uint64_t EstimatedCsvSize(int64_t count, int sh_degree);

// NumPy's archive of float32 arrays: means [N,3], log_scales [N,3], quats [N,4] wxyz, opacity_logits [N],
// sh [N,(degree+1)²,3]. numpy.load(path)["means"].
Status WriteNpz(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});
uint64_t PredictedNpzSize(int64_t count, int sh_degree);

}  // namespace anchorsplat
