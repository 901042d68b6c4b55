#pragma once

#include <filesystem>
#include <memory>

#include "core/image.h"
#include "core/result.h"
#include "perceptual/lpips_weights.h"

namespace anchorsplat {

struct LpipsPlugin;  // perceptual/lpips_plugin.h

// LPIPS, the learned perceptual distance of Zhang et al. 2018 (version 0.1 with heads): 0 for equal pictures, about
// 0.05–0.1 for renders that look right, larger is worse. Runs on LibTorch, loaded by a plugin beside the program. For
// losses with gradients see perceptual/torch/lpips_network.h.
class Lpips {
 public:
  // File of the plugin that belongs to the running program (core/companion.h).
  static std::filesystem::path PluginPath();

  // Checks that the plugin and LibTorch load. Errors: those of Open.
  static Status CheckPlugin(const std::filesystem::path& plugin = PluginPath());

  // Errors: kNotFound "LPIPS missing: …": the program was built without LibTorch; kBadFile: a plugin of another build;
  // kBadArgument: weights of another network.
  static Result<Lpips> Open(const LpipsWeights& weights, const std::filesystem::path& plugin = PluginPath());

  // Distance of two pictures with values 0–1 (not clamped). Passing the same `b` as in the previous call saves half the
  // work, so put the truth there. Uses ThreadCount() threads.
  // Errors: kBadArgument: different sizes, fewer than three channels, too small for the network; kIo: LibTorch failed.
  Result<double> Distance(const Image& a, const Image& b) const;

  LpipsNet net() const { return net_; }

 private:
  Lpips(LpipsNet net, const LpipsPlugin* plugin, std::shared_ptr<void> network)
      : net_(net), plugin_(plugin), network_(std::move(network)) {}

  LpipsNet net_;
  const LpipsPlugin* plugin_;
  std::shared_ptr<void> network_;  // owned by the plugin, which frees it
};

}  // namespace anchorsplat
