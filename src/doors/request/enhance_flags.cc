#include "request/enhance_flags.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <type_traits>

#include "cameras/camera_io.h"
#include "core/text.h"
#include "enhance/gaussian_budget.h"
#include "model/model_method.h"
#include "model/network_options.h"
#include "request/choice.h"
#include "request/findings.h"
#include "request/mode_option.h"
#include "request/parse.h"

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
      ->check(OneOf({"fast", "good", "best"}));
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
  verb.add_option("--train-width", options.train_width,
                  "Image width in training, if smaller than in --cameras (default: estimated)")
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

CLI::Validator InRange(const OptionRange& range, bool whole) {
  std::string shown;  // in the help
  if (range.greatest == OptionRange().greatest) {
    if (range.least == 0) shown = range.above_least ? "POSITIVE" : "NONNEGATIVE";
  } else if (whole) {
    shown = Cat("INT in [", static_cast<int64_t>(range.least), " - ", static_cast<int64_t>(range.greatest), "]");
  }
  return CLI::Validator(
      [range, whole](const std::string& text) {
        double number = 0;
        const bool fits = CLI::detail::lexical_cast(text, number) && Contains(range, number);
        return fits ? "" : Cat("must be ", Describe(range, whole), ", found '", text, "'");
      },
      shown);
}

CLI::Option* AddWord(CLI::App& verb, const std::string& name, const WordOption& word, const std::string& help) {
  const auto set = [word, name](const std::string& text) {
    const Status status = word.set(text);
    if (!status.ok()) throw CLI::ValidationError(name, status.error().message);
  };
  CLI::Option* option = verb.add_option_function<std::string>(name, set, help)->default_str(word.now);
  return word.choices.empty() ? option : option->check(OneOf(word.choices));
}

// Declares what is described, except what `verb` has already. Values go into `options`.
void AddMethodOptions(CLI::App& verb, const std::string& group, const std::vector<MethodOption>& described,
                      EnhanceOptions& options) {
  for (const MethodOption& row : described) {
    const std::string name = "--" + row.name;
    if (!row.value || verb.get_option_no_throw(name) != nullptr) continue;
    OptionValue value = row.value(options);
    CLI::Option* option = std::visit(
        [&]<class Value>(Value& to) -> CLI::Option* {
          using T = std::remove_pointer_t<Value>;
          if constexpr (std::is_same_v<Value, WordOption>) {
            return AddWord(verb, name, to, row.help);
          } else if constexpr (std::is_same_v<T, bool>) {
            return verb.add_flag(name, *to, row.help);
          } else if constexpr (std::is_same_v<T, std::filesystem::path>) {
            const auto set = [to](const std::string& text) { *to = text; };
            return verb.add_option_function<std::string>(name, set, row.help)->type_name("FILE")->check(NotEmpty());
          } else {
            constexpr bool whole = !std::is_floating_point_v<T> && !std::is_same_v<T, std::optional<double>>;
            CLI::Option* number = verb.add_option(name, *to, row.help)->check(InRange(row.range, whole));
            return std::is_arithmetic_v<T> ? number->capture_default_str() : number;
          }
        },
        value);
    if (!row.type.empty()) option->type_name(row.type);
    option->group(group);
  }
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
  AddMethodOptions(verb, "Network", NetworkOptions(), options);
  AddMethodOptions(verb, "Published network, as its script runs it", PublishedScriptOptions(), options);
  AddMethodOptions(verb, "Refinement", RefinementOptions(), options);
  AddMethodOptions(verb, "Refinement", CheckpointOptions(), options);
  verb.get_option("--seconds")->excludes(verb.get_option("--steps"));
}

Result<EnhanceOptions> MakeEnhanceOptions(const EnhanceFlags& flags, uint64_t seed, const CameraSet* cameras) {
  EnhanceOptions options = flags.options;
  options.methods = &AllMethods();
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
