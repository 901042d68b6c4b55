#pragma once

#include <anchorsplat/error.h>
#include <anchorsplat/export.h>
#include <anchorsplat/render.h>
#include <anchorsplat/run.h>
#include <anchorsplat/splat.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace anchorsplat {

// A method for EnhanceSettings::method.
struct EnhanceMethodName {
  std::string name = {};
  std::string summary = {};  // one line
};
ANCHORSPLAT_PUBLIC std::vector<EnhanceMethodName> ListEnhanceMethods();

// Settings of an enhancement; see `anchorsplat enhance --help` and docs/method.md. Settings without effect on the
// chosen method are kBadArgument.
struct EnhanceSettings {
  // "auto": the best that is ready; "filter", "model", "refine"; or two in sequence, "model+refine".
  std::string method = "auto";
  std::string quality = {};                              // "fast", "good" or "best" instead of a method
  double upscale = 4;                                    // ≥ 1: how many times closer the splat will be seen
  std::optional<double> filter_strength = std::nullopt;  // share of the lost width to restore
  // World size of a training pixel at a Gaussian's depth. Unset: from the cameras, else from the pictures, else read
  // off the splat.
  std::optional<double> pixel_size = std::nullopt;
  // How the splat was rasterized in training, if known. Unset: from its own tag, else read off the splat.
  std::optional<Rasterization> rasterization = std::nullopt;
  std::vector<PinholeCamera> cameras = {};  // training cameras, at the size used in training
  std::filesystem::path images = {};        // project with the training pictures, for refinement
  std::filesystem::path enlarge_with = {};  // network that enlarges pictures, for the method "detail"
  // Options of refinement by their command-line names: {"steps", "200"}, {"seconds", "30"}, {"k", "4"}.
  std::map<std::string, std::string> refine = {};
  std::filesystem::path model = {};  // network weights; empty: the network built into the library
  // Compact networks: maximum output Gaussians per input Gaussian. Unset: merges copies where it is invisible.
  std::optional<int64_t> copies = std::nullopt;
  int64_t max_gaussians = 0;  // of the result, as --max-gaussians; 0: no limit
  // Enhances only this region; all other Gaussians stay unchanged, bit by bit, and come last. Four numbers: centre and
  // radius of a sphere; six: opposite corners of a box; world units. Empty: the whole splat.
  std::vector<double> region = {};
  uint64_t seed = 0;
};

// What one method did. Facts by name: flags, counts or measurements.
struct EnhanceStep {
  std::string method = {};
  int64_t dropped = 0;   // unusable Gaussians
  bool stopped = false;  // by RunSettings::stop; the result is still valid
  std::vector<std::pair<std::string, std::variant<bool, int64_t, double>>> facts = {};
};

struct EnhanceOutcome {
  Splat splat;
  std::string method = {};  // the method used: "filter", "model+refine"
  int64_t gaussians_in = 0, dropped = 0, gaussians_out = 0;
  std::optional<int64_t> kept_outside = std::nullopt;  // with a region: number of unchanged Gaussians, the last ones
  double filter_strength = 0;
  double pixel_size = 0;  // world units; the median if it differs per Gaussian
  // "given", "cameras", "pictures"; "read": off the splat; "unknown": not found, splat unchanged; empty: not needed.
  std::string pixel_size_source = {};
  std::vector<EnhanceStep> steps = {};
  bool stopped = false;  // whether a step was stopped
  double seconds = 0;    // of the methods, without preparation
};

// Enhances a splat trained on small pictures so that it holds up when seen closer. Drops Gaussians with non-finite
// values. Reports its assumptions as messages of the run. Refinement reacts to RunSettings::stop.
//
// Failures: kBadArgument: no Gaussians, CheckShape, settings out of range or without effect, a method that is not
// ready, an invalid or empty region; kBadFile: no usable Gaussian, or a bad file named by the settings; kNotFound; kIo.
ANCHORSPLAT_PUBLIC Expected<EnhanceOutcome> Enhance(const SplatView& splat, const EnhanceSettings& settings = {},
                                                    const RunSettings& run = {});
// The same, consuming the splat instead of copying it.
ANCHORSPLAT_PUBLIC Expected<EnhanceOutcome> Enhance(Splat&& splat, const EnhanceSettings& settings = {},
                                                    const RunSettings& run = {});

}  // namespace anchorsplat
