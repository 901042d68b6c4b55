#include "train/perceptual_objective.h"

#include <vector>

namespace anchorsplat {

namespace {

torch::Tensor AsTensor(const Image& image) {
  return torch::from_blob(const_cast<float*>(image.pixels.data()), {1, image.channels, image.height, image.width},
                          torch::kFloat32)
      .narrow(1, 0, 3);
}

torch::Tensor Part(const torch::Tensor& picture, const PixelBox& box) {
  return picture.slice(-2, box.y0, box.y1).slice(-1, box.x0, box.x1);
}

}  // namespace

Result<PerceptualObjective> PerceptualObjective::Open(LpipsNet net) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const LpipsWeights weights, ReadLpipsWeights(net, LpipsFolder()));
  return Make(weights);
}

Result<PerceptualObjective> PerceptualObjective::Make(const LpipsWeights& weights) {
  std::vector<std::span<const float>> tensors;
  for (const Buffer<float>& tensor : weights.tensors) tensors.emplace_back(tensor.data(), tensor.size());
  ANCHORSPLAT_ASSIGN_OR_RETURN(LpipsNetwork network, LpipsNetwork::Make(weights.net, tensors));
  return PerceptualObjective(std::move(network));
}

torch::Tensor PerceptualObjective::operator()(std::span<const torch::Tensor> rendered,
                                              std::span<const TrueView> truth) const {
  torch::Tensor sum = torch::zeros({});
  int64_t counted = 0;
  for (size_t v = 0; v < rendered.size(); ++v) {
    const PixelBox& box = truth[v].perceptual;
    if (box.empty() || !truth[v].ignored.empty()) continue;  // a network sees what a mask hides
    ++counted;
    const torch::Tensor part = Part(rendered[v].unsqueeze(0), box).clamp_max(1);
    sum = sum + network_.Distance(part, Part(AsTensor(truth[v].picture), box)).squeeze();
  }
  return counted > 0 ? sum / counted : sum;
}

double PerceptualObjective::Distance(const Image& a, const Image& b) const {
  const torch::NoGradGuard no_gradient;
  return network_.Distance(AsTensor(a), AsTensor(b)).item<double>();
}

}  // namespace anchorsplat
