#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "fit/far_shell.h"
#include "fit/fit.h"
#include "fit/fit_options.h"
#include "fit/initial_points.h"
#include "fit/training_views.h"

namespace anchorsplat {

// What a pixel measures: its centre or its mean.
enum class FitPixel { kPoint, kArea };

// Options of `fit`, without input and output.
struct FitFlags {
  std::string checkpoint;
  int64_t checkpoint_every = 0;
  bool resume = false;
  int hold_out = 8;
  int downscale = 1;
  FitInit init = FitInit::kAuto;
  std::string init_splat;
  std::optional<int64_t> init_points;
  double init_extent = kRandomExtent;
  std::optional<int64_t> shell;  // unset: auto
  std::string background;
  FitPreset strategy = FitPreset::kDefault;
  bool mip_filter = false;
  bool exposure = false;
  FitPixel pixel = FitPixel::kPoint;
  double upscale = 4;  // of FitPixel::kArea

  // For FitOptions. Unset values follow from the number of steps and the strategy.
  int64_t steps = kDefaultFitSteps;
  FitOptions standard = FitOptionsFor(kDefaultFitSteps);  // values that depend on neither
  std::optional<int64_t> sh_degree_interval, refine_start, refine_stop, refine_every, reset_every;
  std::optional<int64_t> max_gaussians;
  std::optional<double> grow_grad2d, opacity_reg, scale_reg;

  std::vector<std::string> given;  // option names

  void AddTo(CLI::App& verb);
};

// `background`: that of the project, if known. Errors (kBadArgument) name the option.
Result<FitOptions> MakeFitOptions(const FitFlags& flags, const std::optional<std::array<float, 3>>& background,
                                  uint64_t seed);

// Initial points, and where they come from in words.
struct ChosenStart {
  InitialPoints points;
  std::string origin;
};

// `splat`: that of --init-splat, if already read. `project` is for messages. Errors: reading; kBadArgument: --init
// points for a project without points.
Result<ChosenStart> ChooseFitStart(const FitFlags& flags, const TrainingViews& views, const std::string& project,
                                   uint64_t seed, const GaussianCloud* splat = nullptr);

// Initial Gaussians: those at the initial points and, if --shell or the pictures call for it, a far shell, which is
// noted in `options`. Errors: those of InitialCloud and AddFarShell.
struct FirstGaussians {
  GaussianCloud cloud;
  AddedShell shell;
};
Result<FirstGaussians> MakeFirstGaussians(const FitFlags& flags, const TrainingViews& views, const ChosenStart& start,
                                          FitOptions& options);

// Report for --json and Python.
nlohmann::json ToJson(const FitOptions& options, const std::string& origin, const AddedShell& shell,
                      const FitReport& report);

}  // namespace anchorsplat
