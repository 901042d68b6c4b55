#pragma once

#include <cstdint>

#include "core/buffer.h"
#include "core/result.h"
#include "formats/gltf/gltf_document.h"
#include "formats/gltf/gltf_primitives.h"

namespace anchorsplat {

// glTF's numbers for types of components.
inline constexpr int kGltfByte = 5120, kGltfUnsignedByte = 5121, kGltfShort = 5122, kGltfUnsignedShort = 5123,
                     kGltfFloat = 5126;

size_t GltfComponentBytes(const GltfDocument::Accessor& accessor);

// Records [first, last) of an accessor, which has as many. The last may be shorter than the stride, which is below 256.
Status ReadGltfBytes(const GltfDocument::Accessor& accessor, int64_t first, int64_t last, Buffer<uint8_t>& bytes);

// `count` records of an accessor to out[i·width + k]. The last record may be shorter than the stride.
void UnpackGltfValues(const GltfDocument::Accessor& accessor, const uint8_t* bytes, int64_t count, float* out,
                      int64_t width);

// Columns of Gaussians as an accessor each gives them: quaternions xyzw, opacities 0–1, lengths.
struct GltfColumns {
  float *means, *quats, *scales, *opacities;
};
// Makes them what a GaussianCloud has, in the file's axes, at the place of the primitive. Harmonics are not turned.
void FinishGltfRows(const GltfPrimitive& primitive, int64_t count, const GltfColumns& columns);

}  // namespace anchorsplat
