#pragma once

#include <cstdint>
#include <string>

#include "core/buffer.h"
#include "core/result.h"
#include "model/kernels/packed_weights.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

// A convolution of a file: NAME.weight, NAME.bias and, where it has one, NAME.slope.
struct ConvolutionValues {
  int64_t outputs = 0;
  int64_t inputs = 0;
  Buffer<float> weights;  // [outputs, inputs, side, side]
  Buffer<float> bias;     // [outputs]
};

// The channels that NAME.weight [C, inputs, side, side] makes. Errors (kBadFile, with the path): no such tensor,
// another rank, none or more than kMostMapChannels.
Result<int64_t> ReadOutputs(const TensorFile& file, const std::string& name);

// Values of the tensor of exactly this shape, all of them finite. Errors (kBadFile, with the path): those.
Result<Buffer<float>> ReadFinite(const TensorFile& file, const std::string& name, const std::vector<int64_t>& shape);

Result<ConvolutionValues> ReadConvolution(const TensorFile& file, const std::string& name, int64_t outputs,
                                          int64_t inputs, int64_t side);

// Of a convolution with these weights, per pixel.
double MultiplyAdds(const PackedWeights& weights);

PackedWeights Packed(const ConvolutionValues& values, int64_t side);

}  // namespace anchorsplat
