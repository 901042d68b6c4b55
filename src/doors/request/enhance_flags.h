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

// The options of `enhance` that say how, not where from and where to.
struct EnhanceFlags {
  EnhanceOptions options;
  std::string pixel_size = "auto";
  std::string cameras;  // file or folder
  std::string model_file;
  std::string shuffles = "identity";
  std::string compat;
  std::string copies = "auto";
  std::optional<RenderMode> mode;  // in place of the splat's own
  std::string background;          // of --clean
  std::string region;

  // `options.given` is left to the caller, once the verb was parsed.
  void AddTo(CLI::App& verb);
};

// What they come to. `cameras`: those of --cameras where the caller has them; otherwise they are read. Errors: of
// reading; kBadArgument with the option; those of CheckOptions (enhance/enhance.h).
Result<EnhanceOptions> MakeEnhanceOptions(const EnhanceFlags& flags, uint64_t seed, const CameraSet* cameras = nullptr);

// What was done, as --json and Python say it.
nlohmann::json ToJson(const EnhanceReport& report);

}  // namespace anchorsplat
