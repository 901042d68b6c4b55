#pragma once

#include <filesystem>

#include "core/result.h"
#include "io/write_options.h"
#include "published/published_checkpoint.h"

namespace anchorsplat {

// Converts any readable checkpoint to .safetensors: tensors unchanged, its metadata plus ArchitectureMetadata. Errors:
// those of Checkpoint::Open and WriteSafetensors.
Status ConvertCheckpoint(const std::filesystem::path& from, const std::filesystem::path& to,
                         const WriteOptions& options);

}  // namespace anchorsplat
