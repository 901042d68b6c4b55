#include "published/torch/pooling.h"

#include <limits>

namespace anchorsplat {

SerializedPoolingImpl::SerializedPoolingImpl(int64_t in, int64_t out) : norm(PointBatchNorm(out)) {
  proj = register_module("proj", torch::nn::Linear(in, out));
  register_module("norm", torch::nn::ModuleList(norm));
}

torch::Tensor SerializedPoolingImpl::forward(const torch::Tensor& x, const LevelTensors& fine, int64_t coarse_count) {
  const torch::Tensor y = proj(x);
  const torch::Tensor empty =
      torch::full({coarse_count, y.size(1)}, -std::numeric_limits<double>::infinity(), y.options());
  const torch::Tensor pooled =
      empty.scatter_reduce(0, fine.cluster.unsqueeze(1).expand_as(y), y, "amax", /*include_self=*/false);
  return torch::gelu(norm(pooled));
}

SerializedUnpoolingImpl::SerializedUnpoolingImpl(int64_t coarse, int64_t skip, int64_t out)
    : proj(coarse, out), norm(PointBatchNorm(out)), proj_skip(skip, out), norm_skip(PointBatchNorm(out)) {
  register_module("proj", torch::nn::ModuleList(proj, norm));
  register_module("proj_skip", torch::nn::ModuleList(proj_skip, norm_skip));
}

SerializedUnpoolingImpl::Output SerializedUnpoolingImpl::forward(const torch::Tensor& coarse, const torch::Tensor& skip,
                                                                 const LevelTensors& fine) {
  const torch::Tensor up = torch::gelu(norm(proj(coarse)));
  const torch::Tensor own = torch::gelu(norm_skip(proj_skip(skip)));
  return {own + up.index_select(0, fine.cluster), own};
}

}  // namespace anchorsplat
