#pragma once

#include <filesystem>
#include <variant>

#include "compact/compact_network.h"
#include "core/result.h"
#include "published/published_network.h"

namespace anchorsplat {

// The network in a weights file, of either kind.
using AnyNetwork = std::variant<PublishedNetwork, CompactNetwork>;

// Whether the file is a tensor file whose metadata names a compact network. Reads only the tensor directory.
Result<bool> HoldsCompactNetwork(const std::filesystem::path& path);

// Loads a network; the file's content decides which kind. `precision` applies to PublishedNetwork; compact networks
// run in fp32.
// Errors: those of TensorFile::Open, LoadCompactNetwork and LoadPublishedNetwork.
Result<AnyNetwork> LoadAnyNetwork(const std::filesystem::path& path,
                                  WeightPrecision precision = WeightPrecision::kFloat);

}  // namespace anchorsplat
