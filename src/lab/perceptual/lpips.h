#pragma once

#include <filesystem>
#include <memory>

#include "core/image.h"
#include "core/result.h"
#include "perceptual/lpips_weights.h"

namespace anchorsplat {

struct LpipsPlugin;  // perceptual/lpips_plugin.h

// LPIPS, the learned perceptual distance of Zhang et al. 2018 (version 0.1 with heads): 0 for equal pictures, about
// 0.05–0.1 for renders that look right, larger is worse. Runs on LibTorch, which a plugin beside the program brings in;
// for losses with gradients there is perceptual/torch/lpips_network.h.
class Lpips {
 public:
  // The file of the plugin, which came with the running program (core/companion.h).
  static std::filesystem::path PluginPath();

  // Whether it is there and loads, LibTorch with it; the errors are those of Open.
  static Status CheckPlugin(const std::filesystem::path& plugin = PluginPath());

  // Errors: kNotFound "LPIPS missing: …" when the program was built without LibTorch; kBadFile for a plugin of another
  // build; kBadArgument for weights that are not those of their network.
  static Result<Lpips> Open(const LpipsWeights& weights, const std::filesystem::path& plugin = PluginPath());

  // Distance of two pictures with values 0–1 (used as given). Half of the work is saved when `b` is the same picture as
  // the time before, so the truth goes there. Uses ThreadCount() threads.
  // kBadArgument: sizes differ, fewer than three channels, pictures too small for the network; kIo: LibTorch failed.
  Result<double> Distance(const Image& a, const Image& b) const;

  LpipsNet net() const { return net_; }

 private:
  Lpips(LpipsNet net, const LpipsPlugin* plugin, std::shared_ptr<void> network)
      : net_(net), plugin_(plugin), network_(std::move(network)) {}

  LpipsNet net_;
  const LpipsPlugin* plugin_;
  std::shared_ptr<void> network_;  // the plugin's, freed by it
};

}  // namespace anchorsplat
