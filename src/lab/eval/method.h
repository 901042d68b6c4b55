#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/image.h"
#include "core/result.h"
#include "enhance/enhance.h"
#include "eval/benchmark.h"
#include "eval/protocol.h"

namespace anchorsplat {

// Task of a method: make something of the object that can be rendered from the views.
struct MethodTask {
  const BenchmarkObject& object;
  std::span<const size_t> views;  // of object.views to be measured; only methods that use the truth need them
  Protocol protocol = Protocol::kHeldOut;
  std::filesystem::path cache;  // folder for slow intermediate results; created by whoever writes there
  uint64_t seed = 0;
};

struct MethodViews {
  // Renders view `view` of the object as [3,H,W] at high resolution, neither clamped nor quantised.
  std::function<Result<Image>(size_t view)> render;
  double seconds = 0;       // to prepare, without reading files and rendering
  int64_t gaussians = 0;    // 0: no splat
  std::vector<Fact> facts;  // further results by name
};

// A row of an evaluation.
struct EvalMethod {
  std::string name;      // in tables and file names
  std::string settings;  // what results depend on besides name and object; equal ones mean equal results
  std::function<Result<MethodViews>(const MethodTask&)> prepare;
};

struct MethodOptions {
  std::optional<double> filter_strength;  // f of "filter"; unset: DefaultFilterStrength
  int64_t fit_steps = 15000;              // of "bicubic"
  // Methods of enhance/enhance.h; null: AllMethods(). Not owned.
  const std::vector<EnhanceMethod>* enhance_methods = nullptr;
};

// Makes a method from its command-line word:
//   raw           the low-quality splat unchanged
//   filter        enhance/filter.h with the true pixel size from the training cameras and one f for all objects
//   filter@F      the same with f = F
//   filter-auto   the same with default f and the pixel size read off the splat (fact "pixel_size_ratio":
//                 read / true)
//   filter-best   the best f for each object (fact "f"): not a method but an upper bound for filters
//   upsample      the low-resolution picture enlarged bicubically, without any 3-D
//   bicubic       a splat fitted to the enlarged low-resolution pictures (eval/bicubic_fit.h): minutes per object
//   FILE          the network in a weights file, .safetensors or .pth, of either kind (model/any_network.h); for an
//                 upscaler (upscale/upscaler.h) as `upsample`, but enlarged by it
//   auto          the program's own choice, given the training cameras
//   fast, good, best   the program's choice for that quality; best sees the training pictures
//   NAME          another method of `enhance_methods`, given the training cameras: "model", for example,
//                 is the built-in network. NAME+NAME: the second starts from the first's result.
//                 NAME-auto gets no cameras and reads the pixel size off the splat (fact "pixel_size_ratio").
//                 With options of refinement and networks, and f of the filter: refine@k=1@steps=400@f=0.6
// Errors: kBadArgument: another word; kNotFound: a missing file.
Result<EvalMethod> MakeEvalMethod(const std::string& word, const MethodOptions& options);

// Renders a splat from the object's high-resolution cameras, on its background and in its render mode.
MethodViews SplatViews(const BenchmarkObject& object, GaussianCloud cloud);

}  // namespace anchorsplat
