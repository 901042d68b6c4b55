#pragma once

#include <optional>

#include "core/render_mode.h"
#include "enhance/showing_gaussians.h"
#include "enhance/trained_kind.h"

namespace anchorsplat {

// Fits to soft pictures (out of focus, enlarged) keep no thin Gaussians either, and look antialiased by their sizes.
// But their outlines are softer than classic Gaussians of their sizes leave them: PixelSizeEstimate::softness is 0.37
// to 0.67 in 32 such fits (0.80 in one more), and 1 in thirteen antialiased ones (0.87 in one more). Taken for
// antialiased their pixels would be 1.5 to 3.4 times too large. Antialiased hedges have outlines as soft (0.52 to
// 0.71), but opaque Gaussians among the thinnest, or shorter tails.
//
// `kind`: TrainedKindOf. What looks antialiased or unclear without a tag and is of soft pictures is classic, unless its
// Gaussians are as thick as where a width was added.
std::optional<TrainedKind> BesideSoftness(std::optional<TrainedKind> kind, std::optional<RenderMode> tag,
                                          const ShowingGaussians& showing);

}  // namespace anchorsplat
