#pragma once

#include "enhance/enhance.h"

namespace anchorsplat {

// Removes unseen Gaussians for EnhanceOptions::clean, within the region if there is one, and logs it. Errors: those of
// FindUnseen and OpenProject; kBadArgument if it would remove everything.
Status Clean(const EnhanceOptions& options, GaussianCloud& cloud, EnhanceReport& report);

}  // namespace anchorsplat
