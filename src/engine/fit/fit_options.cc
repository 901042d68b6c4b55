#include "fit/fit_options.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/text.h"
#include "fit/mip_filter.h"

namespace anchorsplat {

FitOptions FitOptionsFor(int64_t steps, FitPreset preset) {
  const auto scaled = [&](int64_t count) { return std::max<int64_t>(1, count * steps / kStandardSteps); };
  FitOptions options;
  options.steps = steps;
  options.sh_degree_interval = scaled(options.sh_degree_interval);
  options.densification = ScaledTo(options.densification, steps);
  options.mcmc = ScaledTo(options.mcmc, steps);
  options.mip_filter_every = scaled(options.mip_filter_every);
  switch (preset) {
    case FitPreset::kDefault:
      break;
    case FitPreset::kAbsgrad:
      options.densification.absgrad = true;
      options.densification.grow_grad2d = kAbsgradGrowGrad2d;
      break;
    case FitPreset::kMcmc:
      options.strategy = Strategy::kMcmc;
      options.regularizers = {.opacity_reg = 0.01, .scale_reg = 0.01};
      break;
  }
  return options;
}

void UseMipFilter(FitOptions& options) {
  options.mip_filter = true;
  options.objective.render = MipRendering(options.objective.render);
}

InitialCloudOptions StartOptions(const FitOptions& options) {
  InitialCloudOptions start{.sh_degree = options.objective.render.sh_degree, .seed = options.seed};
  if (options.strategy == Strategy::kMcmc) {
    start.opacity = kMcmcInitialOpacity;
    // The 3-D filter keeps integrals, so it would make such small ones nearly invisible, and they would fade away.
    start.scale = options.mip_filter ? kMcmcInitialScaleOfFiltered : kMcmcInitialScale;
  }
  return start;
}

double UnitOf(double scene_scale) {
  constexpr double kSceneScaleOfUnitCameras = 1.1;  // see TrainingViews::scene_scale
  return scene_scale > 0 ? scene_scale / kSceneScaleOfUnitCameras : 1;
}

int ShDegreeAt(const FitOptions& options, int64_t step) {
  const int64_t degree = step / std::max<int64_t>(1, options.sh_degree_interval);
  return static_cast<int>(std::min<int64_t>(degree, options.objective.render.sh_degree));
}

PixelModel PixelModelAt(const FitOptions& options, int64_t step) {
  return PixelModelAt(options.pixel, static_cast<double>(step) / static_cast<double>(options.steps));
}

Status Validate(const FitOptions& options) {
  const auto bad = [](const std::string& sentence) { return Error{ErrorCode::kBadArgument, "fit: " + sentence}; };
  if (options.steps < 1) return bad("there must be at least one step");
  const LearningRates& r = options.rates;
  for (const auto& [name, rate] : {std::pair{"means", r.means},
                                   {"scales", r.scales},
                                   {"opacities", r.opacities},
                                   {"quats", r.quats},
                                   {"sh0", r.sh0},
                                   {"sh_rest", r.sh_rest}}) {
    if (!(rate >= 0 && std::isfinite(rate))) return bad(Cat("learning rate of ", name, " must not be negative"));
  }
  if (!(r.means_decay > 0 && r.means_decay <= 1)) return bad("the decay of the means' rate must lie in (0, 1]");
  if (!(r.beta1 >= 0 && r.beta1 < 1 && r.beta2 >= 0 && r.beta2 < 1)) return bad("Adam's betas must lie in [0, 1)");
  if (!(static_cast<float>(r.epsilon) > 0)) return bad("Adam's epsilon must be positive");
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(options.pixel));
  const DensificationOptions& d = options.densification;
  if (d.refine_every < 1 || d.reset_every < 1) return bad("refine_every and reset_every must be at least 1");
  if (!(d.prune_opa > 0 && d.prune_opa < 0.5)) return bad("prune_opa must lie between 0 and 0.5");
  for (const auto& [name, value] : {std::pair{"grow_grad2d", d.grow_grad2d},
                                    {"grow_scale3d", d.grow_scale3d},
                                    {"grow_scale2d", d.grow_scale2d},
                                    {"prune_scale3d", d.prune_scale3d},
                                    {"prune_scale2d", d.prune_scale2d}}) {
    if (!(value >= 0 && std::isfinite(value))) return bad(Cat(name, " must be finite and not negative"));
  }
  if (d.grow_scale3d == 0 || d.prune_scale3d == 0) return bad("grow_scale3d and prune_scale3d must be positive");
  const double ssim = options.objective.loss.ssim_weight;
  if (!(ssim >= 0 && ssim <= 1)) return bad("the weight of SSIM must lie in [0, 1]");
  if (d.max_gaussians < 0) return bad("max_gaussians must not be negative");
  const McmcOptions& m = options.mcmc;
  if (m.cap_max < 1) return bad("cap_max must be at least 1: mcmc grows to it");
  if (m.refine_every < 1) return bad("refine_every must be at least 1");
  if (!(m.noise_lr >= 0 && std::isfinite(m.noise_lr))) return bad("noise_lr must be finite and not negative");
  if (!(m.min_opacity > 0 && m.min_opacity < 0.5)) return bad("min_opacity must lie between 0 and 0.5");
  for (const auto& [name, value] :
       {std::pair{"opacity_reg", options.regularizers.opacity_reg}, {"scale_reg", options.regularizers.scale_reg}}) {
    if (!(value >= 0 && std::isfinite(value))) return bad(Cat(name, " must be finite and not negative"));
  }
  const auto& center = options.far.center;
  if (!(options.far.radius >= 0 && std::isfinite(options.far.radius + center[0] + center[1] + center[2]))) {
    return bad("the far shell's centre and radius must be finite, and the radius not negative");
  }
  if (options.mip_filter_every < 1) return bad("mip_filter_every must be at least 1");
  if (options.mip_filter && options.pixel.upscale > 1)
    return bad("the Mip-Splatting filter needs point pixels (upscale 1)");
  if (options.mip_filter && options.objective.render.mode != RenderMode::kMip) {
    return bad("the Mip-Splatting filter needs the mode mip");
  }
  const int degree = options.objective.render.sh_degree;
  if (degree < 0 || degree > kMaxShDegree) return bad("SH degree must be 0 to 3");
  return {};
}

std::string ToJsonText(const FitOptions& o) {
  const DensificationOptions& d = o.densification;
  const LearningRates& r = o.rates;
  const RenderOptions& render = o.objective.render;
  // Flat, so that a difference has a single name.
  nlohmann::json json = {
      {"steps", o.steps},
      {"seed", o.seed},
      {"sh_degree_interval", o.sh_degree_interval},
      {"rate_means", r.means},
      {"rate_means_decay", r.means_decay},
      {"rate_scales", r.scales},
      {"rate_opacities", r.opacities},
      {"rate_quats", r.quats},
      {"rate_sh0", r.sh0},
      {"rate_sh_rest", r.sh_rest},
      {"beta1", r.beta1},
      {"beta2", r.beta2},
      {"epsilon", r.epsilon},
      {"prune_opa", d.prune_opa},
      {"grow_grad2d", d.grow_grad2d},
      {"grow_scale3d", d.grow_scale3d},
      {"grow_scale2d", d.grow_scale2d},
      {"prune_scale3d", d.prune_scale3d},
      {"prune_scale2d", d.prune_scale2d},
      {"refine_scale2d_stop_iter", d.refine_scale2d_stop_iter},
      {"refine_start_iter", d.refine_start_iter},
      {"refine_stop_iter", d.refine_stop_iter},
      {"refine_every", d.refine_every},
      {"reset_every", d.reset_every},
      {"pause_refine_after_reset", d.pause_refine_after_reset},
      {"absgrad", d.absgrad},
      {"revised_opacity", d.revised_opacity},
      {"opacity_reset", static_cast<int>(d.opacity_reset)},
      {"max_gaussians", d.max_gaussians},
      {"strategy", o.strategy == Strategy::kMcmc ? "mcmc" : "default"},
      {"cap_max", o.mcmc.cap_max},
      {"noise_lr", o.mcmc.noise_lr},
      {"mcmc_refine_start_iter", o.mcmc.refine_start_iter},
      {"mcmc_refine_stop_iter", o.mcmc.refine_stop_iter},
      {"mcmc_refine_every", o.mcmc.refine_every},
      {"min_opacity", o.mcmc.min_opacity},
      {"opacity_reg", o.regularizers.opacity_reg},
      {"scale_reg", o.regularizers.scale_reg},
      {"mip_filter", o.mip_filter},
      {"mip_filter_every", o.mip_filter_every},
      {"sh_degree", render.sh_degree},
      {"profile", static_cast<int>(render.profile)},
      {"mode", NameOf(render.mode)},
      {"background", render.background},
      {"near_plane", render.near_plane},
      {"far_plane", render.far_plane},
      {"dilation", DilationOf(render)},
      {"min_alpha", render.min_alpha},
      {"min_transmittance", render.min_transmittance},
      {"pixel", o.pixel.upscale > 1 ? "area" : "point"},
      {"pixel_upscale", o.pixel.upscale},
      {"pixel_half_from", o.pixel.half_from},
      {"pixel_all_from", o.pixel.all_from},
      {"exposure_from", o.exposure_from},
      {"ssim_weight", o.objective.loss.ssim_weight},
      {"ssim_padding", static_cast<int>(o.objective.loss.padding)},
  };
  if (o.far.any()) {
    json["far_center"] = o.far.center;
    json["far_radius"] = o.far.radius;
  }
  return json.dump();
}

}  // namespace anchorsplat
