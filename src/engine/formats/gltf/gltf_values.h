#pragma once

#include <cstdint>

#include "core/buffer.h"
#include "core/result.h"
#include "formats/gltf/gltf_document.h"
#include "formats/gltf/gltf_primitives.h"

namespace anchorsplat {

// glTF codes of component types.
inline constexpr int kGltfByte = 5120, kGltfUnsignedByte = 5121, kGltfShort = 5122, kGltfUnsignedShort = 5123,
                     kGltfFloat = 5126;

size_t GltfComponentBytes(const GltfDocument::Accessor& accessor);

// Reads records [first, last) of an accessor. Its last record may be shorter than the stride, which is below 256.
Status ReadGltfBytes(const GltfDocument::Accessor& accessor, int64_t first, int64_t last, Buffer<uint8_t>& bytes);

// Unpacks `count` records to out[i·width + k]. The last record may be shorter than the stride.
void UnpackGltfValues(const GltfDocument::Accessor& accessor, const uint8_t* bytes, int64_t count, float* out,
                      int64_t width);

// Columns of Gaussians with one accessor each: quaternions xyzw, opacities 0–1, lengths.
struct GltfColumns {
  float *means, *quats, *scales, *opacities;
};
// Converts columns to GaussianCloud's representation, in the file's axes, at the primitive's placement. Harmonics are
// not rotated.
void FinishGltfRows(const GltfPrimitive& primitive, int64_t count, const GltfColumns& columns);

}  // namespace anchorsplat
