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

// A way to enhance, for EnhanceSettings::method.
struct EnhanceMethodName {
  std::string name = {};
  std::string summary = {};  // one line
};
ANCHORSPLAT_PUBLIC std::vector<EnhanceMethodName> ListEnhanceMethods();

// What is asked for; `anchorsplat enhance --help` and docs/method.md say more about each. Settings that would have no
// effect with the method are kBadArgument.
struct EnhanceSettings {
  // "auto": the best that is ready; "filter", "model", "refine"; or two, "model+refine".
  std::string method = "auto";
  std::string quality = {};                              // "fast", "good" or "best" instead of a method
  double upscale = 4;                                    // ≥ 1: how many times closer the splat will be seen
  std::optional<double> filter_strength = std::nullopt;  // share of the lost width that is given back
  // World size of a pixel of the training views at a Gaussian's depth: from here, from the cameras, from the pictures,
  // or read off the splat.
  std::optional<double> pixel_size = std::nullopt;
  // How the splat was rasterized in training, where you know it: it is enhanced as such. Nothing: its own tag, else it
  // is read off the splat.
  std::optional<Rasterization> rasterization = std::nullopt;
  std::vector<PinholeCamera> cameras = {};  // the training cameras, with the size that was trained at
  std::filesystem::path images = {};        // project with the training pictures, for refinement
  std::filesystem::path enlarge_with = {};  // a network that enlarges pictures, for the method "detail"
  // Of refinement, by the names of the program's options: {"steps", "200"}, {"seconds", "30"}, {"k", "4"}.
  std::map<std::string, std::string> refine = {};
  std::filesystem::path model = {};  // weights of a network; empty: the one that is part of the library
  // Of a compact network: Gaussians that it makes of each, at most; nothing: merged where nobody would see it.
  std::optional<int64_t> copies = std::nullopt;
  int64_t max_gaussians = 0;  // of the result at most, as --max-gaussians; 0: no bound
  // Only what lies in there is enhanced, the rest stays bit by bit and comes last: four numbers are a sphere, its
  // centre and radius, six a box by two corners across, in world units. Empty: all of the splat.
  std::vector<double> region = {};
  uint64_t seed = 0;
};

// What one method did. Facts by name: whether something was so; counts, which are whole; measurements, which are not.
struct EnhanceStep {
  std::string method = {};
  int64_t dropped = 0;   // Gaussians that it could not use
  bool stopped = false;  // by RunSettings::stop; its result is valid all the same
  std::vector<std::pair<std::string, std::variant<bool, int64_t, double>>> facts = {};
};

struct EnhanceOutcome {
  Splat splat;
  std::string method = {};  // what "auto" came to: "filter", "model+refine"
  int64_t gaussians_in = 0, dropped = 0, gaussians_out = 0;
  std::optional<int64_t> kept_outside = std::nullopt;  // of a region: the last ones of the result, as they were
  double filter_strength = 0;
  double pixel_size = 0;  // world units; the median where each Gaussian has its own
  // "given", "cameras", "pictures"; "read": off the splat; "unknown": the splat says nothing and was left as it is;
  // empty: the method needs none.
  std::string pixel_size_source = {};
  std::vector<EnhanceStep> steps = {};
  bool stopped = false;  // one of them was
  double seconds = 0;    // of the methods, without preparation
};

// Makes a splat that was trained on small pictures hold up when it is seen closer. Gaussians with values that are not
// finite are dropped; what was assumed is said by messages of the run. Refinement heeds RunSettings::stop.
//
// Failures: kBadArgument: no Gaussians, CheckShape, settings out of range or without effect, a method that is not
// ready, a region that is none or holds no Gaussian; kBadFile: no Gaussian is usable, and files that settings name;
// kNotFound; kIo.
ANCHORSPLAT_PUBLIC Expected<EnhanceOutcome> Enhance(const SplatView& splat, const EnhanceSettings& settings = {},
                                                    const RunSettings& run = {});
// The same without a copy of the splat; it is gone afterwards.
ANCHORSPLAT_PUBLIC Expected<EnhanceOutcome> Enhance(Splat&& splat, const EnhanceSettings& settings = {},
                                                    const RunSettings& run = {});

}  // namespace anchorsplat
