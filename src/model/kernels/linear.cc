#include "model/kernels/linear.h"

#include <algorithm>

#include "core/parallel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/kernels/linear.cc"
#include <hwy/foreach_target.h>  // compiles this file once per SIMD target
#include <hwy/highway.h>

#include "model/kernels/matrix_tile-inl.h"
#include "model/kernels/vector_math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {

// On a tile that was just written and is still in the first cache.
void Activate(Activation activation, int64_t rows, int64_t columns, float* const* out) {
  const TileTag d;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  alignas(64) float rest[PackedWeights::kPanel];
  for (int64_t r = 0; r < rows; ++r) {
    const auto apply = [&](float* at) HWY_ATTR {
      const auto x = hn::LoadU(d, at);
      // not Max(x, 0): what that makes of NaN depends on the machine
      const auto y = activation == Activation::kGelu ? Gelu(d, x) : hn::IfThenZeroElse(hn::Lt(x, hn::Zero(d)), x);
      hn::StoreU(y, d, at);
    };
    int64_t c = 0;
    for (; c + lanes <= columns; c += lanes) apply(out[r] + c);
    if (c < columns) {
      std::fill(rest, rest + lanes, 0.0f);
      std::copy(out[r] + c, out[r] + columns, rest);
      apply(rest);
      std::copy(rest, rest + (columns - c), out[r] + c);
    }
  }
}

void AddRows(int64_t rows, int64_t columns, const float* const* added, float* const* out) {
  for (int64_t r = 0; r < rows; ++r) {
    for (int64_t c = 0; c < columns; ++c) out[r][c] += added[r][c];
  }
}

void LinearRows(const LinearParams& p, int64_t begin, int64_t end) {
  const PackedWeights& w = *p.weights;
  const int64_t panel_stride = w.inputs() * PackedWeights::kPanel;
  // A residual joins the sums in registers unless an activation stands between.
  const bool residual_inside = p.residual != nullptr && p.activation == Activation::kNone;
  for (int64_t column = 0; column < w.outputs(); column += kTileColumns) {
    const int64_t columns = std::min(kTileColumns, w.outputs() - column);
    for (int64_t row = begin; row < end; row += kTileRows) {
      const int64_t rows = std::min<int64_t>(kTileRows, end - row);
      float* out[kTileRows];
      const float* added[kTileRows];
      for (int64_t r = 0; r < rows; ++r) {
        out[r] = p.out + (row + r) * p.output_stride + column;
        added[r] = p.residual != nullptr ? p.residual + (row + r) * p.output_stride + column : nullptr;
      }
      const bool separate = p.residual != nullptr && !residual_inside;
      float kept[kTileRows][kTileColumns];  // the residual may be where the sums go
      if (separate) {
        for (int64_t r = 0; r < rows; ++r) {
          std::copy_n(added[r], columns, kept[r]);
          added[r] = kept[r];
        }
      }
      MultiplyTile(rows, columns,
                   {.depth = w.inputs(),
                    .input = p.input + row * p.input_stride,
                    .stride = p.input_stride,
                    .weights = w.panel(0, column / PackedWeights::kPanel),
                    .panel_stride = panel_stride,
                    .bias = w.bias() + column,
                    .added = residual_inside ? added : nullptr,
                    .out = out});
      if (p.activation != Activation::kNone) Activate(p.activation, rows, columns, out);
      if (separate) AddRows(rows, columns, added, out);
    }
  }
}

int64_t RowsPerTask(int64_t depth) {
  // Its inputs should stay in the second cache while the weights stream by.
  constexpr int64_t kInputBytes = int64_t{256} << 10;
  const int64_t tiles = kInputBytes / (int64_t{4} * kTileRows * std::max<int64_t>(1, depth));
  return kTileRows * std::clamp<int64_t>(tiles, 2, 16);
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(LinearRows);
HWY_EXPORT(RowsPerTask);

void LinearCpu(const LinearParams& p) {
  const auto rows = HWY_DYNAMIC_DISPATCH(LinearRows);
  ParallelFor(0, p.rows, HWY_DYNAMIC_DISPATCH(RowsPerTask)(p.weights->inputs()),
              [&](int64_t begin, int64_t end) { rows(p, begin, end); });
}

}  // namespace anchorsplat
#endif
