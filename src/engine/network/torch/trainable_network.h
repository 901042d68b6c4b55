#pragma once

#include <torch/torch.h>

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/render_mode.h"
#include "core/result.h"
#include "network/torch/gaussian_tensors.h"
#include "network/torch/network_options.h"

namespace anchorsplat {

// Part of a splat plus the surrounding rows the network needs to make this part's copies as if it saw the whole splat.
struct SplatPart {
  std::vector<int64_t> rows;           // rows of the splat: first those whose copies are wanted, then their context
  int64_t wanted = 0;                  // number of rows whose copies are wanted
  std::shared_ptr<const void> tables;  // owned by the network
};

struct NetworkInput {
  GaussianTensors gaussians;       // the low-quality splat
  torch::Tensor pixel_sizes;       // [N] world units: what a low-resolution pixel covers at each Gaussian, p_LR
  double upscale = 4;              // u: high-resolution pixels per low-resolution pixel along a side
  std::optional<double> strength;  // f of the filter; DefaultFilterStrength unless given
  std::optional<RenderMode> mode;  // of the splat
  // Computed once per splat by Prepare and kept between steps: neighbours, serialization, frames.
  std::shared_ptr<void> prepared;
  // If set, tensors hold this part's rows and the output holds copies of the wanted ones, row k·wanted + i.
  std::shared_ptr<const SplatPart> part;
};

// A network as the training loop sees it: N Gaussians in, K·N out.
class TrainableNetwork : public torch::nn::Module {
 public:
  // Computes everything that does not depend on parameters, without gradient. Called once per (augmented) splat, maybe
  // concurrently with Forward, so it must not touch state that Forward changes.
  // Errors (kBadArgument): a splat the network cannot process.
  virtual Result<std::shared_ptr<void>> Prepare(const NetworkInput& input) = 0;

  // For networks with a local receptive field: computes, once per unaugmented splat, what PartOf needs. Stays valid
  // when the splat is rotated, mirrored, moved, scaled or recoloured, not when Gaussians are removed.
  // Errors (kBadArgument): those of Prepare; a network that must see the whole splat.
  virtual Result<std::shared_ptr<const void>> Survey(const NetworkInput& whole);
  // The part of a splat that yields the copies of rows `wanted`, which must be distinct.
  virtual SplatPart PartOf(const std::shared_ptr<const void>& survey, std::span<const int64_t> wanted);

  // K·N Gaussians in row order k·N + i, differentiable in the parameters.
  virtual GaussianTensors Forward(const NetworkInput& input) = 0;

  // Synchronises what Forward records about its training inputs across processes. `maximum` replaces a tensor by its
  // element-wise maximum over all processes. Every process must call this after the same step. The default does
  // nothing.
  virtual void ShareMemory(const std::function<void(torch::Tensor&)>& maximum);

  virtual int copies() const = 0;  // K

  // Trained parameters by group, for learning rates ("backbone", "means", "scales", …).
  virtual std::vector<std::pair<std::string, std::vector<torch::Tensor>>> Groups() = 0;

  // Writes everything `enhance --model` needs. Replaces an existing file.
  virtual Status Save(const std::filesystem::path& path, const std::map<std::string, std::string>& metadata) = 0;
};

}  // namespace anchorsplat
