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

// What a method is asked for: to make something of the object that can be seen from these places.
struct MethodTask {
  const BenchmarkObject& object;
  std::span<const size_t> views;  // of object.views that will be measured; only methods that look at the truth care
  Protocol protocol = Protocol::kHeldOut;
  std::filesystem::path cache;  // folder for what took long to make; made by whoever writes there
  uint64_t seed = 0;
};

struct MethodViews {
  // View `view` of the object as [3,H,W] at high resolution, neither clamped nor quantised.
  std::function<Result<Image>(size_t view)> render;
  double seconds = 0;       // what making it took, without reading files and without rendering
  int64_t gaussians = 0;    // 0: there is no splat
  std::vector<Fact> facts;  // what else there is to tell, by name
};

// One row of an evaluation.
struct EvalMethod {
  std::string name;      // in tables, and of its result files
  std::string settings;  // all that its results depend on besides the object; equal text, equal results
  std::function<Result<MethodViews>(const MethodTask&)> prepare;
};

struct MethodOptions {
  std::optional<double> filter_strength;  // f of "filter"; DefaultFilterStrength otherwise
  int64_t fit_steps = 15000;              // of "bicubic"
  // Of enhance/enhance.h; null: AllMethods(). Not owned.
  const std::vector<EnhanceMethod>* enhance_methods = nullptr;
};

// Methods by what the user calls them:
//   raw           the low-quality splat as it is
//   filter        enhance/filter.h with the true pixel size from the training cameras and one f for all objects
//   filter@F      the same with f = F
//   filter-auto   the same with default f and the pixel size read off the splat (fact "pixel_size_ratio":
//                 read / true)
//   filter-best   the f that measures best on this very object (fact "f"): not a method, the most a filter could do
//   upsample      the low-resolution picture enlarged by cubic convolution, no 3-D at all
//   bicubic       a splat fitted anew to the enlarged low-resolution pictures (eval/bicubic_fit.h): minutes per object
//   FILE          the network of a file of weights, .safetensors or .pth, of either kind (model/any_network.h); of an
//                 upscaler (upscale/upscaler.h) as `upsample`, but enlarged by that
//   auto          what the program does with the training cameras when nobody names a method
//   fast, good, best   what it does for that quality; best sees the training pictures
//   NAME          another method of `enhance_methods`, given the training cameras: "model" for example
//                 is the network that is part of the program. NAME+NAME: the second begins where the first ended.
//                 NAME-auto gets no cameras, the pixel size is read off the splat (fact "pixel_size_ratio").
//                 Refinement takes options: refine@k=1@steps=400@f=0.6, keys as of SetRefineOption and f of the filter
// Errors: kBadArgument for other words; kNotFound for files that are not there.
Result<EvalMethod> MakeEvalMethod(const std::string& word, const MethodOptions& options);

// A splat seen from the object's high-resolution cameras, on its background and in the mode that it says.
MethodViews SplatViews(const BenchmarkObject& object, GaussianCloud cloud);

}  // namespace anchorsplat
