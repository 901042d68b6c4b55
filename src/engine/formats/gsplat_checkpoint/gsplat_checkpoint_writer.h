#pragma once

#include <cstdint>
#include <filesystem>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"

namespace anchorsplat {

// Writes a checkpoint of gsplat's trainer (examples/simple_trainer.py, ckpt_{step}_rank{r}.pt): torch.save of {"step":
// step, "splats": {means, scales, quats, opacities, sh0, shN}}, float32, also readable with
// torch.load(weights_only=True) and ReadGsplatCheckpoint. Values stay in stored space. The trainer names files by the
// index of the last step: ckpt_14999_rank0.pt after 15,000. Equal clouds give equal files.
//
// Errors: kBadArgument (no Gaussians, inconsistent arrays, a negative step), kExists, kNotFound, kIo.
Status WriteGsplatCheckpoint(const std::filesystem::path& path, const CloudView& cloud, int64_t step,
                             const CloudWriteOptions& options = {});

}  // namespace anchorsplat
