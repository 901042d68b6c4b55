#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/buffer.h"
#include "core/result.h"
#include "perceptual/lpips_net.h"

namespace anchorsplat {

// Weights of an LPIPS network, row-major, in the order of LpipsTensors(net).
struct LpipsWeights {
  LpipsNet net = LpipsNet::kAlex;
  std::vector<Buffer<float>> tensors;
};

// Default folder of the weights: $ANCHORSPLAT_LPIPS, else "anchorsplat/lpips" below $XDG_DATA_HOME or ~/.local/share.
// scripts/fetch-lpips.sh writes there.
std::filesystem::path LpipsFolder();

// Reads NET.safetensors in the folder; or the publishers' files NET.backbone.pth (torchvision's checkpoint, or just its
// `features`) and NET.heads.pth (LPIPS 0.1). Ignores tensors that LPIPS does not need, such as the classifier's head.
//
// Errors: kNotFound "LPIPS missing: …" with what to run, if neither exists; kBadFile: no tensor file, or a tensor
// missing, of the wrong shape, or with non-finite values.
Result<LpipsWeights> ReadLpipsWeights(LpipsNet net, const std::filesystem::path& folder);

}  // namespace anchorsplat
