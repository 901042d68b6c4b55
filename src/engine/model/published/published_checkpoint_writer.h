#pragma once

#include <filesystem>

#include "core/result.h"
#include "io/write_options.h"
#include "model/published/published_checkpoint.h"

namespace anchorsplat {

// Writes a checkpoint of any readable kind as .safetensors: the tensors as they are, its own metadata, and what
// ArchitectureMetadata says. Errors: those of Checkpoint::Open and WriteSafetensors.
Status ConvertCheckpoint(const std::filesystem::path& from, const std::filesystem::path& to,
                         const WriteOptions& options);

}  // namespace anchorsplat
