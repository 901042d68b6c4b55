#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "core/random.h"

namespace anchorsplat {

// Layers as papers define them, in double, one number at a time.

// [C,H,W], zero beyond the border.
struct PlainMap {
  int64_t channels = 0, height = 0, width = 0;
  std::vector<double> values;

  PlainMap(int64_t c, int64_t h, int64_t w)
      : channels(c), height(h), width(w), values(static_cast<size_t>(c * h * w)) {}
  double& at(int64_t c, int64_t y, int64_t x) { return values[static_cast<size_t>((c * height + y) * width + x)]; }
  double get(int64_t c, int64_t y, int64_t x) const {
    if (x < 0 || y < 0 || x >= width || y >= height) return 0;
    return values[static_cast<size_t>((c * height + y) * width + x)];
  }
};

// A row-major tensor.
struct PlainTensor {
  std::vector<int64_t> shape;
  std::vector<float> values;
};

inline PlainTensor RandomTensor(std::vector<int64_t> shape, double spread, Random& random) {
  PlainTensor out{std::move(shape), {}};
  int64_t count = 1;
  for (const int64_t side : out.shape) count *= side;
  for (int64_t i = 0; i < count; ++i) out.values.push_back(static_cast<float>(random.Uniform(-spread, spread)));
  return out;
}

// PyTorch's Conv2d, stride 1, with size-preserving padding. `weights` [out, in, side, side].
inline PlainMap PlainConvolution(const PlainMap& in, const PlainTensor& weights, const PlainTensor& bias) {
  const int64_t outputs = weights.shape[0], inputs = weights.shape[1], side = weights.shape[2], reach = side / 2;
  PlainMap out(outputs, in.height, in.width);
  for (int64_t o = 0; o < outputs; ++o) {
    for (int64_t y = 0; y < in.height; ++y) {
      for (int64_t x = 0; x < in.width; ++x) {
        double sum = bias.values[static_cast<size_t>(o)];
        for (int64_t i = 0; i < inputs; ++i) {
          for (int64_t r = 0; r < side; ++r) {
            for (int64_t c = 0; c < side; ++c) {
              sum += double{weights.values[static_cast<size_t>(((o * inputs + i) * side + r) * side + c)]} *
                     in.get(i, y + r - reach, x + c - reach);
            }
          }
        }
        out.at(o, y, x) = sum;
      }
    }
  }
  return out;
}

// PyTorch's ConvTranspose2d(4, stride=2, padding=1). `weights` [in, out, 4, 4].
inline PlainMap PlainTransposedConvolution(const PlainMap& in, const PlainTensor& weights, const PlainTensor& bias) {
  const int64_t inputs = weights.shape[0], outputs = weights.shape[1];
  PlainMap out(outputs, 2 * in.height, 2 * in.width);
  for (int64_t o = 0; o < outputs; ++o) {
    for (int64_t i = 0; i < out.height * out.width; ++i) {
      out.values[static_cast<size_t>(o * out.height * out.width + i)] = bias.values[static_cast<size_t>(o)];
    }
    for (int64_t i = 0; i < inputs; ++i) {
      for (int64_t y = 0; y < in.height; ++y) {
        for (int64_t x = 0; x < in.width; ++x) {
          for (int64_t r = 0; r < 4; ++r) {
            for (int64_t c = 0; c < 4; ++c) {
              const int64_t to_y = 2 * y + r - 1, to_x = 2 * x + c - 1;
              if (to_y < 0 || to_x < 0 || to_y >= out.height || to_x >= out.width) continue;
              out.at(o, to_y, to_x) +=
                  in.get(i, y, x) * double{weights.values[static_cast<size_t>(((i * outputs + o) * 4 + r) * 4 + c)]};
            }
          }
        }
      }
    }
  }
  return out;
}

inline PlainMap PlainShuffle(const PlainMap& in, int64_t scale) {
  PlainMap out(in.channels / (scale * scale), in.height * scale, in.width * scale);
  for (int64_t c = 0; c < out.channels; ++c) {
    for (int64_t y = 0; y < out.height; ++y) {
      for (int64_t x = 0; x < out.width; ++x) {
        out.at(c, y, x) = in.get((c * scale + y % scale) * scale + x % scale, y / scale, x / scale);
      }
    }
  }
  return out;
}

inline PlainMap PlainConcatenation(const std::vector<const PlainMap*>& maps) {
  PlainMap out(0, maps[0]->height, maps[0]->width);
  for (const PlainMap* map : maps) {
    out.channels += map->channels;
    out.values.insert(out.values.end(), map->values.begin(), map->values.end());
  }
  return out;
}

// Applies `f` to each value, given its channel and index.
inline PlainMap PlainApply(PlainMap map, const std::function<double(double value, int64_t channel, size_t at)>& f) {
  for (size_t i = 0; i < map.values.size(); ++i) {
    map.values[i] = f(map.values[i], static_cast<int64_t>(i) / (map.height * map.width), i);
  }
  return map;
}

inline double PlainSigmoid(double x) { return 1 / (1 + std::exp(-x)); }
inline PlainMap PlainSilu(const PlainMap& map) {
  return PlainApply(map, [](double x, int64_t, size_t) { return x * PlainSigmoid(x); });
}
inline PlainMap PlainSlope(const PlainMap& map, const PlainTensor& slopes) {
  return PlainApply(map,
                    [&](double x, int64_t c, size_t) { return x < 0 ? x * slopes.values[static_cast<size_t>(c)] : x; });
}
inline PlainMap PlainGate(const PlainMap& map, const PlainMap& gated) {
  return PlainApply(map, [&](double x, int64_t, size_t i) { return (x + gated.values[i]) * (PlainSigmoid(x) - 0.5); });
}

}  // namespace anchorsplat
