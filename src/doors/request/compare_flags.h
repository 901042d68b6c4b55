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

// The options of `compare` that say how.
struct CompareFlags {
  bool color_correct = false;
  ViewFlags views;
  std::vector<std::string> given;  // by their names on the command line

  void AddTo(CLI::App& verb);
};

// What is compared: a splat's file, a folder of pictures or a picture; or, in memory, a splat or pictures. Nothing of
// them: none.
struct SideInput {
  std::string path;
  std::unique_ptr<GaussianCloud> cloud;
  std::unique_ptr<ViewSource> pictures;

  bool empty() const { return path.empty() && !cloud && !pictures; }
};

// The two things compared and, where there is one, the truth that both are compared with.
struct Sides {
  std::unique_ptr<ViewSource> a;
  std::unique_ptr<ViewSource> b;
  std::unique_ptr<ViewSource> truth;
};

// `cameras`: those of --cameras where the caller has them. Errors: of reading; kBadArgument with the option: a splat
// without views to look from, options without effect.
Result<Sides> OpenSides(const CompareFlags& flags, SideInput a, SideInput b, SideInput truth,
                        const CameraSet* cameras = nullptr);

ViewScore MeanOf(const Comparison& comparison);

// What was measured, as --json and Python say it: cc_psnr and the like as gsplat and nerfstudio call them.
nlohmann::json ToJson(const Comparison& comparison);
// Of one, or of two with the same truth, as "a" and "b".
nlohmann::json ToJson(const std::vector<Comparison>& comparisons);

}  // namespace anchorsplat
