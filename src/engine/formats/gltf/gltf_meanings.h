#pragma once

#include "core/result.h"
#include "formats/gltf/gltf_document.h"

namespace anchorsplat {

// What programs of the drafts of KHR_gaussian_splatting wrote, and some still do, in the place of lengths and of
// opacities from 0 to 1, is known by its values: a hundredth of the lengths or more are negative; a hundredth of the
// opacities or more lie outside, on both sides or up to 30. All values are looked at.
//
// kBadFile: fewer of them do, or they lie farther out, so that neither meaning fits.
Result<bool> HoldsLogarithms(const JsonValue& attribute, const GltfDocument::Accessor& scales);
Result<bool> HoldsLogits(const JsonValue& attribute, const GltfDocument::Accessor& opacities);

}  // namespace anchorsplat
