#include "train/photometric_objective.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/parallel.h"
#include "metrics/photometric_loss.h"
#include "metrics/ssim.h"

namespace anchorsplat {

namespace {

constexpr float kForegroundStep = 0.004f;
constexpr double kSmallestMse = 1e-7;  // 70 dB; improvements beyond do not count

int64_t CountForeground(const Image& rendered, const TrueView& truth) {
  const auto& bg = truth.background;
  const float* r[3] = {rendered.channel(0), rendered.channel(1), rendered.channel(2)};
  const float* t[3] = {truth.picture.channel(0), truth.picture.channel(1), truth.picture.channel(2)};
  int64_t count = 0;
  for (int64_t i = 0; i < rendered.plane(); ++i) {
    int any = 0;
    for (size_t c = 0; c < 3; ++c) {
      any |= static_cast<int>(std::fabs(t[c][i] - bg[c]) > kForegroundStep) | static_cast<int>(r[c][i] != bg[c]);
    }
    count += any;
  }
  return count;
}

struct ViewLoss {
  PhotometricTerms terms;
  torch::Tensor gradient;  // ∂total/∂rendered; zeros on entry
  Status status;
};

// The truth, and the render itself where the truth says nothing, so that there is neither loss nor gradient.
Image TargetOf(const TrueView& truth, const Image& rendered) {
  Image target = truth.picture;
  for (int c = 0; c < 3; ++c) {
    for (size_t i = 0; i < truth.ignored.size(); ++i) {
      if (truth.ignored[i] != 0) target.channel(c)[i] = rendered.channel(c)[i];
    }
  }
  return target;
}

// The terms of one view, and the gradient of everything at once.
void EvaluateView(const torch::Tensor& picture, const TrueView& truth, const LossConfig& weights, ViewLoss& out) {
  const int height = static_cast<int>(picture.size(1)), width = static_cast<int>(picture.size(2));
  Image clamped(width, height, 3);
  const float* rendered = picture.const_data_ptr<float>();
  std::transform(rendered, rendered + picture.numel(), clamped.pixels.data(), [](float v) { return v > 1 ? 1 : v; });
  PhotometricTerms& terms = out.terms;
  terms.foreground = CountForeground(clamped, truth);
  if (terms.foreground == 0) return;
  const Image masked = truth.ignored.empty() ? Image() : TargetOf(truth, clamped);
  const Image& target = truth.ignored.empty() ? truth.picture : masked;

  const double foreground = static_cast<double>(terms.foreground), values = 3.0 * static_cast<double>(clamped.plane());
  const bool windows_fit = std::min(width, height) >= kSsimTaps;
  const double windows = windows_fit ? 3.0 * (width - 2 * kSsimRadius) * (height - 2 * kSsimRadius) : 0;
  // PhotometricLoss uses means and weights with sum one; `scale` converts.
  const double l1_part = weights.l1 / foreground * values;
  const double ssim_part = windows_fit ? weights.ssim / (3 * foreground) * windows : 0;
  const double scale = l1_part + ssim_part;
  Image gradient;
  PixelBox box;
  const auto value = PhotometricLoss(clamped, target,
                                     {.ssim_weight = scale > 0 ? ssim_part / scale : 0, .padding = SsimPadding::kValid},
                                     gradient, box);
  if (!value.ok()) {
    out.status = value.error();
    return;
  }
  terms.l1 = value->l1 * values / foreground;
  terms.ssim = (1 - value->ssim) * windows / (3 * foreground);

  double squares = 0;
  for (int c = 0; c < 3; ++c) {
    for (int y = box.y0; y < box.y1; ++y) {
      const float* a = clamped.channel(c) + int64_t{y} * width;
      const float* b = target.channel(c) + int64_t{y} * width;
      double row = 0;
      for (int x = box.x0; x < box.x1; ++x) row += double{a[x] - b[x]} * (a[x] - b[x]);
      squares += row;
    }
  }
  const double whole_mse = squares / values;
  terms.mse = squares / (3 * foreground);
  terms.log_mse = std::log(whole_mse + kSmallestMse);
  terms.psnr = -10 * std::log10(whole_mse);
  terms.total =
      weights.l1 * terms.l1 + weights.ssim * terms.ssim + weights.mse * terms.mse + weights.log_mse * terms.log_mse;

  const auto photometric = static_cast<float>(scale);
  const auto square = static_cast<float>(2 * weights.mse / (3 * foreground) +
                                         2 * weights.log_mse / (values * (whole_mse + kSmallestMse)));
  float* to = out.gradient.mutable_data_ptr<float>();
  for (int c = 0; c < 3; ++c) {
    for (int y = box.y0; y < box.y1; ++y) {
      const int64_t at = (int64_t{c} * height + y) * width;
      const float *r = rendered + at, *b = target.pixels.data() + at, *g = gradient.pixels.data() + at;
      for (int x = box.x0; x < box.x1; ++x) {
        // Clamped values have no gradient.
        to[at + x] = r[x] > 1 ? 0 : photometric * g[x] + square * (r[x] - b[x]);
      }
    }
  }
}

class Objective : public torch::autograd::Function<Objective> {
 public:
  // `gradients`: of the loss by each of `rendered`; `loss`: its value.
  // autograd searches only a TensorList for tensors that require gradients; the vector counts as one other argument.
  static torch::Tensor forward(torch::autograd::AutogradContext* context, const torch::TensorList& /*rendered*/,
                               const torch::autograd::variable_list& gradients, double loss) {
    context->save_for_backward(gradients);
    return torch::tensor(loss, torch::kFloat32);
  }
  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 const torch::autograd::variable_list& outer) {
    torch::autograd::variable_list result;
    const float factor = outer[0].item<float>();
    const auto gradients = context->get_saved_variables();
    for (const torch::Tensor& gradient : gradients) result.push_back(factor == 1 ? gradient : gradient * factor);
    result.resize(gradients.size() + 2);  // no gradient for the vector and the number
    return result;
  }
};

}  // namespace

PhotometricLossSum PhotometricObjective(std::span<const torch::Tensor> rendered, std::span<const TrueView> truth,
                                        const LossConfig& weights) {
  if (rendered.size() != truth.size()) throw std::invalid_argument("the numbers of rendered and true views differ");
  std::vector<ViewLoss> views(rendered.size());
  std::vector<torch::Tensor> inputs;
  for (size_t v = 0; v < rendered.size(); ++v) {
    const Image& picture = truth[v].picture;
    if (rendered[v].sizes() != torch::IntArrayRef({3, picture.height, picture.width})) {
      throw std::invalid_argument("the sizes of a rendered and a true view differ");
    }
    inputs.push_back(rendered[v].contiguous());
    // Outside the parallel loop below, because LibTorch has threads of its own.
    views[v].gradient = torch::zeros(rendered[v].sizes(), torch::kFloat32);
  }
  {
    const torch::NoGradGuard no_gradient;
    ParallelFor(0, static_cast<int64_t>(views.size()), 1, [&](int64_t v, int64_t) {
      const torch::NoGradGuard also_here;  // guards are per thread
      EvaluateView(inputs[static_cast<size_t>(v)], truth[static_cast<size_t>(v)], weights,
                   views[static_cast<size_t>(v)]);
    });
  }
  PhotometricLossSum sum;
  int64_t counted = 0;
  double total = 0;
  for (const ViewLoss& view : views) {
    if (!view.status.ok()) throw std::invalid_argument(view.status.error().message);
    sum.terms.push_back(view.terms);
    total += view.terms.total;
    counted += view.terms.foreground > 0 ? 1 : 0;
  }
  const double share = counted > 0 ? 1.0 / static_cast<double>(counted) : 0;
  torch::autograd::variable_list gradients;
  for (const ViewLoss& view : views) gradients.push_back(counted == 1 ? view.gradient : view.gradient * share);
  sum.loss = Objective::apply(torch::TensorList(inputs), gradients, total * share);
  return sum;
}

}  // namespace anchorsplat
