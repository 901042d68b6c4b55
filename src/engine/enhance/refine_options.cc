#include "enhance/refine_options.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <type_traits>

#include "cameras/photograph.h"
#include "core/text.h"
#include "enhance/enhance.h"
#include "enhance/gaussian_budget.h"

namespace anchorsplat {

namespace {

template <auto Member>
OptionValue In(EnhanceOptions& options) {
  return &(options.refine.*Member);
}
template <auto Member>
OptionValue InControl(EnhanceOptions& options) {
  return &(options.control.*Member);
}

std::string WithImages(const MethodUse& use) { return use.options.refine.images.empty() ? "with --images" : ""; }
std::string WithoutViews(const MethodUse& use) {
  return WithImages(use).empty() || use.options.cameras ? "without --images and --cameras" : "";
}
std::string WithCamerasOnly(const MethodUse& use) {
  return WithImages(use).empty() || !use.options.cameras ? "with --cameras, without --images" : "";
}
std::string Closer(const MethodUse& use) { return use.options.upscale > 1 ? "" : "with --upscale above 1"; }
std::string ForSteps(const MethodUse& use) { return use.options.refine.seconds ? "without --seconds" : ""; }

EnhanceOptions With(const RefineOptions& refine) {
  EnhanceOptions options;
  options.refine = refine;
  SetBudget(options, refine.max_gaussians);
  return options;
}

}  // namespace

const std::vector<MethodOption>& RefinementOptions() {
  static const std::vector<MethodOption> options = {
      {"images",
       In<&RefineOptions::images>,
       "Project with the training pictures (as for `fit`), full-size if possible: the best reference for refinement",
       {},
       {},
       "PROJECT"},
      {"enlarge-with", In<&RefineOptions::enlarge_with>,
       "With --method detail: network that adds detail to the reference, a .safetensors of scripts/fetch-upscaler.sh"},
      {"hold-out",
       In<&RefineOptions::hold_out>,
       "With --images: hold out every Nth view; 0: none (default: 8, or 0 if the splat seems fitted to all)",
       {0, 1 << 30},
       WithImages},
      {"downscale",
       In<&RefineOptions::downscale>,
       "With --images: average N x N pixels",
       {1, kMaxDownscale},
       WithImages},
      {"steps",
       In<&RefineOptions::steps>,
       "Steps (default: 1500 with --images; without: 600, after a network 100; with --method detail: 300)",
       {1, int64_t{1} << 40}},
      {"seconds", In<&RefineOptions::seconds>, "Run for this time instead of --steps; not reproducible", kMoreThanZero},
      {"k",
       In<&RefineOptions::copies>,
       "Split each Gaussian into so many first (default: 8 with --images; without: 4, after a network 1; with "
       "--method detail: 1; fewer if the closer view has too few pixels)",
       {1, kMostCopies}},
      BudgetOption(),
      {"poses",
       In<&RefineOptions::poses>,
       "Without --images and --cameras: views around the object",
       {1, 1 << 20},
       WithoutViews},
      {"between",
       In<&RefineOptions::between>,
       "With --cameras, without --images: extra views per camera, half-way to its neighbours",
       {0, 64},
       WithCamerasOnly},
      {"half-from", In<&RefineOptions::half_from>, "Fraction of the run after which half of the rays are rendered",
       kZeroToOne, Closer},
      {"all-from", In<&RefineOptions::all_from>, "Fraction of the run after which all rays are rendered", kZeroToOne,
       Closer},
      {"rate", In<&RefineOptions::rate>,
       "Factor on the learning rates of `fit` (default: 1; after a network without --images: 0.1; with --method "
       "detail: 0.3)",
       kMoreThanZero},
      {"rate-decay", In<&RefineOptions::rate_decay>, "Factor on --rate by the end of the run", {0, 1, true}},
      {"ssim-weight", In<&RefineOptions::ssim_weight>, "w of the loss (1 - w) L1 + w (1 - SSIM)", kZeroToOne},
      {"exposure", In<&RefineOptions::exposure>, "Fit brightness and tint of each picture of --images", {}, WithImages},
      {"robust",
       In<&RefineOptions::robust>,
       "Ignore gross differences from --images: passers-by, flares",
       {},
       WithImages},
      {"align", In<&RefineOptions::align>, "Optimise the poses of --images, too", {}, WithImages},
  };
  return options;
}

const std::vector<MethodOption>& CheckpointOptions() {
  static const std::vector<MethodOption> options = {
      {"checkpoint",
       InControl<&RefineControl::checkpoint>,
       "File to resume from (default: OUTPUT.checkpoint); a network writes one only with this or --resume",
       {},
       ForSteps},
      {"checkpoint-every", InControl<&RefineControl::checkpoint_every>,
       "Refinement steps between checkpoints; 0: only when interrupted", kZeroOrMore, ForSteps},
      {"resume", InControl<&RefineControl::resume>, "Continue from the checkpoint, if there is one", {}, ForSteps},
  };
  return options;
}

Status Validate(const RefineOptions& o) {
  EnhanceOptions options = With(o);
  ANCHORSPLAT_RETURN_IF_ERROR(CheckRanges(RefinementOptions(), options));
  const auto bad = [](const std::string& sentence) { return Error{ErrorCode::kBadArgument, "refine: " + sentence}; };
  if (o.steps && o.seconds) return bad("give steps or seconds, not both");
  if (o.half_from > o.all_from) return bad("the parts with more rays per pixel must ascend from 0 to 1");
  return {};
}

std::string ToJsonText(const RefineOptions& o) {
  // Flat, so that a difference has a single name.
  nlohmann::json json = {{"images", !o.images.empty()}};
  EnhanceOptions options = With(o);
  for (const MethodOption& option : RefinementOptions()) {
    std::string key = option.name == "k" ? "copies" : option.name;
    std::ranges::replace(key, '-', '_');
    std::visit(
        [&](auto value) {
          if constexpr (requires { value->value_or(0); }) {
            json[key] = value->value_or(0);
          } else if constexpr (requires { json[key] = *value + 0; }) {
            json[key] = *value;
          }
        },
        option.value(options));
  }
  json.erase("seconds");  // not reproducible
  json["hold_out"] = o.hold_out.value_or(-1);
  if (o.downscale == 1) json.erase("downscale");
  if (o.enlarged) json["enlarged"] = true;
  if (!o.images.empty()) json["split"] = "by residual";
  return json.dump();
}

}  // namespace anchorsplat
