#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "core/camera.h"
#include "core/render_mode.h"
#include "core/result.h"
#include "enhance/enhance.h"

namespace anchorsplat {

// Options of `enhance`, without input and output.
struct EnhanceFlags {
  EnhanceOptions options;
  std::string pixel_size = "auto";
  std::string cameras;             // file or folder
  std::optional<RenderMode> mode;  // overrides the splat's tag
  std::string background;          // for --clean and refinement
  std::string region;

  // The caller sets `options.given` after parsing.
  void AddTo(CLI::App& verb);
};

// `cameras`: those of --cameras, if already read. Errors: reading; kBadArgument with the option; those of CheckOptions
// (enhance/enhance.h).
Result<EnhanceOptions> MakeEnhanceOptions(const EnhanceFlags& flags, uint64_t seed, const CameraSet* cameras = nullptr);

// Report for --json and Python.
nlohmann::json ToJson(const EnhanceReport& report);

}  // namespace anchorsplat
