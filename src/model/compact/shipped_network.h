#pragma once

#include <optional>
#include <string>

#include "core/result.h"
#include "model/compact/compact_network.h"

namespace anchorsplat {

// The compact network that is part of the program itself: models/anchorsplat-compact.safetensors of the source tree
// when the program was built (docs/network.md). False when there was none.
bool HasShippedNetwork();

// Tells one shipped network from another: size and a hash of its bytes. Empty when there is none.
std::string ShippedNetworkIdentity();

// Errors: kNotFound when there is none; those of LoadCompactNetwork.
Result<CompactNetwork> LoadShippedNetwork();

}  // namespace anchorsplat
