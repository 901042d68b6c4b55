#pragma once

#include <cstdint>
#include <string>

#include "core/buffer.h"
#include "core/result.h"
#include "kernels/packed_weights.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

// A convolution read from a file: NAME.weight and NAME.bias.
struct ConvolutionValues {
  int64_t outputs = 0;
  int64_t inputs = 0;
  Buffer<float> weights;  // [outputs, inputs, side, side]
  Buffer<float> bias;     // [outputs]
};

// Output channels C of NAME.weight [C, inputs, side, side]. Errors (kBadFile, with the path): no such tensor; another
// rank; C not in 1 … kMostMapChannels.
Result<int64_t> ReadOutputs(const TensorFile& file, const std::string& name);

// Reads a tensor of exactly this shape. Errors (kBadFile, with the path): missing, another shape, non-finite values.
Result<Buffer<float>> ReadFinite(const TensorFile& file, const std::string& name, const std::vector<int64_t>& shape);

Result<ConvolutionValues> ReadConvolution(const TensorFile& file, const std::string& name, int64_t outputs,
                                          int64_t inputs, int64_t side);

// Multiply-adds of this convolution per pixel.
double MultiplyAdds(const PackedWeights& weights);

PackedWeights Packed(const ConvolutionValues& values, int64_t side);

}  // namespace anchorsplat
