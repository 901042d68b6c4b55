#pragma once

#include <optional>
#include <string>

#include "compact/compact_network.h"
#include "core/result.h"

namespace anchorsplat {

// The networks built into the program from models/ of the source tree (docs/network.md). A build has all or none.
//   kClassic      anchorsplat-compact.safetensors      classic splats
//   kSingle       anchorsplat-single.safetensors       classic splats, one Gaussian per Gaussian
//   kAntialiased  anchorsplat-antialiased.safetensors  render modes that compensate the dilation (IsCompensated)
enum class Shipped { kClassic, kSingle, kAntialiased };
inline constexpr Shipped kAllShipped[] = {Shipped::kClassic, Shipped::kSingle, Shipped::kAntialiased};

bool HasShippedNetwork();

// Identifies the built-in networks: their sizes and a hash of their bytes. Empty without networks.
std::string ShippedNetworkIdentity();

// Errors: kNotFound in a build without networks; those of LoadCompactNetwork.
Result<CompactNetwork> LoadShippedNetwork(Shipped which = Shipped::kClassic);

}  // namespace anchorsplat
