#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "compare/comparison.h"
#include "compare/view_source.h"
#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "request/views.h"

namespace anchorsplat {

// How to compare.
struct CompareFlags {
  bool color_correct = false;
  ViewFlags views;
  std::vector<std::string> given;  // option names

  void AddTo(CLI::App& verb);
};

// One side of a comparison: path of a splat, picture or folder of pictures; or a splat or pictures in memory; or none.
struct SideInput {
  std::string path;
  std::unique_ptr<GaussianCloud> cloud;
  std::unique_ptr<ViewSource> pictures;

  bool empty() const { return path.empty() && !cloud && !pictures; }
};

// Both sides and the ground truth, if any.
struct Sides {
  std::unique_ptr<ViewSource> a;
  std::unique_ptr<ViewSource> b;
  std::unique_ptr<ViewSource> truth;
};

// `cameras`: those of --cameras, if already read. Errors: reading; kBadArgument: a splat without views, an option
// without effect.
Result<Sides> OpenSides(const CompareFlags& flags, SideInput a, SideInput b, SideInput truth,
                        const CameraSet* cameras = nullptr);

ViewScore MeanOf(const Comparison& comparison);

// For --json and Python. cc_psnr and similar names are those of gsplat and nerfstudio.
nlohmann::json ToJson(const Comparison& comparison);
// One comparison, or two against the same truth as "a" and "b".
nlohmann::json ToJson(const std::vector<Comparison>& comparisons);

}  // namespace anchorsplat
