#include "formats/gltf/gltf_values.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>

#include "core/rotation.h"
#include "formats/number_or_nan.h"

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

Status ReadGltfBytes(const Accessor& accessor, int64_t first, int64_t last, Buffer<uint8_t>& bytes) {
  const size_t record = GltfComponentBytes(accessor) * static_cast<size_t>(accessor.components);
  bytes.resize(static_cast<size_t>(last - first - 1) * static_cast<size_t>(accessor.stride) + record);
  return accessor.file->ReadAt(accessor.begin + static_cast<uint64_t>(first) * accessor.stride, bytes.data(),
                               bytes.size());
}

// Σ' = M Σ Mᵀ with M = scale·turn: a mirroring turn gives the same as its negative, which is a rotation.
void FinishGltfRows(const GltfPrimitive& primitive, int64_t count, const GltfColumns& columns) {
  const GltfPlace& place = primitive.place;
  const bool turns = place.turns();
  std::array<double, 9> rotation = place.turn;
  if (place.mirrors()) std::ranges::transform(rotation, rotation.begin(), std::negate());
  const std::array<double, 4> p = QuaternionFromRotation(rotation);
  const auto log_of_scale = static_cast<float>(std::log(place.scale));
  for (int64_t i = 0; i < count; ++i) {
    float* q = columns.quats + 4 * i;
    std::rotate(q, q + 3, q + 4);  // xyzw to wxyz
    if (turns) {
      // zero becomes the identity before it is composed
      if (q[0] == 0 && q[1] == 0 && q[2] == 0 && q[3] == 0) q[0] = 1;
      const std::array<double, 4> old = {q[0], q[1], q[2], q[3]};
      q[0] = static_cast<float>(p[0] * old[0] - p[1] * old[1] - p[2] * old[2] - p[3] * old[3]);
      q[1] = static_cast<float>(p[0] * old[1] + p[1] * old[0] + p[2] * old[3] - p[3] * old[2]);
      q[2] = static_cast<float>(p[0] * old[2] - p[1] * old[3] + p[2] * old[0] + p[3] * old[1]);
      q[3] = static_cast<float>(p[0] * old[3] + p[1] * old[2] - p[2] * old[1] + p[3] * old[0]);
    }
    if (!primitive.logits) columns.opacities[i] = LogitFromStoredOpacity(columns.opacities[i]);
    float* const mean = columns.means + 3 * i;
    const std::array<double, 3> at = {mean[0], mean[1], mean[2]};
    for (size_t k = 0; k < 3; ++k) {
      float& scale = columns.scales[3 * i + static_cast<int64_t>(k)];
      scale = (primitive.logarithms ? scale : LogFromStoredScale(scale)) + log_of_scale;
      const double* const row = place.turn.data() + 3 * k;
      const double along = turns ? row[0] * at[0] + row[1] * at[1] + row[2] * at[2] : at[k];
      mean[k] = static_cast<float>(place.scale * along + place.translation[k]);
    }
  }
}

}  // namespace anchorsplat
