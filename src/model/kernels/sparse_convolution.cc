#include "model/kernels/sparse_convolution.h"

#include <algorithm>
#include <cstring>

#include "core/buffer.h"
#include "core/parallel.h"
#include "model/kernels/voxel_neighbours.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/kernels/sparse_convolution.cc"
#include <hwy/foreach_target.h>  // compiles this file once per SIMD target
#include <hwy/highway.h>

#include "model/kernels/matrix_tile-inl.h"

#ifndef ANCHORSPLAT_SPARSE_CONVOLUTION_ONCE
#define ANCHORSPLAT_SPARSE_CONVOLUTION_ONCE
namespace anchorsplat {

// Rows of the output that one task computes, and the pairs of one offset among them.
constexpr int64_t kConvolutionRows = 512;
struct ConvolutionScratch {
  int32_t targets[kConvolutionRows];
  int32_t sources[kConvolutionRows];
  Buffer<float> gathered;  // [kConvolutionRows, inputs]
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
  scratch.gathered.resize(static_cast<size_t>(kConvolutionRows * inputs));
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
    if (pairs == 0) continue;
    // The centre of all rows is a plain matrix product.
    const bool dense = k == kCentre && pairs == end - begin;
    if (!dense) {
      for (int64_t i = 0; i < pairs; ++i) {
        std::memcpy(scratch.gathered.data() + i * inputs, p.input + scratch.sources[i] * inputs,
                    static_cast<size_t>(inputs) * sizeof(float));
      }
    }
    const float* input = dense ? p.input + begin * inputs : scratch.gathered.data();
    for (int64_t column = first; column < last; column += kTileColumns) {
      const int64_t columns = std::min(kTileColumns, last - column);
      for (int64_t i = 0; i < pairs; i += kTileRows) {
        const int64_t rows = std::min<int64_t>(kTileRows, pairs - i);
        float* out[kTileRows];
        for (int64_t r = 0; r < rows; ++r) out[r] = p.out + (begin + scratch.targets[i + r]) * outputs + column;
        MultiplyTile(rows, columns,
                     {.depth = inputs,
                      .input = input + i * inputs,
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
  // Wide layers have few rows: their tasks take some of the output channels each, whose weights then stay cached.
  constexpr int64_t kColumns = 128;
  const int64_t column_blocks = (outputs + kColumns - 1) / kColumns;
  const int64_t row_blocks = (p.count + kConvolutionRows - 1) / kConvolutionRows;
  ParallelFor(0, row_blocks * column_blocks, 1, [&](int64_t task_begin, int64_t task_end) {
    thread_local ConvolutionScratch scratch;
    for (int64_t task = task_begin; task < task_end; ++task) {
      const int64_t begin = task % row_blocks * kConvolutionRows;
      const int64_t first = task / row_blocks * kColumns;
      convolve(p, begin, std::min(p.count, begin + kConvolutionRows), first, std::min(outputs, first + kColumns),
               scratch);
    }
  });
}

}  // namespace anchorsplat
#endif
