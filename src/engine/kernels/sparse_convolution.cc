#include "kernels/sparse_convolution.h"

#include <algorithm>
#include <cstring>

#include "core/buffer.h"
#include "core/parallel.h"
#include "core/per_thread.h"
#include "kernels/bfloat16_tile.h"
#include "kernels/voxel_neighbours.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/sparse_convolution.cc"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>  // compiles this file once per SIMD target
#include <hwy/highway.h>

#include "kernels/matrix_tile-inl.h"

#ifndef ANCHORSPLAT_SPARSE_CONVOLUTION_ONCE
#define ANCHORSPLAT_SPARSE_CONVOLUTION_ONCE
namespace anchorsplat {

// Output rows per task. Large enough to fill most tiles of an offset, small enough that sums stay in the L2 cache.
constexpr int64_t kConvolutionRows = 512;
// Output channels per task: one offset's weights stay in the L2 cache too.
constexpr int64_t kConvolutionColumns = 256;

struct ConvolutionScratch {
  int32_t targets[kConvolutionRows];
  int32_t sources[kConvolutionRows];
  Buffer<float> gathered;        // inputs of one tile
  Buffer<BFloat16Pair> rounded;  // the same in bfloat16
};

}  // namespace anchorsplat
#endif

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {

// Convolves rows [begin, end) and output channels [first, last), in tiles of at most `tile_rows` × `tile_columns`.
// `gather(slot, row)` copies a row's inputs into a slot of the tile. `multiply(k, column, rows, columns, out)` adds the
// tile's products to the sums.
template <typename Gather, typename Multiply>
void ConvolveTiles(const SparseConvolutionParams& p, int64_t begin, int64_t end, int64_t first, int64_t last,
                   int64_t tile_rows, int64_t tile_columns, ConvolutionScratch& scratch, const Gather& gather,
                   const Multiply& multiply) {
  const PackedWeights& w = *p.weights;
  for (int64_t row = begin; row < end; ++row) {
    std::copy(w.bias() + first, w.bias() + last, p.out + row * w.outputs() + first);
  }
  for (int k = 0; k < kNeighbours; ++k) {
    int64_t pairs = 0;
    for (int64_t row = begin; row < end; ++row) {
      const int32_t source = p.neighbours[row * kNeighbours + k];
      scratch.targets[pairs] = static_cast<int32_t>(row - begin);
      scratch.sources[pairs] = source;
      pairs += source != kNoNeighbour;
    }
    for (int64_t i = 0; i < pairs; i += tile_rows) {
      const int64_t rows = std::min<int64_t>(tile_rows, pairs - i);
      for (int64_t r = 0; r < rows; ++r) gather(r, scratch.sources[i + r]);
      // Prefetches the next tile's rows.
      for (int64_t r = i + rows; r < std::min(pairs, i + 2 * tile_rows); ++r) {
        const float* ahead = p.input + scratch.sources[r] * w.inputs();
        for (int64_t c = 0; c < w.inputs(); c += 64 / sizeof(float)) hwy::Prefetch(ahead + c);
      }
      for (int64_t column = first; column < last; column += tile_columns) {
        float* out[kMostTileRows];
        for (int64_t r = 0; r < rows; ++r) out[r] = p.out + (begin + scratch.targets[i + r]) * w.outputs() + column;
        multiply(k, column, rows, std::min(tile_columns, last - column), out);
      }
    }
  }
}

void ConvolveBlock(const SparseConvolutionParams& p, int64_t begin, int64_t end, int64_t first, int64_t last,
                   ConvolutionScratch& scratch) {
  const PackedWeights& w = *p.weights;
  scratch.gathered.resize(static_cast<size_t>(kTileRows * w.inputs()));
  ConvolveTiles(
      p, begin, end, first, last, kTileRows, kTileColumns, scratch,
      [&](int64_t slot, int64_t row) {
        std::memcpy(scratch.gathered.data() + slot * w.inputs(), p.input + row * w.inputs(),
                    static_cast<size_t>(w.inputs()) * sizeof(float));
      },
      [&](int k, int64_t column, int64_t rows, int64_t columns, float* const* out) {
        MultiplyTile(rows, columns,
                     {.depth = w.inputs(),
                      .input = scratch.gathered.data(),
                      .stride = w.inputs(),
                      .weights = w.panel(k, column / PackedWeights::kPanel),
                      .panel_stride = w.inputs() * PackedWeights::kPanel,
                      .bias = nullptr,
                      .added = out,
                      .out = out});
      });
}

// The same with inputs rounded to bfloat16.
void ConvolveBlockBFloat16(const SparseConvolutionParams& p, int64_t begin, int64_t end, int64_t first, int64_t last,
                           ConvolutionScratch& scratch) {
  const PackedWeights& w = *p.weights;
  const BFloat16Product product = ChooseBFloat16Product();
  scratch.rounded.resize(static_cast<size_t>(product.rows * w.pairs()));
  ConvolveTiles(
      p, begin, end, first, last, product.rows, product.columns, scratch,
      [&](int64_t slot, int64_t row) {
        RoundToPairs(p.input + row * w.inputs(), w.inputs(), scratch.rounded.data() + slot * w.pairs());
      },
      [&](int k, int64_t column, int64_t rows, int64_t columns, float* const* out) {
        product.multiply(rows, columns,
                         {.depth = w.pairs(),
                          .input = scratch.rounded.data(),
                          .stride = w.pairs(),
                          .weights = w.pair_panel(k, column / PackedWeights::kPanel),
                          .panel_stride = w.pairs() * PackedWeights::kPanel,
                          .bias = nullptr,
                          .added = out,
                          .out = out});
      });
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(ConvolveBlock);
HWY_EXPORT(ConvolveBlockBFloat16);

void SparseConvolutionCpu(const SparseConvolutionParams& p) {
  const auto convolve = p.weights->precision() == WeightPrecision::kBFloat16
                            ? HWY_DYNAMIC_DISPATCH(ConvolveBlockBFloat16)
                            : HWY_DYNAMIC_DISPATCH(ConvolveBlock);
  const int64_t outputs = p.weights->outputs();
  const int64_t column_blocks = (outputs + kConvolutionColumns - 1) / kConvolutionColumns;
  // A row's sum does not depend on its block, so more threads may use smaller ones.
  int64_t block = kConvolutionRows;
  while (block > 64 && (p.count + block - 1) / block * column_blocks < 4 * ThreadCount()) block /= 2;
  const int64_t row_blocks = (p.count + block - 1) / block;
  ParallelFor(0, row_blocks * column_blocks, 1, [&](int64_t task_begin, int64_t task_end) {
    auto& scratch = PerThread<ConvolutionScratch>();
    for (int64_t task = task_begin; task < task_end; ++task) {
      const int64_t begin = task % row_blocks * block;
      const int64_t first = task / row_blocks * kConvolutionColumns;
      convolve(p, begin, std::min(p.count, begin + block), first, std::min(outputs, first + kConvolutionColumns),
               scratch);
    }
  });
}

}  // namespace anchorsplat
#endif
