#pragma once

#include <filesystem>
#include <variant>

#include "core/result.h"
#include "model/compact/compact_network.h"
#include "model/published/published_network.h"

namespace anchorsplat {

// What a file of weights may hold.
using AnyNetwork = std::variant<PublishedNetwork, CompactNetwork>;

// True when the file is a tensor file and its metadata that of a compact network. Reads the directory only.
Result<bool> HoldsCompactNetwork(const std::filesystem::path& path);

// Opens either kind, told apart by content. `precision` is for PublishedNetwork; compact networks are fp32.
// Errors: those of TensorFile::Open, LoadCompactNetwork and LoadPublishedNetwork.
Result<AnyNetwork> LoadAnyNetwork(const std::filesystem::path& path,
                                  WeightPrecision precision = WeightPrecision::kFloat);

}  // namespace anchorsplat
