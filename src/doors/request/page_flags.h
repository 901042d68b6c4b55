#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/render_mode.h"
#include "core/result.h"
#include "viewer/page_writer.h"

namespace anchorsplat {

// The options of `view`.
struct PageFlags {
  std::string truth;
  std::string cameras;
  std::string title;
  std::string open_your_own;
  std::string background;
  std::string pixel_size = "auto";
  int views = 10;
  int sh_degree = kMaxShDegree;
  std::optional<RenderMode> mode;  // overrides the tags of the splats

  void AddTo(CLI::App& verb);
};

// The page without its splats. `cameras`: those of --cameras, if already read. Errors: reading; kNotFound: no
// ground-truth picture; kBadArgument with the option.
Result<ViewerPage> MakePage(const PageFlags& flags, const CameraSet* cameras = nullptr);

// Completes a page that has its splats: estimates a missing training pixel from the splat before. Warns if the first
// view is empty.
void LookAtSplats(ViewerPage& page);

}  // namespace anchorsplat
