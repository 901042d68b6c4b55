#include "train/optimizer.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "core/text.h"

namespace anchorsplat {

Result<Optimizer> Optimizer::Make(TrainableNetwork& network, const TrainConfig& config) {
  Optimizer optimizer;
  optimizer.config_ = config.optimizer;
  std::map<const void*, double> rates;
  std::set<std::string> names;
  for (const auto& [group, parameters] : network.Groups()) {
    names.insert(group);
    const auto own = config.optimizer.groups.find(group);
    const double rate = own == config.optimizer.groups.end() ? config.optimizer.learning_rate : own->second;
    for (const torch::Tensor& parameter : parameters) rates[parameter.unsafeGetTensorImpl()] = rate;
  }
  for (const auto& [group, rate] : config.optimizer.groups) {
    if (names.contains(group)) continue;
    std::string known;
    for (const std::string& name : names) known += (known.empty() ? "" : ", ") + name;
    return Error{ErrorCode::kBadFile, Cat(config.file, ": optimizer.groups.", Printable(group), ": the network \"",
                                          config.kind, "\" has no such group; it has ", known)};
  }
  const torch::NoGradGuard no_gradient;
  for (const auto& item : network.named_parameters()) {
    const torch::Tensor& value = item.value();
    optimizer.averaged_.push_back({item.key(), value, value.detach().clone()});
    const auto rate = rates.find(value.unsafeGetTensorImpl());
    if (rate == rates.end()) continue;
    optimizer.trained_.push_back({item.key(), value, torch::zeros_like(value), torch::zeros_like(value), rate->second});
  }
  for (const auto& item : network.named_buffers()) {
    optimizer.averaged_.push_back({item.key(), item.value(), item.value().detach().clone()});
  }
  return optimizer;
}

void Optimizer::ZeroGradients() {
  for (Trained& p : trained_) p.value.mutable_grad() = torch::Tensor();
}

double Optimizer::GradientNorm() const {
  double sum = 0;
  for (const Trained& p : trained_) {
    if (!p.value.grad().defined()) continue;
    const double norm = p.value.grad().norm().item<double>();
    sum += norm * norm;
  }
  return std::sqrt(sum);
}

void Optimizer::ScaleGradients(double factor) {
  for (Trained& p : trained_) {
    if (p.value.grad().defined()) p.value.mutable_grad().mul_(factor);
  }
}

std::vector<torch::Tensor> Optimizer::Gradients() {
  std::vector<torch::Tensor> gradients;
  for (Trained& p : trained_) {
    if (!p.value.grad().defined()) p.value.mutable_grad() = torch::zeros_like(p.value);
    gradients.push_back(p.value.grad());
  }
  return gradients;
}

void Optimizer::Step(double factor) {
  const torch::NoGradGuard no_gradient;
  ++steps_;
  const auto t = static_cast<double>(steps_);
  const double first_bias = 1 - std::pow(config_.beta1, t), second_bias = 1 - std::pow(config_.beta2, t);
  for (Trained& p : trained_) {
    const torch::Tensor& gradient = p.value.grad();
    if (!gradient.defined()) continue;
    const double rate = p.rate * factor;
    p.first.mul_(config_.beta1).add_(gradient, 1 - config_.beta1);
    p.second.mul_(config_.beta2).addcmul_(gradient, gradient, 1 - config_.beta2);
    if (config_.weight_decay > 0) p.value.mul_(1 - rate * config_.weight_decay);
    const torch::Tensor denominator = p.second.sqrt().div_(std::sqrt(second_bias)).add_(config_.epsilon);
    p.value.addcdiv_(p.first, denominator, -rate / first_bias);
  }
  // Shorter memory at first: early steps are far from where they lead.
  const double keep = std::min(config_.ema, (1 + t) / (10 + t));
  for (Averaged& a : averaged_) {
    // Non-parameters (counters, extremes, running statistics) are not averaged.
    if (config_.ema == 0 || !a.value.requires_grad()) {
      a.average.copy_(a.value);
    } else {
      a.average.lerp_(a.value.detach(), 1 - keep);
    }
  }
}

void Optimizer::SwapAverage() {
  const torch::NoGradGuard no_gradient;
  for (Averaged& a : averaged_) {
    const torch::Tensor value = a.value.detach().clone();
    a.value.copy_(a.average);
    a.average.copy_(value);
  }
}

std::vector<std::pair<std::string, torch::Tensor>> Optimizer::State() const {
  std::vector<std::pair<std::string, torch::Tensor>> state;
  for (const Averaged& a : averaged_) {
    state.emplace_back("weights." + a.name, a.value.detach());
    state.emplace_back("average." + a.name, a.average);
  }
  for (const Trained& p : trained_) {
    state.emplace_back("adam.first." + p.name, p.first);
    state.emplace_back("adam.second." + p.name, p.second);
  }
  return state;
}

int64_t Optimizer::parameters() const {
  int64_t count = 0;
  for (const Trained& p : trained_) count += p.value.numel();
  return count;
}

double RateFactor(const OptimizerConfig& config, int64_t step, double progress) {
  double factor = 1;
  if (config.schedule == Schedule::kCosine) {
    const double cosine = 0.5 * (1 + std::cos(std::numbers::pi * std::clamp(progress, 0.0, 1.0)));
    factor = config.final + (1 - config.final) * cosine;
  }
  if (step < config.warm_up) factor *= static_cast<double>(step + 1) / static_cast<double>(config.warm_up);
  return factor;
}

}  // namespace anchorsplat
