#include "kernels/linear.h"

#include <algorithm>

#include "core/buffer.h"
#include "core/parallel.h"
#include "core/per_thread.h"
#include "kernels/bfloat16_tile.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/linear.cc"
#include <hwy/foreach_target.h>  // compiles this file once per SIMD target
#include <hwy/highway.h>

#include "kernels/matrix_tile-inl.h"
#include "kernels/vector_math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {

// Applies the activation to a tile that is still in the L1 cache.
void Activate(Activation activation, int64_t rows, int64_t columns, float* const* out) {
  const TileTag d;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  alignas(64) float rest[PackedWeights::kPanel];
  for (int64_t r = 0; r < rows; ++r) {
    const auto apply = [&](float* at) HWY_ATTR {
      const auto x = hn::LoadU(d, at);
      // not Max(x, 0): its result for NaN depends on the machine
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

// Computes rows [begin, end) in tiles of at most `tile_rows` × `tile_columns`; `multiply(row, rows, column, columns,
// added, out)` computes a tile's products.
template <typename Multiply>
void LinearTiles(const LinearParams& p, int64_t begin, int64_t end, int64_t tile_rows, int64_t tile_columns,
                 const Multiply& multiply) {
  // Without activation, the residual is added to the sums in registers.
  const bool residual_inside = p.residual != nullptr && p.activation == Activation::kNone;
  const bool residual_after = p.residual != nullptr && !residual_inside;
  constexpr int64_t kMostColumns = 2 * PackedWeights::kPanel;
  for (int64_t column = 0; column < p.weights->outputs(); column += tile_columns) {
    const int64_t columns = std::min(tile_columns, p.weights->outputs() - column);
    for (int64_t row = begin; row < end; row += tile_rows) {
      const int64_t rows = std::min<int64_t>(tile_rows, end - row);
      float* out[kMostTileRows];
      const float* added[kMostTileRows];
      for (int64_t r = 0; r < rows; ++r) {
        out[r] = p.out + (row + r) * p.output_stride + column;
        added[r] = p.residual != nullptr ? p.residual + (row + r) * p.output_stride + column : nullptr;
      }
      float kept[kMostTileRows][kMostColumns];  // `residual` may be `out`
      if (residual_after) {
        for (int64_t r = 0; r < rows; ++r) {
          std::copy_n(added[r], columns, kept[r]);
          added[r] = kept[r];
        }
      }
      multiply(row, rows, column, columns, residual_inside ? added : nullptr, out);
      if (p.activation != Activation::kNone) Activate(p.activation, rows, columns, out);
      if (residual_after) AddRows(rows, columns, added, out);
    }
  }
}

void LinearRows(const LinearParams& p, int64_t begin, int64_t end) {
  const PackedWeights& w = *p.weights;
  LinearTiles(
      p, begin, end, kTileRows, kTileColumns,
      [&](int64_t row, int64_t rows, int64_t column, int64_t columns, const float* const* added, float* const* out) {
        MultiplyTile(rows, columns,
                     {.depth = w.inputs(),
                      .input = p.input + row * p.input_stride,
                      .stride = p.input_stride,
                      .weights = w.panel(0, column / PackedWeights::kPanel),
                      .panel_stride = w.inputs() * PackedWeights::kPanel,
                      .bias = w.bias() + column,
                      .added = added,
                      .out = out});
      });
}

// The same with inputs rounded to bfloat16 into `rounded`.
void LinearRowsBFloat16(const LinearParams& p, int64_t begin, int64_t end, Buffer<BFloat16Pair>& rounded) {
  const PackedWeights& w = *p.weights;
  const BFloat16Product product = ChooseBFloat16Product();
  rounded.resize(static_cast<size_t>((end - begin) * w.pairs()));
  for (int64_t row = begin; row < end; ++row) {
    RoundToPairs(p.input + row * p.input_stride, w.inputs(), rounded.data() + (row - begin) * w.pairs());
  }
  LinearTiles(
      p, begin, end, product.rows, product.columns,
      [&](int64_t row, int64_t rows, int64_t column, int64_t columns, const float* const* added, float* const* out) {
        product.multiply(rows, columns,
                         {.depth = w.pairs(),
                          .input = rounded.data() + (row - begin) * w.pairs(),
                          .stride = w.pairs(),
                          .weights = w.pair_panel(0, column / PackedWeights::kPanel),
                          .panel_stride = w.pairs() * PackedWeights::kPanel,
                          .bias = w.bias() + column,
                          .added = added,
                          .out = out});
      });
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(LinearRows);
HWY_EXPORT(LinearRowsBFloat16);

namespace {

// Rows per task: a multiple of every tile height, so that at most the last tile is not full. A task's inputs should
// stay in the L2 cache while weights stream by. Results do not depend on it.
int64_t RowsPerTask(int64_t rows, int64_t depth) {
  constexpr int64_t kTiles = 2 * 3 * 7;  // tiles have 2, 6 or 14 rows
  constexpr int64_t kInputBytes = int64_t{256} << 10;
  int64_t tasks = std::clamp<int64_t>(kInputBytes / (4 * kTiles * std::max<int64_t>(1, depth)), 1, 5);
  while (tasks > 1 && rows / (kTiles * tasks) < 4 * ThreadCount()) --tasks;
  return kTiles * tasks;
}

}  // namespace

void LinearCpu(const LinearParams& p) {
  const int64_t rows_per_task = RowsPerTask(p.rows, p.weights->inputs());
  if (p.weights->precision() == WeightPrecision::kBFloat16) {
    const auto rows = HWY_DYNAMIC_DISPATCH(LinearRowsBFloat16);
    ParallelFor(0, p.rows, rows_per_task, [&](int64_t begin, int64_t end) {
      auto& rounded = PerThread<Buffer<BFloat16Pair>>();
      rows(p, begin, end, rounded);
    });
    return;
  }
  const auto rows = HWY_DYNAMIC_DISPATCH(LinearRows);
  ParallelFor(0, p.rows, rows_per_task, [&](int64_t begin, int64_t end) { rows(p, begin, end); });
}

void LinearCpu(int64_t rows, const float* input, const PackedWeights& weights, float* out, Activation activation,
               const float* residual) {
  LinearCpu({.rows = rows,
             .input = input,
             .input_stride = weights.inputs(),
             .weights = &weights,
             .activation = activation,
             .residual = residual,
             .out = out,
             .output_stride = weights.outputs()});
}

}  // namespace anchorsplat
#endif
