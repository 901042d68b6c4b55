#include "request/fit_flags.h"

#include <algorithm>

#include "cameras/photograph.h"
#include "core/text.h"
#include "request/choice.h"
#include "request/parse.h"

namespace anchorsplat {

namespace {

constexpr int64_t kMostSteps = int64_t{1} << 40;

// A small opacity above 0.
CLI::Validator FaintOpacity() {
  return CLI::Validator(
      [](const std::string& text) {
        double value = 0;
        const bool number = CLI::detail::lexical_cast(text, value);
        return number && value > 0 && value < 0.5 ? "" : "must be a number above 0 and below 0.5, found '" + text + "'";
      },
      "");
}

// A count, or auto, which leaves `count` empty.
void AddShellFlag(CLI::App& verb, std::optional<int64_t>& count) {
  const auto check = [](const std::string& text) -> std::string {
    int64_t value = 0;
    if (text == "auto" || (CLI::detail::lexical_cast(text, value) && value >= 0 && value <= kMostOnShell)) return "";
    return Cat("must be auto or a whole number from 0 to ", kMostOnShell, ", found '", text, "'");
  };
  const auto assign = [&count](const std::string& text) {
    int64_t value = 0;
    count = text != "auto" && CLI::detail::lexical_cast(text, value) ? std::optional(value) : std::nullopt;
  };
  verb.add_option_function<std::string>("--shell", assign,
                                        "Gaussians on a far sphere, for sky and distant background: how many; 0: "
                                        "none; auto: some if the project's points leave much of the pictures empty")
      ->type_name("N")
      ->check(CLI::Validator(check, ""))
      ->default_str("auto");
}

void AddScheduleFlags(CLI::App& verb, FitFlags& f) {
  const std::string group = "Densification (names as in gsplat; steps default to its schedules, scaled to --steps)";
  DensificationOptions& d = f.standard.densification;
  const auto steps = [&](const char* name, std::optional<int64_t>& value, const char* help) {
    verb.add_option(name, value, help)->check(CLI::Range(int64_t{1}, kMostSteps))->group(group);
  };
  const auto number = [&](const char* name, double& value, const char* help, const CLI::Validator& check) {
    verb.add_option(name, value, help)->check(check)->capture_default_str()->group(group);
  };
  steps("--refine-start", f.refine_start, "Grow after this step");
  steps("--refine-stop", f.refine_stop, "Stop growing at this step");
  steps("--refine-every", f.refine_every, "Steps between rounds of growth");
  steps("--reset-every", f.reset_every, "Steps between opacity resets");
  steps("--sh-degree-interval", f.sh_degree_interval, "Steps per degree of spherical harmonics");
  AddChoice(
      verb, "--opacity-reset", d.opacity_reset,
      {{"positive", OpacityReset::kPositive}, {"from-zero", OpacityReset::kFromZero}, {"never", OpacityReset::kNever}},
      "positive: gsplat's main branch; from-zero: up to 1.5.2, at step 0 too; never: 1.5.3")
      ->group(group);
  verb.add_option("--grow-grad2d", f.grow_grad2d,
                  "Grow Gaussians with a larger image-plane gradient (default: 0.0002; absgrad: 0.0008)")
      ->check(NotNegative())
      ->group(group);
  number("--grow-scale3d", d.grow_scale3d, "Split, not duplicate, Gaussians larger than this (scene scales)",
         Positive());
  number("--prune-opa", d.prune_opa, "Prune Gaussians fainter than this; 1e-9 keeps all", FaintOpacity());
  number("--prune-scale3d", d.prune_scale3d, "Prune Gaussians larger than this (scene scales)", Positive());
  verb.add_flag("--revised-opacity", d.revised_opacity, "Divide the opacity of a split between its halves")
      ->group(group);
  number("--min-opacity", f.standard.mcmc.min_opacity,
         "With mcmc: relocate Gaussians up to this opacity; 1e-9 relocates none", FaintOpacity());
  number("--noise-lr", f.standard.mcmc.noise_lr, "With mcmc: noise on centres, times their learning rate",
         NotNegative());
  const auto regularizer = [&](const char* name, std::optional<double>& value, const char* help) {
    verb.add_option(name, value, help)->check(NotNegative())->group(group);
  };
  regularizer("--opacity-reg", f.opacity_reg, "Weight of the mean opacity in the loss (default: 0; mcmc: 0.01)");
  regularizer("--scale-reg", f.scale_reg, "Weight of the mean size in the loss (default: 0; mcmc: 0.01)");
}

void AddRateFlags(CLI::App& verb, FitFlags& f) {
  const std::string group = "Learning rates";
  LearningRates& r = f.standard.rates;
  const auto rate = [&](const char* name, double& value, const char* help) {
    return verb.add_option(name, value, help)->check(NotNegative())->capture_default_str()->group(group);
  };
  rate("--rate-means", r.means, "Of centres, in scene scales");
  rate("--rate-means-decay", r.means_decay, "Factor on it by the last step, up to 1")
      ->check(Positive())
      ->check(Fraction());
  rate("--rate-scales", r.scales, "Of log-scales");
  rate("--rate-quats", r.quats, "Of quaternions");
  rate("--rate-opacities", r.opacities, "Of opacity logits");
  rate("--rate-sh0", r.sh0, "Of the constant colour");
  rate("--rate-sh-rest", r.sh_rest, "Of higher spherical harmonics");
}

}  // namespace

void FitFlags::AddTo(CLI::App& verb) {
  verb.add_option("--steps", steps, "Optimisation steps; all schedules scale with them")
      ->check(CLI::Range(int64_t{1}, kMostSteps))
      ->capture_default_str();
  verb.add_option("--max-gaussians", max_gaussians, "Most Gaussians; 0: no limit (default: 0; mcmc: 1000000)")
      ->check(NotNegative());
  AddChoice(verb, "--strategy", strategy,
            {{"default", FitPreset::kDefault}, {"absgrad", FitPreset::kAbsgrad}, {"mcmc", FitPreset::kMcmc}},
            "Densification. default: Kerbl et al. absgrad: by absolute gradients, for fine detail (AbsGS). mcmc: "
            "relocation of a fixed number");
  verb.add_flag("--mip-filter", mip_filter,
                "Mip-Splatting: smooth every Gaussian by the pixel of its closest camera; implies --mode mip");
  verb.add_flag("--exposure", exposure,
                "Fit a gain and a bias per channel and picture, for pictures that differ in brightness or tint");
  verb.add_option("--hold-out", hold_out, "Hold out every Nth view, by name; 0: none")
      ->check(CLI::Range(0, 1 << 30))
      ->capture_default_str();
  verb.add_option("--downscale", downscale, "Average N x N pixels of the pictures")
      ->check(CLI::Range(1, kMaxDownscale))
      ->capture_default_str();
  auto* init_option = AddChoice(
      verb, "--init", init,
      {{"auto", FitInit::kAuto}, {"points", FitInit::kPoints}, {"view", FitInit::kView}, {"random", FitInit::kRandom}},
      "Where the first Gaussians are. points: the project's. view: random, where many cameras look. random: in "
      "gsplat's cube. auto: points, else view");
  verb.add_option("--init-splat", init_splat, "Start with Gaussians at the centres of this splat")
      ->type_name("FILE")
      ->check(NotEmpty())
      ->excludes(init_option);
  verb.add_option("--init-points", init_points,
                  "Number of first Gaussians (default: all points, or 100000 random ones)")
      ->check(CLI::Range(int64_t{1}, int64_t{1} << 28));
  verb.add_option("--init-extent", init_extent,
                  "With --init random: half the side of the cube, scene scales; INRIA uses 0.3 for single objects")
      ->check(CLI::Range(1e-3, 1e3))
      ->capture_default_str();
  AddShellFlag(verb, shell);
  verb.add_option("--background", background, "R,G,B from 0 to 1 (default: from the project, else black)")
      ->type_name("R,G,B");
  verb.add_option("--sh-degree", standard.objective.render.sh_degree, "Highest degree of spherical harmonics")
      ->check(CLI::Range(0, kMaxShDegree))
      ->capture_default_str();
  verb.add_option("--ssim-weight", standard.objective.loss.ssim_weight, "w of the loss (1 - w) L1 + w (1 - SSIM)")
      ->check(Fraction())
      ->capture_default_str();
  AddChoice(verb, "--mode", standard.objective.render.mode,
            {{"classic", RenderMode::kClassic}, {"antialiased", RenderMode::kAntialiased}, {"mip", RenderMode::kMip}},
            "Rasterization. antialiased and mip compensate opacity for the dilation of 0.3 and 0.1 px²");
  auto* pixel_option = AddChoice(
      verb, "--pixel", pixel, {{"point", FitPixel::kPoint}, {"area", FitPixel::kArea}},
      "What a pixel measures. point: its centre, as 3DGS. area: its mean, for splats to be seen --upscale times "
      "closer");
  verb.add_option("--upscale", upscale, "With --pixel area: zoom to prepare for")
      ->check(CLI::Range(1.0, double{kMostSamples}))
      ->needs(pixel_option)
      ->capture_default_str();
  AddChoice(verb, "--profile", standard.objective.render.profile,
            {{"gsplat14", RasterProfile::kGsplat14}, {"gsplat15", RasterProfile::kGsplat15}},
            "Cut-off of a Gaussian: 3 sigma as in gsplat 1.0-1.4, or by opacity as in 1.5");
  verb.add_option("--checkpoint", checkpoint, "File to resume from (default: OUTPUT.checkpoint)")
      ->type_name("FILE")
      ->check(NotEmpty());
  verb.add_option("--checkpoint-every", checkpoint_every, "Steps between checkpoints; 0: only when interrupted")
      ->check(CLI::Range(int64_t{0}, kMostSteps))
      ->capture_default_str();
  verb.add_flag("--resume", resume, "Continue from the checkpoint, if there is one");
  AddScheduleFlags(verb, *this);
  AddRateFlags(verb, *this);
}

namespace {

// kBadArgument: a given option has no effect with the others.
Status CheckEffects(const FitFlags& flags, const FitOptions& options) {
  const DensificationOptions& d = options.densification;
  const bool mcmc = options.strategy == Strategy::kMcmc;
  const int64_t start = mcmc ? options.mcmc.refine_start_iter : d.refine_start_iter;
  const int64_t stop = mcmc ? options.mcmc.refine_stop_iter : d.refine_stop_iter;
  const bool grows = start < std::min(stop, options.steps);
  struct Need {
    const char* option;
    bool met;
    const char* with;
  };
  const bool harmonics = options.objective.render.sh_degree > 0, resets = d.opacity_reset != OpacityReset::kNever;
  constexpr const char* kOthers = "with --strategy default or absgrad";
  const Need needs[] = {
      {"reset-every", !mcmc, kOthers},
      {"opacity-reset", !mcmc, kOthers},
      {"grow-grad2d", !mcmc, kOthers},
      {"grow-scale3d", !mcmc, kOthers},
      {"prune-opa", !mcmc, kOthers},
      {"prune-scale3d", !mcmc, kOthers},
      {"revised-opacity", !mcmc, kOthers},
      {"min-opacity", mcmc, "with --strategy mcmc"},
      {"noise-lr", mcmc, "with --strategy mcmc"},
      {"mode", !options.mip_filter, "without --mip-filter"},
      {"init-extent", flags.init == FitInit::kRandom, "with --init random"},
      {"upscale", flags.pixel == FitPixel::kArea, "with --pixel area"},
      {"rate-sh-rest", harmonics, "with --sh-degree above 0"},
      {"sh-degree-interval", harmonics, "with --sh-degree above 0"},
      {"reset-every", resets, "with --opacity-reset positive or from-zero"},
      {"refine-start", grows, "before --refine-stop and the last step"},
      {"refine-every", grows, "with --refine-start before --refine-stop and the last step"},
      {"grow-grad2d", grows, "with --refine-start before --refine-stop and the last step"},
      {"grow-scale3d", grows, "with --refine-start before --refine-stop and the last step"},
      {"min-opacity", grows, "with --refine-start before --refine-stop and the last step"},
  };
  for (const Need& need : needs) {
    if (need.met || std::find(flags.given.begin(), flags.given.end(), need.option) == flags.given.end()) continue;
    return Error{ErrorCode::kBadArgument, Cat("--", need.option, " has no effect here; it works only ", need.with)};
  }
  return {};
}

}  // namespace

Result<FitOptions> MakeFitOptions(const FitFlags& flags, const std::optional<std::array<float, 3>>& background,
                                  uint64_t seed) {
  FitOptions options = flags.standard;
  const FitOptions scaled = FitOptionsFor(flags.steps, flags.strategy);
  options.steps = flags.steps;
  options.seed = seed;
  options.sh_degree_interval = flags.sh_degree_interval.value_or(scaled.sh_degree_interval);
  DensificationOptions& d = options.densification;
  d.refine_start_iter = flags.refine_start.value_or(scaled.densification.refine_start_iter);
  d.refine_stop_iter = flags.refine_stop.value_or(scaled.densification.refine_stop_iter);
  d.refine_every = flags.refine_every.value_or(scaled.densification.refine_every);
  d.reset_every = flags.reset_every.value_or(scaled.densification.reset_every);
  d.absgrad = scaled.densification.absgrad;
  d.grow_grad2d = flags.grow_grad2d.value_or(scaled.densification.grow_grad2d);
  d.max_gaussians = flags.max_gaussians.value_or(scaled.densification.max_gaussians);
  options.strategy = scaled.strategy;
  McmcOptions& m = options.mcmc;
  m.refine_start_iter = flags.refine_start.value_or(scaled.mcmc.refine_start_iter);
  m.refine_stop_iter = flags.refine_stop.value_or(scaled.mcmc.refine_stop_iter);
  m.refine_every = flags.refine_every.value_or(scaled.mcmc.refine_every);
  m.cap_max = scaled.mcmc.cap_max;
  if (options.strategy == Strategy::kMcmc) {
    m.cap_max = flags.max_gaussians.value_or(m.cap_max);
    if (m.cap_max < 1) {
      return Error{ErrorCode::kBadArgument, "--max-gaussians 0: --strategy mcmc needs a number to grow to"};
    }
  }
  options.regularizers.opacity_reg = flags.opacity_reg.value_or(scaled.regularizers.opacity_reg);
  options.regularizers.scale_reg = flags.scale_reg.value_or(scaled.regularizers.scale_reg);
  options.mip_filter_every = scaled.mip_filter_every;
  if (flags.mip_filter && flags.pixel == FitPixel::kArea) {
    return Error{ErrorCode::kBadArgument,
                 "--mip-filter and --pixel area exclude each other: both set the size of a pixel"};
  }
  if (flags.mip_filter) UseMipFilter(options);
  options.exposure_from = flags.exposure ? ExposureFrom(flags.steps) : -1;
  options.objective.render.background = background.value_or(options.objective.render.background);
  if (!flags.background.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(options.objective.render.background, ParseColor("--background", flags.background));
  }
  options.pixel.upscale = flags.pixel == FitPixel::kArea ? flags.upscale : 1;
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(options));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckEffects(flags, options));
  return options;
}

}  // namespace anchorsplat
