#pragma once

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "enhance/enhance.h"

namespace anchorsplat::web {

// Whether enhancing this splat fits into the 4 GB of addresses that a module of WebAssembly has: said before the work,
// not after it. Always, where addresses have 64 bits. Errors: kIo, with what takes less.
Status CheckAddresses(const GaussianCloud& cloud, const EnhanceOptions& options);

}  // namespace anchorsplat::web
