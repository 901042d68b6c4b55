#include "published/torch/point_batch_norm.h"

#include "published/published_config.h"

namespace anchorsplat {

namespace {

struct Sum : torch::CustomClassHolder {
  SumOverProcesses over;
};

// The loss is summed over all processes, so the gradient of a process's summand is the sum of all processes' gradients
// of the sum.
class SumFunction : public torch::autograd::Function<SumFunction> {
 public:
  static torch::Tensor forward(torch::autograd::AutogradContext* context, const torch::Tensor& share,
                               const c10::intrusive_ptr<Sum>& sum) {
    context->saved_data["sum"] =
        c10::IValue::make_capsule(c10::static_intrusive_pointer_cast<torch::CustomClassHolder>(sum));
    torch::Tensor total = share.clone();
    sum->over(total);
    return total;
  }
  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 const torch::autograd::variable_list& gradients) {
    const auto sum = c10::static_intrusive_pointer_cast<Sum>(context->saved_data["sum"].toCapsule());
    torch::Tensor total = gradients[0].clone();
    sum->over(total);
    return {total, torch::Tensor()};
  }
};

}  // namespace

PointBatchNormImpl::PointBatchNormImpl(int64_t channels) {
  weight = register_parameter("weight", torch::ones({channels}));
  bias = register_parameter("bias", torch::zeros({channels}));
  running_mean = register_buffer("running_mean", torch::zeros({channels}));
  running_var = register_buffer("running_var", torch::ones({channels}));
  num_batches_tracked = register_buffer("num_batches_tracked", torch::tensor(0, torch::kInt64));
}

torch::Tensor PointBatchNormImpl::forward(const torch::Tensor& x) {
  if (is_training()) num_batches_tracked.add_(1);
  if (is_training() && sum_) return Synchronised(x);
  return torch::batch_norm(x, weight, bias, running_mean, running_var, is_training(), kBatchNormMomentum,
                           kBatchNormEpsilon, torch::globalContext().userEnabledCuDNN());
}

// In double: E[x²] − E[x]² loses digits.
torch::Tensor PointBatchNormImpl::Synchronised(const torch::Tensor& x) {
  const int64_t channels = x.size(1);
  const torch::Tensor wide = x.to(torch::kFloat64);
  const torch::Tensor count = torch::full({1}, static_cast<double>(x.size(0)), wide.options());
  const auto sum = c10::make_intrusive<Sum>();
  sum->over = sum_;
  const torch::Tensor sums = SumFunction::apply(torch::cat({count, wide.sum(0), wide.square().sum(0)}), sum);
  const torch::Tensor points = sums[0].detach();
  const torch::Tensor mean = sums.narrow(0, 1, channels) / points;
  const torch::Tensor variance = (sums.narrow(0, 1 + channels, channels) / points - mean.square()).clamp_min(0);
  {
    const torch::NoGradGuard no_gradient;
    const torch::Tensor unbiased = variance * (points / (points - 1).clamp_min(1));
    running_mean.lerp_(mean.to(running_mean.scalar_type()), kBatchNormMomentum);
    running_var.lerp_(unbiased.to(running_var.scalar_type()), kBatchNormMomentum);
  }
  const torch::Tensor normal = (wide - mean) * torch::rsqrt(variance + kBatchNormEpsilon);
  return (normal * weight + bias).to(x.scalar_type());
}

}  // namespace anchorsplat
