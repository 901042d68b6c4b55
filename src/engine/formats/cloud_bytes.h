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

// Splat files that are bytes in memory.

// Reads one. `format` is its extension (".spz", "spz") or empty: found by the content. Nothing but the bytes is looked
// at, so that what consists of several files is kBadFile. Other errors: kBadArgument: no such format; those of reading.
Result<GaussianCloud> ReadCloudBytes(std::span<const std::byte> bytes, std::string_view format);

// The bytes of the file that WriteCloud would make. kBadArgument too: a format of several files.
Result<std::vector<std::byte>> WriteCloudBytes(const CloudView& cloud, std::string_view format,
                                               const CloudWriteOptions& options = {});

}  // namespace anchorsplat
