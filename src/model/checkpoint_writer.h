#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "core/result.h"
#include "formats/cloud_io.h"
#include "model/checkpoint.h"

namespace anchorsplat {

// What the metadata of a checkpoint says about its architecture, read off its tensors: architecture, K, epsilon,
// grid_resolution, patch_size, encoder and decoder widths, blocks and heads.
std::map<std::string, std::string> ArchitectureMetadata(const NetworkConfig& config);

// Writes a checkpoint of any readable kind as .safetensors: the tensors as they are, its own metadata, and what
// ArchitectureMetadata says. Errors: those of Checkpoint::Open and WriteSafetensors.
Status ConvertCheckpoint(const std::filesystem::path& from, const std::filesystem::path& to,
                         const WriteOptions& options);

}  // namespace anchorsplat
