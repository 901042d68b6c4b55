#pragma once

#include <filesystem>
#include <vector>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/extra_properties.h"

namespace anchorsplat {

// Writing a splat that took long to make.

// All files that WriteCloud makes, the one that is named first.
std::vector<std::filesystem::path> FilesOfCloud(const std::filesystem::path& path, int sh_degree);

// The errors that WriteCloud would have with these files, before the work.
Status CheckCanWriteCloud(const std::filesystem::path& path, int sh_degree, const CloudWriteOptions& options = {});

// WriteCloud after the work. Where the name cannot be had any more, because a file of that name came into being
// meanwhile, the result goes to the next free name beside it, "scan-2.ply", and the error says so.
Status WriteCloudOrKeep(const std::filesystem::path& path, const CloudView& cloud,
                        const CloudWriteOptions& options = {}, const ExtraProperties& extras = {});

}  // namespace anchorsplat
