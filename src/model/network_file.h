#pragma once

#include <filesystem>
#include <variant>

#include "core/result.h"
#include "model/compact_network.h"
#include "model/packed_network.h"

namespace anchorsplat {

// What a file of weights may hold.
using AnyNetwork = std::variant<PackedNetwork, CompactNetwork>;

// True when the file is a tensor file and its metadata that of a compact network. Reads the directory only.
Result<bool> HoldsCompactNetwork(const std::filesystem::path& path);

// Opens either kind, told apart by content. `precision` is for PackedNetwork; compact networks are fp32.
// Errors: those of TensorFile::Open, LoadCompactNetwork and LoadNetwork.
Result<AnyNetwork> LoadAnyNetwork(const std::filesystem::path& path,
                                  WeightPrecision precision = WeightPrecision::kFloat);

}  // namespace anchorsplat
