#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "formats/cloud_io.h"

namespace anchorsplat {

// Splat files in memory.

// Reads a splat. `format`: its extension (".spz", "spz"), or empty to detect it by content. Formats of several files
// are kBadFile. Other errors: kBadArgument: unknown format; those of reading.
Result<GaussianCloud> ReadCloudBytes(std::span<const std::byte> bytes, std::string_view format);

// Writes the file that WriteCloud would. Also kBadArgument: a format of several files.
Result<std::vector<std::byte>> WriteCloudBytes(const CloudView& cloud, std::string_view format,
                                               const CloudWriteOptions& options = {});

}  // namespace anchorsplat
