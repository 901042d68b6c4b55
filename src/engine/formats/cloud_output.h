#pragma once

#include <filesystem>
#include <vector>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/extra_properties.h"

namespace anchorsplat {

// Writing a splat after long work.

// All files that WriteCloud creates, `path` first.
std::vector<std::filesystem::path> FilesOfCloud(const std::filesystem::path& path, int sh_degree);

// Checks for WriteCloud's file errors before the work.
Status CheckCanWriteCloud(const std::filesystem::path& path, int sh_degree, const CloudWriteOptions& options = {});

// WriteCloud after the work. If a file of that name has appeared meanwhile, writes to the next free name beside it,
// "scan-2.ply", and returns an error that says so.
Status WriteCloudOrSaveBeside(const std::filesystem::path& path, const CloudView& cloud,
                              const CloudWriteOptions& options = {}, const ExtraProperties& extras = {});

}  // namespace anchorsplat
