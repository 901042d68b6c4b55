#include "network/torch/gaussian_tensors.h"

#include <algorithm>

namespace anchorsplat {

namespace {

torch::Tensor Copied(const Buffer<float>& values, std::vector<int64_t> shape) {
  torch::Tensor tensor = torch::empty(shape, torch::kFloat32);
  std::copy(values.begin(), values.end(), tensor.mutable_data_ptr<float>());
  return tensor;
}

void CopyInto(const torch::Tensor& tensor, Buffer<float>& values) {
  const torch::Tensor host = tensor.detach().to(torch::kCPU, torch::kFloat32).contiguous();
  std::copy_n(host.const_data_ptr<float>(), values.size(), values.data());
}

}  // namespace

GaussianTensors GaussianTensors::To(torch::Device device) const {
  return {means.to(device), log_scales.to(device), quats.to(device), opacity_logits.to(device), sh.to(device)};
}

GaussianTensors ToTensors(const GaussianCloud& cloud) {
  const int64_t n = cloud.size();
  return {Copied(cloud.means, {n, 3}), Copied(cloud.log_scales, {n, 3}), Copied(cloud.quats, {n, 4}),
          Copied(cloud.opacity_logits, {n}), Copied(cloud.sh, {n, cloud.coefficients(), 3})};
}

GaussianCloud ToCloud(const GaussianTensors& gaussians) {
  int degree = 0;
  while (degree < kMaxShDegree && ShCoefficients(degree) < gaussians.sh.size(1)) ++degree;
  GaussianCloud cloud;
  cloud.Resize(gaussians.size(), degree);
  TORCH_CHECK(cloud.coefficients() == gaussians.sh.size(1), "a splat has 1, 4, 9 or 16 SH coefficients");
  CopyInto(gaussians.means, cloud.means);
  CopyInto(gaussians.log_scales, cloud.log_scales);
  CopyInto(gaussians.quats, cloud.quats);
  CopyInto(gaussians.opacity_logits, cloud.opacity_logits);
  CopyInto(gaussians.sh, cloud.sh);
  return cloud;
}

}  // namespace anchorsplat
