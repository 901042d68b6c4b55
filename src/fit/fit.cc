#include "fit/fit.h"

#include <system_error>
#include <utility>

#include "core/fingerprint.h"
#include "core/log.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "fit/picture_cache.h"

namespace anchorsplat {

namespace {

constexpr int64_t kNoteEvery = 20;  // steps: the PSNR of a step costs about as much as one of Adam's arrays

// What a continuation must have in common with the fit that it continues: options, views, start.
std::string Settings(const FitOptions& options, const TrainingViews& views, const GaussianCloud& initial) {
  std::string names;
  for (const Camera& camera : views.train) {
    names += Cat(camera.name, ' ', camera.intrinsics.width, 'x', camera.intrinsics.height, '\n');
  }
  std::string text = ToJsonText(options);
  text.pop_back();
  Fingerprint print;
  print.Add(names);
  return text + Cat(",\"views\":", views.train.size(), ",\"view_names\":\"", print.text(),
                    "\",\"initial_gaussians\":", initial.size(), "}");
}

std::string Note(double psnr, int64_t gaussians) {
  return Cat(Fixed(psnr, 2), " dB, ", WithThousands(gaussians), " Gaussians");
}

// A mean that follows: single views differ by several dB.
void Follow(double& mean, double value) { mean = mean == 0 ? value : 0.9 * mean + 0.1 * value; }

bool Exists(const std::filesystem::path& path) {
  std::error_code ignored;
  return !path.empty() && std::filesystem::exists(path, ignored);
}

// All steps that are left, or as many as there are before the user stops it.
Status MakeSteps(Fitter& fitter, const FitControl& control, const std::string& settings, FitReport& report) {
  Progress progress("fit", fitter.options().steps);
  int64_t shown = fitter.state().step;
  progress.Advance(shown);
  double psnr = 0;
  while (!fitter.done()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const FitStep step, fitter.Step());
    report.loss = step.loss.loss;
    report.duplicated += step.change.duplicated;
    report.split += step.change.split;
    report.pruned += step.change.pruned;
    const int64_t done = fitter.state().step;
    if (done % kNoteEvery == 0 || fitter.done()) {
      Follow(psnr, fitter.LastPsnr());
      progress.Advance(done - shown, Note(psnr, fitter.state().cloud.size()));
      shown = done;
    }
    if (control.observe) control.observe(fitter);
    report.interrupted = control.stop != nullptr && control.stop->load() && !fitter.done();
    const bool due = control.checkpoint_every > 0 && done % control.checkpoint_every == 0 && !fitter.done();
    if (!control.checkpoint.empty() && (due || report.interrupted)) {
      ANCHORSPLAT_RETURN_IF_ERROR(WriteFitCheckpoint(control.checkpoint, fitter.state(), settings));
    }
    if (report.interrupted) break;
  }
  return {};
}

}  // namespace

Result<Fitted> Fit(const TrainingViews& views, GaussianCloud initial, const FitOptions& options,
                   const FitControl& control) {
  const std::string settings = Settings(options, views, initial);
  FitReport report;
  report.gaussians_in = initial.size();
  report.scene_scale = views.scene_scale;
  FitState state;
  if (control.resume && Exists(control.checkpoint)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(state, ReadFitCheckpoint(control.checkpoint, settings));
    report.resumed_at = state.step;
    LogInfo(Cat("going on at step ", WithThousands(state.step), " of ", control.checkpoint.string()));
  } else {
    state = Fitter::Fresh(std::move(initial));
  }

  const auto& background = options.objective.render.background;
  ANCHORSPLAT_ASSIGN_OR_RETURN(Fitter fitter, Fitter::Begin(options, PictureCache(views.train, background),
                                                            views.scene_scale, std::move(state)));
  Stopwatch watch;
  ANCHORSPLAT_RETURN_IF_ERROR(MakeSteps(fitter, control, settings, report));
  report.seconds = watch.Lap();
  report.steps = fitter.state().step;
  report.times = fitter.times();

  Fitted out{fitter.TakeCloud(), report};
  out.cloud.render_mode = options.objective.render.mode;
  if (options.pixel.upscale > 1) out.cloud.comments.push_back(PixelAreaComment(options.pixel.upscale));
  out.report.gaussians_out = out.cloud.size();
  if (out.report.interrupted) return out;
  const PixelModel pixel = PixelModelAt(options, options.steps);
  ANCHORSPLAT_ASSIGN_OR_RETURN(out.report.train,
                               MeasureQuality(out.cloud, options.objective.render, fitter.pictures(), pixel));
  PictureCache held_out(views.held_out, background, 0);
  ANCHORSPLAT_ASSIGN_OR_RETURN(out.report.held_out,
                               MeasureQuality(out.cloud, options.objective.render, held_out, pixel));
  std::error_code ignored;
  if (Exists(control.checkpoint) && !control.keep_checkpoint) std::filesystem::remove(control.checkpoint, ignored);
  return out;
}

}  // namespace anchorsplat
