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
  std::optional<RenderMode> mode;  // in place of the splats' own

  void AddTo(CLI::App& verb);
};

// The page without its splats. `cameras`: those of --cameras where the caller has them. Errors: of reading; kNotFound:
// no true picture; kBadArgument with the option.
Result<ViewerPage> MakePage(const PageFlags& flags, const CameraSet* cameras = nullptr);

// What a page that has its splats says about them: a training pixel, where none was given, of what it looked like
// before. Warns when its first view shows nothing.
void LookAtSplats(ViewerPage& page);

}  // namespace anchorsplat
