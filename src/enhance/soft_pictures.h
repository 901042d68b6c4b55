#pragma once

#include <optional>

#include "core/render_mode.h"
#include "enhance/showing_gaussians.h"
#include "enhance/trained_kind.h"

namespace anchorsplat {

// Fits to soft pictures (out of focus, enlarged) keep no thin Gaussians either, and look antialiased by their sizes.
// But their outlines are softer than classic Gaussians of their sizes leave them, by 0.33 to 0.67 in 45 such fits,
// which those of antialiased ones are not (1 in thirteen, 0.87 in one; PixelSizeEstimate::softness). Taken for
// antialiased their pixels would be 1.5 to 3.4 times too large.
//
// `kind`: TrainedKindOf. What looks antialiased without a tag and is of soft pictures is classic.
std::optional<TrainedKind> BesideSoftness(std::optional<TrainedKind> kind, std::optional<RenderMode> tag,
                                          const ShowingGaussians& showing);

}  // namespace anchorsplat
