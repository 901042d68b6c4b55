#include "model/kernels/sparse_convolution.h"

#include <algorithm>
#include <cstring>

#include "core/buffer.h"
#include "core/parallel.h"
#include "model/kernels/voxel_neighbours.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/kernels/sparse_convolution.cc"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>  // compiles this file once per SIMD target
#include <hwy/highway.h>

#include "model/kernels/matrix_tile-inl.h"

#ifndef ANCHORSPLAT_SPARSE_CONVOLUTION_ONCE
#define ANCHORSPLAT_SPARSE_CONVOLUTION_ONCE
namespace anchorsplat {

// Rows of the output that one task computes, with the pairs of one offset among them. Enough that most tiles of an
// offset are full, few enough that their sums stay in the second cache.
constexpr int64_t kConvolutionRows = 512;
// Output channels of a task: the weights of one offset stay in the second cache too.
constexpr int64_t kConvolutionColumns = 256;

struct ConvolutionScratch {
  int32_t targets[kConvolutionRows];
  int32_t sources[kConvolutionRows];
  Buffer<float> gathered;  // inputs of one tile
};

}  // namespace anchorsplat
#endif

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {

// Rows [begin, end) and output channels [first, last) of the convolution.
void ConvolveBlock(const SparseConvolutionParams& p, int64_t begin, int64_t end, int64_t first, int64_t last,
                   ConvolutionScratch& scratch) {
  const PackedWeights& w = *p.weights;
  const int64_t inputs = w.inputs();
  const int64_t outputs = w.outputs();
  scratch.gathered.resize(static_cast<size_t>(kTileRows * inputs));
  for (int64_t row = begin; row < end; ++row) {
    std::copy(w.bias() + first, w.bias() + last, p.out + row * outputs + first);
  }
  for (int k = 0; k < kNeighbours; ++k) {
    int64_t pairs = 0;
    for (int64_t row = begin; row < end; ++row) {
      const int32_t source = p.neighbours[row * kNeighbours + k];
      scratch.targets[pairs] = static_cast<int32_t>(row - begin);
      scratch.sources[pairs] = source;
      pairs += source != kNoNeighbour;
    }
    // The centre of all rows is a plain matrix product.
    const bool dense = k == kCentre && pairs == end - begin;
    for (int64_t i = 0; i < pairs; i += kTileRows) {
      const int64_t rows = std::min<int64_t>(kTileRows, pairs - i);
      const float* input = p.input + (begin + i) * inputs;
      if (!dense) {
        input = scratch.gathered.data();
        for (int64_t r = 0; r < rows; ++r) {
          std::memcpy(scratch.gathered.data() + r * inputs, p.input + scratch.sources[i + r] * inputs,
                      static_cast<size_t>(inputs) * sizeof(float));
        }
        // The rows of the next tile come nearer meanwhile.
        for (int64_t r = i + rows; r < std::min(pairs, i + 2 * kTileRows); ++r) {
          const float* ahead = p.input + scratch.sources[r] * inputs;
          for (int64_t c = 0; c < inputs; c += 64 / sizeof(float)) hwy::Prefetch(ahead + c);
        }
      }
      for (int64_t column = first; column < last; column += kTileColumns) {
        const int64_t columns = std::min(kTileColumns, last - column);
        float* out[kTileRows];
        for (int64_t r = 0; r < rows; ++r) out[r] = p.out + (begin + scratch.targets[i + r]) * outputs + column;
        MultiplyTile(rows, columns,
                     {.depth = inputs,
                      .input = input,
                      .stride = inputs,
                      .weights = w.panel(k, column / PackedWeights::kPanel),
                      .panel_stride = inputs * PackedWeights::kPanel,
                      .bias = nullptr,
                      .added = out,
                      .out = out});
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

HWY_EXPORT(ConvolveBlock);

void SparseConvolutionCpu(const SparseConvolutionParams& p) {
  const auto convolve = HWY_DYNAMIC_DISPATCH(ConvolveBlock);
  const int64_t outputs = p.weights->outputs();
  const int64_t column_blocks = (outputs + kConvolutionColumns - 1) / kConvolutionColumns;
  // A row's sum is the same in whichever block it stands, so that many threads may have smaller ones.
  int64_t block = kConvolutionRows;
  while (block > 64 && (p.count + block - 1) / block * column_blocks < 4 * ThreadCount()) block /= 2;
  const int64_t row_blocks = (p.count + block - 1) / block;
  ParallelFor(0, row_blocks * column_blocks, 1, [&](int64_t task_begin, int64_t task_end) {
    thread_local ConvolutionScratch scratch;
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
