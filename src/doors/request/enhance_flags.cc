#include "request/enhance_flags.h"

#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <tuple>

#include "cameras/camera_io.h"
#include "core/text.h"
#include "enhance/gaussian_budget.h"
#include "model/model_method.h"
#include "request/choice.h"
#include "request/findings.h"
#include "request/mode_option.h"
#include "request/parse.h"
#include "request/refine_flags.h"

namespace anchorsplat {

namespace {

nlohmann::json ToJson(const RefinePlan& plan) {
  nlohmann::json json = {
      {"from_input", plan.from_input}, {"nothing_to_do", plan.nothing_to_do}, {"least_gain", plan.least_gain}};
  if (!plan.why.empty()) json["why"] = plan.why;
  if (plan.nothing_to_do) return json;
  const RefineOptions& options = plan.options;
  if (options.steps) json["steps"] = *options.steps;
  if (options.seconds) json["seconds"] = *options.seconds;
  if (options.copies) json["k"] = *options.copies;
  if (options.rate) json["rate"] = *options.rate;
  if (plan.gaussians > 0) json["gaussians"] = plan.gaussians;
  return json;
}

// "identity", the seed of PyTorch's generator, or five permutations such as 1230,0321,1023,3102,0321.
Result<Shuffles> ParseShuffles(const std::string& text) {
  if (text == "identity") return kNoShuffles;
  Shuffles shuffles;
  constexpr size_t kWidth = std::tuple_size_v<Shuffle> + 1;  // digits and a comma
  if (text.size() + 1 == kWidth * shuffles.size()) {
    bool well_formed = true;
    for (size_t i = 0; i < text.size(); ++i) {
      const bool comma = i % kWidth == kWidth - 1;
      well_formed &= comma ? text[i] == ',' : text[i] >= '0' && text[i] <= '9';
      if (!comma) shuffles[i / kWidth][i % kWidth] = static_cast<uint8_t>(text[i] - '0');
    }
    if (well_formed && Validate(shuffles).ok()) return shuffles;
  }
  uint64_t seed = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), seed);
  if (code == std::errc() && end == text.data() + text.size()) return ShufflesFromSeed(seed);
  return Error{ErrorCode::kBadArgument,
               Cat("--shuffles: '", Printable(text),
                   "' is neither 'identity', nor a seed, nor five permutations such as 1230,0321,1023,3102,0321")};
}

// Options of networks.
Status FinishModelOptions(const EnhanceFlags& flags, ModelSettings& model) {
  model.file = flags.model_file;
  model.options.upstream = flags.compat == "upstream";
  ANCHORSPLAT_ASSIGN_OR_RETURN(model.copies, ParseCopies("--copies", flags.copies));
  ANCHORSPLAT_ASSIGN_OR_RETURN(model.options.shuffles, ParseShuffles(flags.shuffles));
  return {};
}

std::string MethodHelp() {
  std::string text = "auto: the best for what is given";
  for (const EnhanceMethod& method : AllMethods()) text += "; " + method.name + ": " + method.summary;
  return text;
}

void AddMethodFlags(CLI::App& verb, EnhanceFlags& flags) {
  EnhanceOptions& options = flags.options;
  verb.add_option("--method", options.method, MethodHelp())->type_name("METHOD")->capture_default_str();
  verb.add_option("--quality", options.quality,
                  "How much time to spend. fast: filter or network, about a second. good: then a short refinement, "
                  "several seconds. best: refinement against --images, or without them at the closer view's "
                  "resolution, minutes. Replaces --method")
      ->check(CLI::IsMember({"fast", "good", "best"}));
  verb.add_option("--upscale", options.upscale, "Zoom to prepare for; at least 1")->capture_default_str();
  verb.add_option("--max-gaussians,--most-gaussians", options.max_gaussians,
                  "Budget for the output, spent where the closer view shows it; 0: no limit. With a published network: "
                  "the largest anchors by opacity x size")
      ->check(NotNegative())
      ->capture_default_str();
  verb.add_option("--region", flags.region,
                  "Enhance only this part: a box X0,Y0,Z0,X1,Y1,Z1 or a sphere X,Y,Z,RADIUS in world units")
      ->type_name("NUMBERS")
      ->check(NotEmpty());
}

void AddPixelSizeFlags(CLI::App& verb, EnhanceFlags& flags) {
  const std::string group = "Pixel size";
  EnhanceOptions& options = flags.options;
  auto* cameras = verb.add_option("--cameras", flags.cameras,
                                  "Training cameras (COLMAP, transforms.json, ...): the exact pixel size of every "
                                  "Gaussian")
                      ->type_name("PATH")
                      ->check(NotEmpty());
  verb.add_option("--pixel-size", flags.pixel_size,
                  "World size of a training pixel (depth / focal length); auto: estimate it from the splat")
      ->type_name("LENGTH")
      ->capture_default_str()
      ->group(group);
  AddModeOption(verb, flags.mode,
                "Rasterization in training (default: the file's tag, else estimated from the Gaussians)")
      ->group(group);
  verb.add_option("--train-width", options.train_width, "Image width in training, if smaller than in --cameras")
      ->check(Positive())
      ->needs(cameras)
      ->group(group);
  AddChoice(verb, "--camera-rule", options.camera_rule,
            {{"auto", CameraPixelRule::kAuto},
             {"smallest", CameraPixelRule::kSmallest},
             {"median", CameraPixelRule::kMedian}},
            "Which view of a Gaussian sets its pixel size. smallest: never blurs. median: for objects seen from all "
            "around. auto: by the camera layout")
      ->needs(cameras)
      ->group(group);
  verb.add_option("--filter-strength", options.filter_strength,
                  "Share of the absorbed 0.3 px² to give back (default: 1 - (1 - 1/upscale²)/3.6)")
      ->group(group);
}

void AddNetworkFlags(CLI::App& verb, EnhanceFlags& flags) {
  const std::string group = "Network";
  PublishedOptions& model = flags.options.model.options;
  verb.add_option("--model", flags.model_file, "Weights of a compact or AnchorSplat network, .safetensors or .pth")
      ->type_name("FILE")
      ->check(NotEmpty())
      ->group(group);
  verb.add_option("--copies", flags.copies,
                  "Most Gaussians that a compact network makes of each; auto: fewer where the difference is invisible")
      ->type_name("N")
      ->capture_default_str()
      ->group(group);
  verb.add_option("--merge-cost", flags.options.model.merge_cost,
                  "With --copies auto: most error per merged Gaussian, in closer-view pixels x squared difference "
                  "(default: 0.001 for standard fits, else 0.0001)")
      ->check(NotNegative())
      ->group(group);
  verb.add_option("--prune-opacity", model.prune_opacity,
                  "Drop network output fainter than this; 1/255 = 0.0039 is invisible")
      ->check(Fraction())
      ->capture_default_str()
      ->group(group);
  verb.add_option("--block-gaussians", model.block_gaussians,
                  "Enhance larger splats in overlapping blocks of this size")
      ->check(CLI::Range(int64_t{1000}, int64_t{100'000'000}))
      ->capture_default_str()
      ->group(group);
  AddChoice(verb, "--precision", flags.options.model.precision,
            {{"fp32", WeightPrecision::kFloat}, {"bf16", WeightPrecision::kBFloat16}},
            "Of matrix products, convolutions and attention; bf16 needs processor support (`doctor` reports it)")
      ->group(group);
}

// Differences of the published script.
void AddPublishedScriptFlags(CLI::App& verb, EnhanceFlags& flags) {
  const std::string group = "Published network, as its script runs it";
  PublishedOptions& model = flags.options.model.options;
  verb.add_option("--compat", flags.compat,
                  "upstream: repeat the published script, quirks included; its fp16 attention is "
                  "--attention-rounding fp16")
      ->check(CLI::IsMember({"upstream"}))
      ->group(group);
  AddChoice(verb, "--normalisation", model.normalisation,
            {{"auto", NormalisationMode::kAuto},
             {"centered", NormalisationMode::kCentered},
             {"bbox", NormalisationMode::kBbox},
             {"unit", NormalisationMode::kUnit}},
            "How to fit the splat into the network's unit cube")
      ->group(group);
  AddChoice(verb, "--attention-rounding", model.rounding,
            {{"none", Rounding::kNone}, {"fp16", Rounding::kHalf}, {"bf16", Rounding::kBFloat16}},
            "Rounding of queries, keys, values and probabilities; the release uses fp16")
      ->group(group);
  AddChoice(verb, "--curve-depth", model.depth_rule,
            {{"v1.5", DepthRule::kLargest}, {"v1.6", DepthRule::kLargestPlusOne}},
            "Bits of the space-filling curves, by Pointcept release")
      ->group(group);
  verb.add_option("--shuffles", flags.shuffles,
                  "Order of the space-filling curves: identity, a PyTorch seed, or five permutations")
      ->type_name("ORDER")
      ->capture_default_str()
      ->group(group);
}

}  // namespace

void EnhanceFlags::AddTo(CLI::App& verb) {
  AddMethodFlags(verb, *this);
  AddPixelSizeFlags(verb, *this);
  verb.add_flag("--clean", options.clean,
                "First remove background-coloured Gaussians that no training view would miss (dust around objects on "
                "black). May remove dark parts of the object");
  verb.add_option("--background", background,
                  "Background of the training views for --clean and refinement, R,G,B from 0 to 1 (default: from the "
                  "camera file, else the splat's comment, else black)")
      ->type_name("R,G,B");
  AddNetworkFlags(verb, *this);
  AddPublishedScriptFlags(verb, *this);
  AddRefineFlags(verb, options.refine, options.control);
}

Result<EnhanceOptions> MakeEnhanceOptions(const EnhanceFlags& flags, uint64_t seed, const CameraSet* cameras) {
  EnhanceOptions options = flags.options;
  options.methods = &AllMethods();
  ANCHORSPLAT_RETURN_IF_ERROR(FinishModelOptions(flags, options.model));
  SetBudget(options, options.max_gaussians);
  if (!flags.region.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(options.region, ParseRegion("--region", flags.region));
  }
  options.seed = seed;
  options.mode = flags.mode;
  ANCHORSPLAT_ASSIGN_OR_RETURN(options.pixel_size, ParsePixelSize("--pixel-size", flags.pixel_size));
  if (cameras != nullptr) {
    options.cameras = *cameras;
  } else if (!flags.cameras.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(options.cameras, ReadCameras(flags.cameras));
  }
  if (!flags.background.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(options.background, ParseColor("--background", flags.background));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckOptions(options));
  return options;
}

nlohmann::json ToJson(const EnhanceReport& r) {
  nlohmann::json json = {{"method", r.method},
                         {"gaussians", {{"in", r.gaussians_in}, {"dropped", r.dropped}, {"out", r.gaussians_out}}},
                         {"seconds", r.seconds},
                         {"seconds_in_all", r.seconds_in_all}};
  if (r.cleaned) {
    json["cleaned"] = {{"gaussians", r.cleaned->rows.size()}, {"views", r.cleaned->views}, {"psnr", nullptr}};
    if (std::isfinite(r.cleaned->psnr)) json["cleaned"]["psnr"] = r.cleaned->psnr;
  }
  if (r.kept_outside) json["region"] = {{"gaussians", r.region_in}, {"kept_outside", *r.kept_outside}};
  if (!r.quality.empty()) json["quality"] = r.quality;
  for (const StepReport& step : r.steps) {
    const std::string key = json.contains(step.method) ? step.method + " again" : step.method;
    for (const auto& [name, value] : step.facts) {
      std::visit([&, &fact = name](auto told) { json[key][fact] = told; }, value);
    }
    if (step.plan) json[key]["plan"] = ToJson(*step.plan);
  }
  if (r.pixel_size_source != PixelSizeSource::kNone) {
    json["upscale"] = r.upscale;
    json["filter_strength"] = r.filter_strength;
    json["pixel_size"] = {{"value", r.pixel_size}, {"source", NameOf(r.pixel_size_source)}};
    if (r.pixel_size_source == PixelSizeSource::kUnknown) json["pixel_size"]["value"] = nullptr;
    if (r.pixel_size_range) json["pixel_size"]["range"] = {r.pixel_size_range->first, r.pixel_size_range->second};
    if (r.reading) json["reading"] = ToJson(*r.reading);
    for (const PartTreatment& part : r.parts) {
      json["parts"].push_back(
          {{"gaussians", part.gaussians}, {"pixel_size", part.pixel_size}, {"by_network", part.by_network}});
    }
    if (!r.camera_rule.empty()) json["camera_rule"] = r.camera_rule;
    if (r.train_width) json["train_width"] = *r.train_width;
  }
  return json;
}

}  // namespace anchorsplat
