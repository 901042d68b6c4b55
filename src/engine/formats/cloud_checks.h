#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"

namespace anchorsplat {

// What every writer asks first: arrays that agree and at least one Gaussian (kBadArgument otherwise).
Status CheckWritable(const std::filesystem::path& path, const CloudView& cloud);

// What every reader asks before it allocates: 1 … `limits.max_gaussians` (kBadFile otherwise). `where` begins the
// message: "scene.spz: byte 8".
Status CheckCount(const std::string& where, uint64_t count, const ReadLimits& limits);

}  // namespace anchorsplat
