#include "formats/gltf/gltf_values.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/activations.h"

namespace anchorsplat {

namespace {

using Accessor = GltfDocument::Accessor;

template <typename T>
float Integer(const uint8_t* bytes, bool normalized, float largest) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return normalized ? std::max(-1.0f, static_cast<float>(value) / largest) : static_cast<float>(value);
}

float Component(const Accessor& accessor, const uint8_t* bytes) {
  switch (accessor.component_type) {
    case kGltfByte:
      return Integer<int8_t>(bytes, accessor.normalized, 127);
    case kGltfUnsignedByte:
      return Integer<uint8_t>(bytes, accessor.normalized, 255);
    case kGltfShort:
      return Integer<int16_t>(bytes, accessor.normalized, 32767);
    case kGltfUnsignedShort:
      return Integer<uint16_t>(bytes, accessor.normalized, 65535);
    default: {
      float value;
      std::memcpy(&value, bytes, sizeof value);
      return value;
    }
  }
}

}  // namespace

size_t GltfComponentBytes(const Accessor& accessor) {
  return accessor.component_type <= kGltfUnsignedByte ? 1 : accessor.component_type <= kGltfUnsignedShort ? 2 : 4;
}

void UnpackGltfValues(const Accessor& accessor, const uint8_t* bytes, int64_t count, float* out, int64_t width) {
  const size_t component = GltfComponentBytes(accessor);
  for (int64_t i = 0; i < count; ++i, bytes += accessor.stride) {
    for (int k = 0; k < accessor.components; ++k) {
      out[i * width + k] = Component(accessor, bytes + static_cast<size_t>(k) * component);
    }
  }
}

void FinishGltfRows(const GltfPrimitive& primitive, bool logarithms, int64_t count, const GltfColumns& columns) {
  const auto log_of_scale = static_cast<float>(std::log(primitive.scale));
  for (int64_t i = 0; i < count; ++i) {
    float* q = columns.quats + 4 * i;
    std::rotate(q, q + 3, q + 4);  // xyzw to wxyz
    columns.opacities[i] = LogitFromOpacity(columns.opacities[i]);
    for (int64_t k = 0; k < 3; ++k) {
      float& scale = columns.scales[3 * i + k];
      scale = (logarithms ? scale : LogFromScale(scale)) + log_of_scale;
      float& mean = columns.means[3 * i + k];
      mean = static_cast<float>(primitive.scale * double{mean} + primitive.translation[static_cast<size_t>(k)]);
    }
  }
}

}  // namespace anchorsplat
