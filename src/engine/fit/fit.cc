#include "fit/fit.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "core/activations.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/run_context.h"
#include "core/splat_comments.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "core/world_up.h"
#include "fit/fingerprints.h"
#include "fit/picture_cache.h"
#include "render/constants.h"

namespace anchorsplat {

namespace {

constexpr int64_t kNoteEvery = 20;  // steps; a step's PSNR costs about as much as Adam on one array

// Settings that must match to resume: options, views, start.
Result<std::string> Settings(const FitOptions& options, const TrainingViews& views, const GaussianCloud& initial) {
  nlohmann::json json = nlohmann::json::parse(ToJsonText(options));
  json["set of cameras"] = FingerprintOf(views.train, views.scene_scale);
  ANCHORSPLAT_ASSIGN_OR_RETURN(json["set of pictures"], FingerprintOfPictures(views.train));
  json["start"] = FingerprintOf(initial);
  return json.dump();
}

std::string Note(double psnr, int64_t gaussians) {
  return Cat(Fixed(psnr, 2), " dB, ", WithThousands(gaussians), " Gaussians");
}

// Running mean, because single views differ by several dB.
void Follow(double& mean, double value) { mean = mean == 0 ? value : 0.9 * mean + 0.1 * value; }

// The checkpoint of a fit: its latest step, and the error if a newer one could not be written.
class KeptState {
 public:
  KeptState(const std::filesystem::path& path, std::string settings) : path_(path), settings_(std::move(settings)) {}

  std::optional<int64_t> step() const { return step_; }
  void FoundAt(int64_t step) { step_ = step; }

  // A failed write is only a warning; the previous checkpoint, if any, stays.
  void Write(const FitState& state) {
    if (path_.empty() || step_ == state.step) return;
    const Status written = WriteFitCheckpoint(path_, state, settings_);
    if (written.ok()) {
      step_ = state.step;
    } else if (!warned_) {
      LogWarning(Cat("no new checkpoint: ", written.error().message));
    }
    warned_ = !written.ok();
  }

  Error NotedIn(Error error) const {
    if (step_) error.message += Cat("; the state after step ", WithThousands(*step_), " is saved in ", path_.string());
    return error;
  }

 private:
  std::filesystem::path path_;
  std::string settings_;
  std::optional<int64_t> step_;
  bool warned_ = false;  // warns once per failure
};

// Runs the remaining steps, or until the user stops the fit.
Status MakeSteps(Fitter& fitter, const FitControl& control, KeptState& kept, FitReport& report) {
  Progress progress("fit", fitter.options().steps);
  int64_t shown = fitter.step();
  progress.Advance(shown);
  double psnr = 0;
  while (!fitter.done()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const FitStep step, fitter.Step());
    report.duplicated += step.change.duplicated;
    report.split += step.change.split;
    report.pruned += step.change.pruned;
    report.relocated += step.change.relocated;
    report.added += step.change.added;
    const int64_t done = fitter.step();
    if (done % kNoteEvery == 0 || fitter.done()) {
      Follow(psnr, fitter.LastPsnr());
      // After losing a GPU some steps are repeated.
      progress.Advance(std::max<int64_t>(0, done - shown), Note(psnr, fitter.size()));
      shown = std::max(shown, done);
    }
    if (control.observe) control.observe(fitter);
    report.interrupted = StopRequested() && !fitter.done();
    const bool due = control.checkpoint_every > 0 && done % control.checkpoint_every == 0 && !fitter.done();
    if (report.interrupted) fitter.Leave(control.outputs);
    if (due || report.interrupted) kept.Write(fitter.state());
    if (report.interrupted) break;
  }
  report.loss = fitter.LastLoss();
  return {};
}

// Fails if masks leave nothing of any picture. Stops at the first unmasked pixel.
Status CheckSomethingCounts(PictureCache& pictures) {
  const std::vector<Camera>& views = pictures.views();
  if (std::ranges::any_of(views, [](const Camera& view) { return view.photograph.mask.empty(); })) return {};
  Image picture;
  Buffer<uint8_t> ignored;
  for (int64_t view = 0; view < std::ssize(views); ++view) {
    ANCHORSPLAT_RETURN_IF_ERROR(pictures.Load(view, picture, ignored));
    if (ignored.empty() || std::ranges::find(ignored, 0) != ignored.end()) return {};
  }
  return Error{ErrorCode::kBadArgument,
               Cat("the masks hide every pixel of all ", views.size(), " pictures, such as ",
                   views.front().photograph.mask.string(), "; black hides a pixel, white uses it")};
}

void WarnUnlessNoted(const Status& noted) {
  if (!noted.ok())
    LogWarning(Cat("--resume will need -w to replace the files written so far: ", noted.error().message));
}

Status MeasureQualities(const TrainingViews& views, const FitOptions& options, Fitter& fitter, Fitted& out) {
  const PixelModel pixel = PixelModelAt(options, options.steps);
  const RenderOptions& render = options.objective.render;
  ANCHORSPLAT_ASSIGN_OR_RETURN(out.report.train, MeasureQuality(out.cloud, render, fitter.pictures(), pixel));
  PictureCache held_out(views.held_out, render.background, 0);
  ANCHORSPLAT_ASSIGN_OR_RETURN(out.report.held_out, MeasureQuality(out.cloud, render, held_out, pixel));
  return {};
}

// After the steps: delivers the result, then measures its quality.
Status Finish(const TrainingViews& views, const FitOptions& options, const FitControl& control, Fitter& fitter,
              KeptState& kept, Fitted& out) {
  if (control.deliver) ANCHORSPLAT_RETURN_IF_ERROR(control.deliver(out));
  if (out.report.interrupted) return {};
  const Status measured = MeasureQualities(views, options, fitter, out);
  if (measured.ok() || measured.error().code != ErrorCode::kInterrupted) return measured;
  // Saved with all steps done: resuming then only measures.
  out.report.interrupted = true;
  out.report.train = out.report.held_out = {};
  fitter.Leave(control.outputs);
  kept.Write(fitter.state());
  out.report.kept_step = kept.step();
  return {};
}

// Warns if all Gaussians were pruned or faded away.
void WarnWhereNothingIsLeft(const Fitted& fitted) {
  constexpr double kNextToNothing = 0.01;
  const auto shows =
      std::ranges::count_if(fitted.cloud.opacity_logits, [](float logit) { return Sigmoid(logit) >= kMinAlpha; });
  if (static_cast<double>(shows) >= kNextToNothing * static_cast<double>(fitted.report.gaussians_in)) return;
  LogWarning(Cat("the fit failed: only ", WithThousands(shows), " of ", WithThousands(fitted.cloud.size()),
                 " Gaussians are visible (", WithThousands(fitted.report.gaussians_in),
                 " at the start). Try --init view or another --init-extent"));
}

}  // namespace

Result<Fitted> Fit(const TrainingViews& views, GaussianCloud initial, const FitOptions& options,
                   const FitControl& control) {
  std::string settings;
  if (!control.checkpoint.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(settings, Settings(options, views, initial));
  }
  KeptState kept(control.checkpoint, settings);
  FitReport report;
  report.gaussians_in = initial.size();
  report.scene_scale = views.scene_scale;
  FitState state;
  bool unfit = false;  // the existing checkpoint is not this fit's
  if (control.resume && Exists(control.checkpoint)) {
    auto earlier = ReadFitCheckpoint(control.checkpoint, settings);
    if (earlier.ok()) {
      state = *std::move(earlier);
      report.resumed_at = state.step;
      kept.FoundAt(state.step);
      LogInfo(Cat("resuming at step ", WithThousands(state.step), " from ", control.checkpoint.string()));
    } else {
      const ErrorCode code = earlier.error().code;
      unfit = control.anew_if_unfit && (code == ErrorCode::kBadFile || code == ErrorCode::kBadArgument);
      if (!unfit) return earlier.error();
      LogWarning(Cat("starting over: ", earlier.error().message));
    }
  }
  if (report.resumed_at == 0) state = Fitter::Fresh(std::move(initial));

  ANCHORSPLAT_ASSIGN_OR_RETURN(Fitter fitter,
                               Fitter::Begin(options, PictureCache(views.train, options.objective.render.background),
                                             views.scene_scale, std::move(state)));
  // Another fit's checkpoint must not be replaced because of an error, such as a damaged picture.
  const auto failed = [&](const Error& error) {
    const FitState& now = fitter.state();
    if (!now.cloud.empty() && now.step > 0 && !(unfit && !kept.step())) kept.Write(now);
    return kept.NotedIn(error);
  };
  if (const Status counts = CheckSomethingCounts(fitter.pictures()); !counts.ok()) return failed(counts.error());
  Stopwatch watch;
  if (const Status made = MakeSteps(fitter, control, kept, report); !made.ok()) return failed(made.error());
  report.seconds = watch.Lap();
  report.steps = fitter.step();
  report.times = fitter.times();
  if (report.interrupted) report.kept_step = kept.step();

  Fitted out{fitter.UsableCloud(), report};
  out.cloud.render_mode = options.objective.render.mode;
  out.cloud.origin = views.origin;
  if (options.pixel.upscale > 1) out.cloud.comments.push_back(PixelAreaComment(options.pixel.upscale));
  if (const auto& background = options.objective.render.background; background != std::array<float, 3>{}) {
    out.cloud.comments.push_back(BackgroundComment(background));
  }
  if (const auto up = WorldUp(views.train)) out.cloud.comments.push_back(UpComment(*up));
  out.report.gaussians_out = out.cloud.size();
  WarnWhereNothingIsLeft(out);
  if (const Status finished = Finish(views, options, control, fitter, kept, out); !finished.ok()) {
    return failed(finished.error());
  }
  if (!out.report.interrupted && !control.checkpoint.empty()) RemoveFitCheckpoint(control.checkpoint);
  if (out.report.interrupted && kept.step() == out.report.steps) WarnUnlessNoted(NoteFilesLeft(control.checkpoint));
  return out;
}

}  // namespace anchorsplat
