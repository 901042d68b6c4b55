#include "upscale/convolution.h"

#include <algorithm>
#include <cstddef>

#include "core/buffer.h"
#include "core/parallel.h"
#include "kernels/matrix_tile.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "upscale/convolution.cc"
#include <hwy/foreach_target.h>  // compiles this file once per SIMD target
#include <hwy/highway.h>

#include "kernels/matrix_tile-inl.h"
#include "kernels/vector_math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {

// 1/(1 + e^−x); saturates to 0 and 1.
template <class D, class V = hn::VFromD<D>>
HWY_INLINE V Sigmoid(D d, V x) {
  const V one = hn::Set(d, 1.0f);
  const V exponent = hn::Min(hn::Mul(x, hn::Set(d, -1.4426950408889634f)), hn::Set(d, 125.0f));
  return hn::Div(one, hn::Add(one, Exp2(d, exponent)));
}

// Activates `count` sums; `gated` and `slopes` start at the same channel.
template <class D, class V = hn::VFromD<D>>
HWY_INLINE V Activated(D d, MapActivation activation, V x, const float* slopes, const float* gated) {
  switch (activation) {
    case MapActivation::kNone:
      return x;
    case MapActivation::kSlope:
      return hn::IfThenElse(hn::Lt(x, hn::Zero(d)), hn::Mul(x, hn::LoadU(d, slopes)), x);
    case MapActivation::kSilu:
      return hn::Mul(x, Sigmoid(d, x));
    case MapActivation::kGate:
      return hn::Mul(hn::Add(x, hn::LoadU(d, gated)), hn::Sub(Sigmoid(d, x), hn::Set(d, 0.5f)));
  }
  return x;
}

// Activates sums that are still in the L1 cache.
void ActivateColumns(const ConvolutionParams& p, int64_t column, int64_t columns, float* out, const float* gated) {
  const TileTag d;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  const float* slopes = p.slopes != nullptr ? p.slopes + column : nullptr;
  int64_t c = 0;
  for (; c + lanes <= columns; c += lanes) {
    const auto y = Activated(d, p.activation, hn::LoadU(d, out + c), slopes + (slopes != nullptr ? c : 0),
                             gated + (gated != nullptr ? c : 0));
    hn::StoreU(y, d, out + c);
  }
  if (c == columns) return;
  alignas(64) float sums[PackedWeights::kPanel] = {}, slope[PackedWeights::kPanel] = {},
                    partner[PackedWeights::kPanel] = {};
  std::copy(out + c, out + columns, sums);
  if (slopes != nullptr) std::copy(slopes + c, slopes + columns, slope);
  if (gated != nullptr) std::copy(gated + c, gated + columns, partner);
  hn::StoreU(Activated(d, p.activation, hn::LoadU(d, sums), slope, partner), d, sums);
  std::copy(sums, sums + (columns - c), out + c);
}

// Convolves rows [begin, end) of the picture.
void ConvolveRows(const ConvolutionParams& p, int64_t begin, int64_t end) {
  const int64_t outputs = p.out->channels(), width = p.out->width();
  for (int64_t y = begin; y < end; ++y) {
    for (int64_t column = 0; column < outputs; column += kTileColumns) {
      const int64_t columns = std::min(kTileColumns, outputs - column);
      for (int64_t x = 0; x < width; x += kTileRows) {
        const int64_t pixels = std::min<int64_t>(kTileRows, width - x);
        float* out[kMostTileRows];
        for (int64_t r = 0; r < pixels; ++r) out[r] = p.out->pixel(x + r, y) + column;
        const float* bias = p.inputs.front().weights->bias() + column;
        for (const ConvolutionInput& input : p.inputs) {
          const PackedWeights& w = *input.weights;
          const int64_t reach = w.taps() / 2;  // pixels on each side of the centre
          for (int64_t tap = 0; tap < w.taps(); ++tap) {
            MultiplyTile(pixels, columns,
                         {.depth = w.inputs(),
                          .input = input.map->pixel(x - reach, y + tap - reach),
                          .stride = input.map->channels(),
                          .weights = w.panel(tap, column / PackedWeights::kPanel),
                          .panel_stride = w.inputs() * PackedWeights::kPanel,
                          .bias = bias,
                          .added = bias == nullptr ? out : nullptr,
                          .out = out});
            bias = nullptr;  // later inputs add to these sums
          }
        }
        if (p.activation == MapActivation::kNone) continue;
        for (int64_t r = 0; r < pixels; ++r) {
          ActivateColumns(p, column, columns, out[r], p.gated != nullptr ? p.gated->pixel(x + r, y) + column : nullptr);
        }
      }
    }
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(ConvolveRows);

PackedWeights PackConvolution(const float* weights, const float* bias, int64_t outputs, int64_t inputs, int64_t side) {
  Buffer<float> turned(static_cast<size_t>(outputs * inputs * side * side));
  for (int64_t o = 0; o < outputs; ++o) {
    for (int64_t i = 0; i < inputs; ++i) {
      for (int64_t row = 0; row < side; ++row) {
        for (int64_t column = 0; column < side; ++column) {
          turned[static_cast<size_t>(((o * side + row) * side + column) * inputs + i)] =
              weights[((o * inputs + i) * side + row) * side + column];
        }
      }
    }
  }
  return {turned.data(), bias, outputs, side * inputs, side};
}

PackedWeights PackTransposedConvolution(const float* weights, const float* bias, int64_t outputs, int64_t inputs) {
  Buffer<float> phases(static_cast<size_t>(4 * outputs * inputs * 9));
  std::fill(phases.begin(), phases.end(), 0.0f);
  Buffer<float> biases(static_cast<size_t>(4 * outputs));
  // Pixel 2i + phase of the output gets w[k] of input j where 2j + k = 2i + phase + 1.
  const auto tap = [](int64_t phase, int64_t offset) { return phase + 1 - 2 * offset; };
  for (int64_t channel = 0; channel < 4 * outputs; ++channel) {
    const int64_t o = channel / 4, row_phase = channel % 4 / 2, column_phase = channel % 2;
    biases[static_cast<size_t>(channel)] = bias != nullptr ? bias[o] : 0.0f;
    for (int64_t i = 0; i < inputs; ++i) {
      for (int64_t dy = -1; dy <= 1; ++dy) {
        for (int64_t dx = -1; dx <= 1; ++dx) {
          const int64_t row = tap(row_phase, dy), column = tap(column_phase, dx);
          if (row < 0 || row > 3 || column < 0 || column > 3) continue;
          phases[static_cast<size_t>(((channel * inputs + i) * 3 + dy + 1) * 3 + dx + 1)] =
              weights[((i * outputs + o) * 4 + row) * 4 + column];
        }
      }
    }
  }
  return PackConvolution(phases.data(), biases.data(), 4 * outputs, inputs, 3);
}

void ConvolutionCpu(const ConvolutionParams& p) {
  const auto convolve = HWY_DYNAMIC_DISPATCH(ConvolveRows);
  ParallelFor(0, p.out->height(), 1, [&](int64_t begin, int64_t end) { convolve(p, begin, end); });
}

}  // namespace anchorsplat
#endif
