#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "core/cloud_view.h"
#include "enhance/trained_kind.h"

namespace anchorsplat {

// Fewer than that are less than any fit has that our estimates have learned from.
inline constexpr int64_t kFewGaussians = 2000;

// What `enhance` gives back to a splat, and why.
enum class LostWidthReason {
  kTagged,             // the file says how it was trained
  kSizes,              // its sizes say it
  kUnclear,            // they are like those of no kind: only a little, which harms none of them
  kRaised,             // they were trained with lower opacities: likewise
  kTooFew,             // too few Gaussians to tell: taken for a classic one where there are kFewGaussians, else little
  kFittedToAreas,      // nothing was lost
  kMarkedEnhanced,     // nothing is lost any more
  kPartMarked,         // of a part of it nothing is lost any more
  kWidened,            // the same, by its sizes
  kWidenedButTagged,   // by its sizes, although it is tagged classic or antialiased
  kLooksEnhanced,      // by what a network leaves
  kEnhancedButTagged,  // and although it is tagged so
};

// The words of `info`'s JSON.
std::string_view NameOf(LostWidthReason reason);

struct LostWidth {
  double strength = 0;  // f of enhance/filter.h, at the zoom that was asked for
  LostWidthReason reason = LostWidthReason::kSizes;

  // Of what is called likely nine in ten hold on every kind of fit (docs/results/recognised.md).
  bool likely() const {
    return reason != LostWidthReason::kUnclear && reason != LostWidthReason::kRaised &&
           reason != LostWidthReason::kTooFew;
  }
};

// `looks`: BesideTag of what the cloud looks like; nothing where the tag is to be believed. upscale ≥ 1. `gaussians`:
// how many it has, where `cloud` is only what its file says; else its size.
LostWidth FindLostWidth(const CloudView& cloud, std::optional<TrainedKind> looks, double upscale,
                        std::optional<int64_t> gaussians = {});

}  // namespace anchorsplat
