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
#include "model/shared/torch/gaussian_tensors.h"
#include "model/shared/torch/network_options.h"

namespace anchorsplat {

// A part of a splat, and around it what a network has to see of the rest to make the part's copies as if it saw all.
struct SplatPart {
  std::vector<int64_t> rows;           // of the splat: first those whose copies are wanted, then those these depend on
  int64_t wanted = 0;                  // how many of them are wanted
  std::shared_ptr<const void> tables;  // the network's own
};

struct NetworkInput {
  GaussianTensors gaussians;       // the low-quality splat
  torch::Tensor pixel_sizes;       // [N] world units: what a low-resolution pixel covers at each Gaussian, p_LR
  double upscale = 4;              // u: high-resolution pixels per low-resolution pixel along a side
  std::optional<double> strength;  // f of the filter; DefaultFilterStrength unless given
  std::optional<RenderMode> mode;  // of the splat
  // What a network wants computed once per splat and kept between steps (neighbours, serialization, frames). Made by
  // Prepare.
  std::shared_ptr<void> prepared;
  // Not null: the tensors are the rows of this part, and copies of the wanted ones come out, row k·wanted + i.
  std::shared_ptr<const SplatPart> part;
};

// What the training loop knows of a network: K Gaussians out for every Gaussian in.
class TrainableNetwork : public torch::nn::Module {
 public:
  // Everything of an input that does not depend on parameters; no gradient. Called once per (augmented) splat, possibly
  // from another thread than Forward, so it must not touch what Forward changes.
  // Errors (kBadArgument): a splat that the network cannot work with.
  virtual Result<std::shared_ptr<void>> Prepare(const NetworkInput& input) = 0;

  // For networks that look no farther than a few neighbours: what is needed of a whole splat to work on parts of it,
  // once per splat as it is in its file. It stays true when the splat is turned, mirrored, moved, scaled and coloured,
  // but not when Gaussians are left out. Errors (kBadArgument): those of Prepare; a network that has to see a splat as
  // a whole.
  virtual Result<std::shared_ptr<const void>> Survey(const NetworkInput& whole);
  // The part of a splat that makes the copies of `wanted`, which are rows of it, all different.
  virtual SplatPart PartOf(const std::shared_ptr<const void>& survey, std::span<const int64_t> wanted);

  // K·N Gaussians, differentiable with respect to the parameters. Row order k·N + i.
  virtual GaussianTensors Forward(const NetworkInput& input) = 0;

  // What Forward remembers of its inputs while training, brought to what all processes of a training have seen.
  // `maximum` replaces a tensor by the largest of all processes, element by element; every process calls this after the
  // same step. Networks that remember nothing have nothing to do.
  virtual void ShareMemory(const std::function<void(torch::Tensor&)>& maximum);

  virtual int copies() const = 0;  // K

  // All parameters that are trained, by group name for learning rates ("backbone", "means", "scales", …).
  virtual std::vector<std::pair<std::string, std::vector<torch::Tensor>>> Groups() = 0;

  // Everything `enhance --model` needs to open the network again. Replaces an older file.
  virtual Status Save(const std::filesystem::path& path, const std::map<std::string, std::string>& metadata) = 0;
};

}  // namespace anchorsplat
