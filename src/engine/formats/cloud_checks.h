#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"

namespace anchorsplat {

// First check of every writer: consistent arrays, at least one Gaussian (else kBadArgument).
Status CheckWritable(const std::filesystem::path& path, const CloudView& cloud);

// First check of every reader, before allocation: count in 1 … `limits.max_gaussians` (else kBadFile). `where` starts
// the message: "scene.spz: byte 8".
Status CheckCount(const std::string& where, uint64_t count, const ReadLimits& limits);

}  // namespace anchorsplat
