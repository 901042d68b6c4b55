#include "network/weights.h"

#include <cmath>
#include <string>

#include "core/fingerprint.h"

namespace anchorsplat {

namespace {

double HashUniform(uint64_t name_hash, uint64_t i) {
  uint64_t x = name_hash + (i + 1) * 0x9e3779b97f4a7c15ull;
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ x >> 27) * 0x94d049bb133111ebull;
  x ^= x >> 31;
  return static_cast<double>(x >> 40) / 8388608.0 - 1;
}

}  // namespace

WeightSource HashWeights() {
  return [](const TensorSpec& tensor, std::span<float> values) -> Status {
    const std::string& name = tensor.name;
    double centre = 0, scale = 0.1;  // biases and running means
    if (name.ends_with("running_var")) {
      centre = 1, scale = 0.5;
    } else if (name.starts_with("point_embeddings.")) {
      scale = 0.05;
    } else if (tensor.shape.size() >= 2) {
      scale = std::sqrt(3.0 / (static_cast<double>(values.size()) / static_cast<double>(tensor.shape[0])));
    } else if (name.ends_with(".weight")) {
      centre = 1;
    }
    Fingerprint print;
    print.Add(name);
    const uint64_t hash = print.value();
    for (size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(centre + scale * HashUniform(hash, i));
    return {};
  };
}

}  // namespace anchorsplat
