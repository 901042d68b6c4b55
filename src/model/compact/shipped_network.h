#pragma once

#include <optional>
#include <string>

#include "core/result.h"
#include "model/compact/compact_network.h"

namespace anchorsplat {

// The compact networks that are part of the program itself, of the folder models/ of the source tree when the program
// was built (docs/network.md): anchorsplat-compact.safetensors for classic splats, which knows standard fits best, and
// anchorsplat-kinds.safetensors, which knows antialiased ones, too. There are both or none.
enum class Shipped { kClassic, kKinds };

bool HasShippedNetwork();

// Tells the shipped networks of one program from those of another: sizes and a hash of their bytes. Empty when there
// are none.
std::string ShippedNetworkIdentity();

// Errors: kNotFound when there is none; those of LoadCompactNetwork.
Result<CompactNetwork> LoadShippedNetwork(Shipped which = Shipped::kClassic);

}  // namespace anchorsplat
