#pragma once

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "enhance/enhance.h"

namespace anchorsplat::web {

// Checks before the work whether enhancing this splat fits into the 4 GB of a WebAssembly module. Always true with
// 64-bit addresses. Errors: kIo, with what needs less.
Status CheckAddresses(const GaussianCloud& cloud, const EnhanceOptions& options);

}  // namespace anchorsplat::web
