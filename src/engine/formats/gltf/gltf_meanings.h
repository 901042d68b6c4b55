#pragma once

#include "core/result.h"
#include "formats/gltf/gltf_document.h"

namespace anchorsplat {

// Detects values of the drafts of KHR_gaussian_splatting, which some programs still write: logarithms instead of
// lengths, logits instead of opacities in 0–1. The evidence: at least 1 % of scales are negative; at least 1 % of
// opacities lie outside 0–1, on both sides or up to 30. All values are checked.
//
// kBadFile: fewer values do so, or they lie farther outside, so that neither meaning fits.
Result<bool> HoldsLogarithms(const JsonValue& attribute, const GltfDocument::Accessor& scales);
Result<bool> HoldsLogits(const JsonValue& attribute, const GltfDocument::Accessor& opacities);

}  // namespace anchorsplat
