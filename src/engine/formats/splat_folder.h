#pragma once

#include <filesystem>
#include <string>

namespace anchorsplat {

// The splat that a path stands for.
struct FoundSplat {
  std::filesystem::path path;  // a file, or what was given where that is none and no such folder either
  std::string others;          // those beside it, for people: "iteration_7000, iteration_15000"; mostly empty
  bool by_step = false;        // it is the latest of what a trainer left, which its folder's name does not say
};

// A file, or the one in a folder: the meta.json or lod-meta.json of a SOG, otherwise the latest splat of a trainer's
// results, given as their folder or one of those in it:
//   INRIA's       point_cloud/iteration_30000/point_cloud.ply, otherwise chkpnt30000.pth
//   gsplat's      ckpts/ckpt_29999_rank0.pt; where there is no rank 0, the lowest, which then cannot be read alone
//   nerfstudio's  nerfstudio_models/step-000029999.ckpt
FoundSplat FindSplat(const std::filesystem::path& path);

}  // namespace anchorsplat
