#pragma once

#include <filesystem>
#include <string>

namespace anchorsplat {

// The splat found for a path.
struct FoundSplat {
  std::filesystem::path path;  // a file; the given path if neither a file nor such a folder
  std::string others;          // alternatives, for messages: "iteration_7000, iteration_15000"; usually empty
  bool by_step = false;        // the latest step of a training run, not named by the path
};

// Finds the splat for a file or folder: the meta.json or lod-meta.json of a SOG, else the latest splat of a training
// run, given by its result folder or a folder in it:
//   INRIA       point_cloud/iteration_30000/point_cloud.ply, else chkpnt30000.pth
//   gsplat      ckpts/ckpt_29999_rank0.pt; without rank 0 the lowest, which then cannot be read alone
//   nerfstudio  nerfstudio_models/step-000029999.ckpt
FoundSplat FindSplat(const std::filesystem::path& path);

}  // namespace anchorsplat
