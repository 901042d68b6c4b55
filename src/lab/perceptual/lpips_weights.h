#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/buffer.h"
#include "core/result.h"
#include "perceptual/lpips_net.h"

namespace anchorsplat {

// The trained numbers of one LPIPS network, row-major, in the order of LpipsTensors(net).
struct LpipsWeights {
  LpipsNet net = LpipsNet::kAlex;
  std::vector<Buffer<float>> tensors;
};

// Where weights are looked for when the user names no folder: $ANCHORSPLAT_LPIPS, else "anchorsplat/lpips" below
// $XDG_DATA_HOME or ~/.local/share. scripts/fetch-lpips.sh writes there.
std::filesystem::path LpipsFolder();

// Reads NET.safetensors of the folder; or, as their publishers have them, NET.backbone.pth (torchvision's checkpoint,
// or its `features` alone) and NET.heads.pth (of LPIPS 0.1). Tensors that LPIPS does not need, such as the classifier's
// own head, are left alone.
//
// Errors: kNotFound "LPIPS missing: …" with what to run, when neither is there; kBadFile: not a tensor file, a tensor
// missing, of another shape, or with values that are not finite.
Result<LpipsWeights> ReadLpipsWeights(LpipsNet net, const std::filesystem::path& folder);

}  // namespace anchorsplat
