#pragma once

#include <string>

#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// What an enhanced splat says about itself in its comments (GaussianCloud::comments): enhanced once more, it would be
// blurred, as the width that its fit lost has been given back already. Formats without a place for it lose the word
// (core/lost_nothing_mark.h).
//
// `method` as in EnhanceReport::method. `invented`: EnhanceMethod::invents of one of them.
std::string EnhancedComment(const std::string& method, double upscale, bool invented = false);
bool IsMarkedEnhanced(const CloudView& cloud);

// The same of a splat of which a region has been enhanced: another region may be, but not the whole.
std::string PartEnhancedComment(const std::string& method, double upscale, bool invented = false);
bool IsMarkedPartEnhanced(const CloudView& cloud);

// Whether there is nothing to give back to the whole of it, as far as the file says: it was fitted to areas of pixels
// or enhanced before, or a part of it was.
bool HasLostNoWidth(const CloudView& cloud);

}  // namespace anchorsplat
