#include "published/torch/sparse_convolution.h"

#include <cmath>

namespace anchorsplat {

SubmanifoldConvolutionImpl::SubmanifoldConvolutionImpl(int64_t in, int64_t out) {
  weight = register_parameter("weight", torch::empty({out, 3, 3, 3, in}));
  bias = register_parameter("bias", torch::empty({out}));
  reset();
}

void SubmanifoldConvolutionImpl::reset() {
  // With a = √5 the Kaiming bound is √(6 / ((1 + 5)·fan_in)), the same as the bias's.
  const double bound = 1 / std::sqrt(static_cast<double>(kNeighbours * weight.size(4)));
  torch::nn::init::uniform_(weight, -bound, bound);
  torch::nn::init::uniform_(bias, -bound, bound);
}

torch::Tensor SubmanifoldConvolutionImpl::forward(const torch::Tensor& x, const LevelTensors& level) {
  const torch::Tensor taps = weight.flatten(1, 3).transpose(0, 1).contiguous();  // [27,out,in]
  torch::Tensor y = torch::nn::functional::linear(x, taps[kCentre], bias);
  for (int64_t k = 0; k < kNeighbours; ++k) {
    const LevelTensors::Pairs& pairs = level.pairs()[static_cast<size_t>(k)];
    if (k == kCentre || pairs.out.size(0) == 0) continue;
    y = y.index_add(0, pairs.out, torch::matmul(x.index_select(0, pairs.in), taps[k].t()));
  }
  return y;
}

}  // namespace anchorsplat
