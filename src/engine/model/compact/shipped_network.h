#pragma once

#include <optional>
#include <string>

#include "core/result.h"
#include "model/compact/compact_network.h"

namespace anchorsplat {

// The compact networks that are part of the program itself, of the folder models/ of the source tree when the program
// was built (docs/network.md): anchorsplat-compact.safetensors for splats like standard fits,
// anchorsplat-classic.safetensors for all other classic ones, anchorsplat-single.safetensors for classic ones of which
// one Gaussian is to become one, and anchorsplat-antialiased.safetensors for those whose render mode makes up for the
// dilation (IsCompensated). There are all or none.
enum class Shipped { kStandard, kClassic, kSingle, kAntialiased };
inline constexpr Shipped kAllShipped[] = {Shipped::kStandard, Shipped::kClassic, Shipped::kSingle,
                                          Shipped::kAntialiased};

bool HasShippedNetwork();

// Tells the shipped networks of one program from those of another: sizes and a hash of their bytes. Empty when there
// are none.
std::string ShippedNetworkIdentity();

// Errors: kNotFound when there is none; those of LoadCompactNetwork.
Result<CompactNetwork> LoadShippedNetwork(Shipped which = Shipped::kStandard);

}  // namespace anchorsplat
