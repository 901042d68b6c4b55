#include "enhance/refine.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>
#include <vector>

#include "core/file_system.h"
#include "core/log.h"
#include "core/run_context.h"
#include "core/text.h"
#include "enhance/refine_copies.h"
#include "enhance/refine_pictures.h"
#include "enhance/refine_poses.h"
#include "enhance/refiner.h"
#include "enhance/split_gaussians.h"
#include "fit/fingerprints.h"
#include "fit/training_views.h"
#include "metrics/image_metrics.h"
#include "render/shown_range.h"

namespace anchorsplat {

namespace {

constexpr int64_t kStepsWithPictures = 1500, kStepsWithout = 600;
constexpr int kCopiesWithPictures = 8, kCopiesWithout = 4;
// Without pictures, a start that shows more than the splat does would lose it to what the splat shows: a few small
// steps bring what both know. Chosen on the validation objects (docs/refine.md).
constexpr int64_t kStepsGentle = 100;
constexpr double kRate = 1, kRateGentle = 0.1;
constexpr int64_t kCheckViews = 8;
constexpr int64_t kResidualViews = 64;
constexpr int64_t kNoteEvery = 10;           // steps
constexpr int64_t kShownSteps = 1000;        // of a progress bar over seconds
constexpr double kPerfect = 100;             // dB that stand for identical pictures in means
constexpr double kIndistinguishable = 58.9;  // dB: what rounding to 8 bits makes, 1/√12 of a step
constexpr double kGainOverFine = 2;          // dB at low resolution, see Refine
constexpr float kInvisible = 1.0f / 255;     // opacity below which a Gaussian can be left out

// The views to compare with, and others to see whether it helped.
struct Views {
  RefineTargets train, check;
  std::optional<double> input_psnr;
  double scene_scale = 1;
  RenderOptions render;
};

Result<Views> OpenPictures(const RefineInput& input, const RefineOptions& options, RenderOptions render) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(TrainingViews project, OpenProject(options.images, {.hold_out = options.hold_out}));
  if (!project.without_picture.empty()) {
    return Error{ErrorCode::kBadArgument,
                 Cat("--images ", options.images.string(), ": ", project.without_picture.size(), " of its ",
                     project.without_picture.size() + project.train.size() + project.held_out.size(),
                     " cameras have no picture, the first is ", Printable(project.without_picture.front()),
                     "; are these the pictures of these cameras? If so, take those out that have none")};
  }
  if (project.background) render.background = *project.background;
  PictureCache pictures(project.train, render.background);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PictureAgreement agreement, MeasureAgreement(input.cloud, render, pictures));
  LogInfo(Cat(project.train.size(), " views with pictures, ", project.held_out.size(),
              " held out; the splat's own renders agree with them to ", Fixed(agreement.psnr, 2), " dB"));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckAgreement(agreement, kLeastInputPsnr));
  const auto& check = project.held_out.empty() ? project.train : project.held_out;
  return Views{RefineTargets(std::move(pictures)),
               RefineTargets(PictureCache(Thinned(check, kCheckViews), render.background)), agreement.psnr,
               project.scene_scale, render};
}

Result<Views> OpenSplat(const RefineInput& input, const RefineOptions& options, RenderOptions render) {
  RefinePoses poses;
  if (input.cameras && !input.cameras->cameras.empty()) {
    if (input.cameras->background) render.background = *input.cameras->background;
    poses = RefinePosesAlong(input.cameras->cameras, options.between, kCheckViews);
    if (!poses.apart) {
      LogInfo("there is no place between these cameras: whether it helps is looked at where it is learned from");
    }
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(
        poses, RefinePosesAround(input.cloud, input.pixel_size, options.poses, kCheckViews, input.seed));
  }
  for (const Camera& camera : poses.check) {
    const std::string warning = NothingToSee(input.cloud, camera, render, std::nullopt);
    if (warning.empty()) continue;
    LogWarning(Cat(warning, " Refinement learns nothing from such views"));
    break;
  }
  const double scale = SceneScale(poses.train);
  const auto splat = std::make_shared<const GaussianCloud>(input.cloud);
  return Views{RefineTargets(splat, render, std::move(poses.train)),
               RefineTargets(splat, render, std::move(poses.check)), std::nullopt, scale, render};
}

// How well `cloud`, seen closer and averaged down, agrees with the views: mean PSNR.
Result<double> MeasureConsistency(const GaussianCloud& cloud, const RenderOptions& render, double upscale,
                                  const GaussianCloud& input, RefineTargets& targets) {
  ViewObjective objective;
  RefineTarget target;
  double sum = 0;
  const auto views = static_cast<int64_t>(targets.views().size());
  for (int64_t view = 0; view < views; ++view) {
    const Camera& camera = targets.views()[static_cast<size_t>(view)];
    const PixelBox window = ChooseWindow(camera, input, 0, view);  // the same for whatever is measured
    ANCHORSPLAT_RETURN_IF_ERROR(targets.Load(view, window, target));
    ANCHORSPLAT_RETURN_IF_ERROR(
        objective.Show({.render = render, .loss = {}, .pixel = AreaModel(upscale)}, cloud, Crop(camera, window)));
    Image shown = objective.rendered();
    Clamp01(shown);
    for (size_t i = 0; i < target.ignored.size(); ++i) {
      if (target.ignored[i] == 0) continue;
      for (int c = 0; c < 3; ++c) shown.channel(c)[i] = target.picture.channel(c)[i];
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double psnr, Psnr(shown, target.picture));
    sum += std::min(psnr, kPerfect);
  }
  return views > 0 ? sum / static_cast<double>(views) : 0;
}

// What every Gaussian has to do with what the views find wrong: Σ over up to kResidualViews views and their pixels of
// its weight in the pixel × how far the picture is off there, 0–1. That weight is how the picture depends on its
// colour.
Result<std::vector<double>> Residuals(const GaussianCloud& cloud, double upscale, Views& views) {
  const PixelModel one_ray{1, upscale};
  RenderOptions render = RaysOf(one_ray, views.render);
  render.gradient = true;

  Rasterizer rasterizer;
  RenderOutput output;
  RenderGradient off;
  CloudGradient weighted;
  RefineTarget target;
  std::vector<double> residuals(static_cast<size_t>(cloud.size()), 0.0);
  const auto stride = static_cast<size_t>(cloud.sh_stride());
  const auto count = static_cast<int64_t>(views.train.views().size());
  const int64_t looked_at = std::min(count, kResidualViews);
  for (int64_t i = 0; i < looked_at; ++i) {
    const int64_t view = i * count / looked_at;
    const Camera& camera = views.train.views()[static_cast<size_t>(view)];
    const PixelBox window = ChooseWindow(camera, cloud, 0, view);
    ANCHORSPLAT_RETURN_IF_ERROR(views.train.Load(view, window, target));
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(cloud, Crop(camera, window), render, output));
    off.color = output.color;
    for (size_t k = 0; k < off.color.pixels.size(); ++k) {
      off.color.pixels[k] = std::abs(off.color.pixels[k] - target.picture.pixels[k]);
    }
    for (size_t k = 0; k < target.ignored.size(); ++k) {
      for (int c = 0; c < 3 && target.ignored[k] != 0; ++c) off.color.channel(c)[k] = 0;
    }
    off.box = {0, 0, off.color.width, off.color.height};
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Backward(cloud, off, weighted));
    for (size_t k = 0; k < residuals.size(); ++k) {
      for (size_t c = 0; c < 3; ++c) residuals[k] += double{weighted.sh[k * stride + c]};
    }
  }
  return residuals;
}

// What a continuation must have in common with what it continues.
Result<std::string> Settings(const RefineInput& input, const RefineOptions& options, const Views& views) {
  nlohmann::json json = nlohmann::json::parse(ToJsonText(options));
  json["upscale"] = input.upscale;
  json["seed"] = input.seed;
  json["background"] = views.render.background;
  json["input"] = FingerprintOf(input.cloud);
  json["start"] = FingerprintOf(input.start);
  json["set of cameras"] = FingerprintOf(views.train.views(), views.scene_scale);
  if (!options.images.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(json["set of pictures"], FingerprintOfPictures(views.train.views()));
  }
  return json.dump();
}

// Steps until they are done, the time is over or the user stops it.
Status MakeSteps(Refiner& refiner, const RefineOptions& options, const RefineControl& control, RefineReport& report) {
  const auto begin = std::chrono::steady_clock::now();
  const auto done = [&] {
    if (!options.seconds) return static_cast<double>(refiner.state().step) / static_cast<double>(*options.steps);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() / *options.seconds;
  };
  const int64_t total = options.seconds ? kShownSteps : *options.steps;
  Progress progress("refine", total);
  int64_t shown = 0;
  double psnr = 0;
  for (double part = done(); part < 1; part = done()) {
    ANCHORSPLAT_RETURN_IF_ERROR(refiner.Step(part));
    if (refiner.state().step % kNoteEvery == 0) {
      const double last = refiner.LastPsnr();
      psnr = psnr == 0 ? last : 0.9 * psnr + 0.1 * last;  // single views differ by several dB
      const auto now = static_cast<int64_t>(std::min(1.0, done()) * static_cast<double>(total));
      progress.Advance(now - shown, Cat(Fixed(psnr, 2), " dB at low resolution, ",
                                        WithThousands(refiner.state().cloud.size()), " Gaussians"));
      shown = now;
    }
    report.interrupted = StopRequested() && done() < 1;
    if (report.interrupted) break;
  }
  return {};
}

// K as `max_gaussians` allows it.
void LimitCopies(int64_t gaussians, RefineOptions& options) {
  if (options.max_gaussians == 0) return;
  options.copies = static_cast<int>(
      std::clamp<int64_t>(options.max_gaussians / std::max<int64_t>(1, gaussians), 1, *options.copies));
  if (gaussians > options.max_gaussians) {
    LogWarning(Cat("there are ", WithThousands(gaussians), " Gaussians before any is split, more than ",
                   WithThousands(options.max_gaussians), ": none is split, and none is left out"));
  }
}

// Without what nobody sees and what is not finite.
GaussianCloud Pruned(GaussianCloud cloud, RefineReport& report) {
  const auto least = static_cast<float>(std::log(kInvisible / (1 - kInvisible)));
  std::vector<int64_t> kept;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (IsUsable(cloud, i) && cloud.opacity_logits[static_cast<size_t>(i)] >= least) kept.push_back(i);
  }
  const int64_t pruned = cloud.size() - static_cast<int64_t>(kept.size());
  if (pruned == 0 || kept.empty()) return cloud;
  report.pruned = pruned;
  return Subset(cloud, kept).value();
}

}  // namespace

Result<Refined> Refine(RefineInput input, const RefineOptions& given, const RefineControl& control) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(given));
  const auto begin = std::chrono::steady_clock::now();
  const bool pictures = !given.images.empty();
  if (!pictures && (given.exposure || given.robust)) {
    return Error{ErrorCode::kBadArgument, "exposure and robust are about photographs; they need --images"};
  }
  RefineOptions options = given;
  const bool gentle = !pictures && input.start_has_detail;
  if (!options.seconds) {
    options.steps = given.steps.value_or(pictures ? kStepsWithPictures : gentle ? kStepsGentle : kStepsWithout);
  }
  options.rate = given.rate.value_or(gentle ? kRateGentle : kRate);

  const RenderOptions render = OptionsFor(input.cloud);
  ANCHORSPLAT_ASSIGN_OR_RETURN(Views views,
                               pictures ? OpenPictures(input, options, render) : OpenSplat(input, options, render));
  RefineReport report;
  report.views = static_cast<int64_t>(views.train.views().size());
  report.input_psnr = views.input_psnr;
  ANCHORSPLAT_ASSIGN_OR_RETURN(report.before,
                               MeasureConsistency(input.start, views.render, input.upscale, input.cloud, views.check));

  // A splat that was trained on larger pictures than these, or without dilation, knows details that these do not show;
  // learning them by heart costs it those. Measured with fits to views four times as large (docs/refine.md): one that
  // gained 1.5 dB at low resolution lost 0.5 dB at high resolution; one that gained 2.6 dB won there, too.
  bool fine = pictures && render.mode == RenderMode::kAntialiased;
  if (pictures) {
    // A splat that has lost no width is spoiled by what gives it back: the pictures tell.
    ANCHORSPLAT_ASSIGN_OR_RETURN(
        const double as_it_is, MeasureConsistency(input.cloud, views.render, input.upscale, input.cloud, views.check));
    if (as_it_is > report.before) {
      LogInfo("the splat agrees better with the pictures as it is: the refinement begins with that");
      report.before = as_it_is;
      input.start = input.cloud;
      fine = true;
    }
  }
  if (!pictures && report.before >= kIndistinguishable) {
    LogInfo("the start shows what the splat does already, and is kept");
    report.after = report.before;
    report.kept_start = true;
    return Refined{std::move(input.start), report};
  }

  if (!given.copies && gentle) {
    options.copies = 1;
  } else if (!given.copies) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewDensity density,
                                 MeasureDensity(input.cloud, views.render, views.train.views()));
    options.copies = ChooseCopies(density, input.upscale, pictures ? kCopiesWithPictures : kCopiesWithout,
                                  input.cloud.size(), input.start.size());
  }
  LimitCopies(input.start.size(), options);
  report.copies = *options.copies;

  std::string settings;
  if (!control.checkpoint.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(settings, Settings(input, options, views));
  }
  FitState state;
  if (control.resume && Exists(control.checkpoint)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(state, ReadFitCheckpoint(control.checkpoint, settings));
    report.resumed_at = state.step;
    LogInfo(Cat("going on at step ", WithThousands(state.step), " of ", control.checkpoint.string()));
  } else {
    std::vector<int> each;
    // Without pictures the differences are what the fit itself got wrong; copies do not help there.
    if (pictures && *options.copies > 1) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> residuals, Residuals(input.start, input.upscale, views));
      each = CopiesByResidual(residuals, *options.copies);
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(
        GaussianCloud split,
        SplitGaussians(input.start, {.copies = *options.copies, .seed = input.seed, .each = each}));
    state = Fitter::Fresh(std::move(split));
  }
  const RefineProblem problem{views.render, input.upscale, views.scene_scale, input.seed};
  ANCHORSPLAT_ASSIGN_OR_RETURN(Refiner refiner,
                               Refiner::Begin(options, problem, std::move(views.train), std::move(state)));
  ANCHORSPLAT_RETURN_IF_ERROR(MakeSteps(refiner, options, control, report));
  report.steps = refiner.state().step;
  report.times = refiner.times();
  if (report.interrupted && !control.checkpoint.empty() && !options.seconds) {
    Leave(refiner.state(), control.outputs);
    const Status written = WriteFitCheckpoint(control.checkpoint, refiner.state(), settings);
    if (!written.ok()) LogWarning(Cat("there is nothing to resume from: ", written.error().message));
  }

  GaussianCloud result = Pruned(std::move(refiner.state().cloud), report);
  result.render_mode = input.cloud.render_mode;
  ANCHORSPLAT_ASSIGN_OR_RETURN(report.after,
                               MeasureConsistency(result, views.render, input.upscale, input.cloud, views.check));
  if (!(report.after > report.before + (fine ? kGainOverFine : 0))) {
    LogInfo(report.after > report.before
                ? Cat("the splat had lost no width, and the pictures gain it little (", Fixed(report.before, 2), " to ",
                      Fixed(report.after, 2), " dB at their resolution): it knows more than they show, and is kept")
                : "the start agreed with the views as well as the result does, and is kept");
    report.kept_start = true;
    report.pruned = 0;
    report.after = report.before;
    result = std::move(input.start);
  }
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return Refined{std::move(result), report};
}

}  // namespace anchorsplat
