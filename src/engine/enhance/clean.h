#pragma once

#include "enhance/enhance.h"

namespace anchorsplat {

// EnhanceOptions::clean, within the region where there is one. Says what it took out. Errors: those of FindUnseen and
// OpenProject; kBadArgument: it would take out everything.
Status Clean(const EnhanceOptions& options, GaussianCloud& cloud, EnhanceReport& report);

}  // namespace anchorsplat
