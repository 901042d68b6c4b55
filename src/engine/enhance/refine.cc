#include "enhance/refine.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/file_system.h"
#include "core/fingerprint.h"
#include "core/log.h"
#include "core/run_context.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "enhance/refine_plan.h"
#include "enhance/refine_views.h"
#include "enhance/refiner.h"
#include "enhance/split_gaussians.h"
#include "fit/fingerprints.h"
#include "io/mapped_file.h"

namespace anchorsplat {

namespace {

constexpr int64_t kNoteEvery = 10;        // steps
constexpr int64_t kShownSteps = 1000;     // resolution of a time-based progress bar
constexpr double kAboutTheSame = 0.1;     // dB
constexpr float kInvisible = 1.0f / 255;  // Gaussians below this opacity are pruned

// Settings that must match to resume a run.
Result<std::string> Settings(const RefineInput& input, const GaussianCloud& start, const RefineOptions& options,
                             const RefineViews& views) {
  nlohmann::json json = nlohmann::json::parse(ToJsonText(options));
  json["upscale"] = input.upscale;
  json["seed"] = input.seed;
  if (input.fixed > 0) json["fixed"] = input.fixed;
  json["background"] = views.render.background;
  if (IsCompensated(views.render.mode)) json["mode"] = NameOf(views.render.mode);
  json["input"] = FingerprintOf(input.cloud);
  json["start"] = FingerprintOf(start);
  json["set of cameras"] = FingerprintOf(views.train.views(), views.scene_scale);
  if (!options.images.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(json["set of pictures"], FingerprintOfPictures(views.train.views()));
  }
  if (!options.enlarge_with.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const MappedFile network, MappedFile::Open(options.enlarge_with));
    Fingerprint print;
    print.Add(network.bytes());
    json["network that enlarges"] = print.text();
  }
  return json.dump();
}

// The last `rows` rows.
GaussianCloud Last(const GaussianCloud& cloud, int64_t rows) {
  std::vector<int64_t> last(static_cast<size_t>(rows));
  std::iota(last.begin(), last.end(), cloud.size() - rows);
  return Subset(cloud, last).value();
}

GaussianCloud WithoutLast(GaussianCloud cloud, int64_t rows) {
  if (rows > 0) cloud.Resize(cloud.size() - rows, cloud.sh_degree);
  return cloud;
}

// Writes and reads a run's checkpoint, if it has one.
class RefineCheckpoint {
 public:
  // Time-limited runs have none.
  RefineCheckpoint(const RefineControl& control, bool for_seconds, std::string settings)
      : path_(for_seconds ? std::filesystem::path() : control.checkpoint),
        every_(control.checkpoint_every),
        settings_(std::move(settings)) {}

  bool kept() const { return !path_.empty(); }
  bool IsDue(int64_t step) const { return kept() && every_ > 0 && step % every_ == 0; }
  // A failed write is only a warning.
  void Write(const FitState& state, const char* otherwise) const {
    const Status written = WriteFitCheckpoint(path_, state, settings_);
    if (!written.ok()) LogWarning(Cat(otherwise, ": ", written.error().message));
  }

 private:
  std::filesystem::path path_;
  int64_t every_;
  std::string settings_;
};

// Runs steps until they are done, time is up, or the user stops the run.
Status MakeSteps(Refiner& refiner, const RefineOptions& options, const RefineCheckpoint& checkpoint,
                 RefineReport& report) {
  const Stopwatch watch;
  const auto done = [&] {
    if (!options.seconds) return static_cast<double>(refiner.step()) / static_cast<double>(*options.steps);
    return watch.Total() / *options.seconds;
  };
  const int64_t total = options.seconds ? kShownSteps : *options.steps;
  Progress progress("refine", total);
  int64_t shown = 0;
  double psnr = 0;
  std::string note;
  double part = done();
  while (part < 1) {
    ANCHORSPLAT_RETURN_IF_ERROR(refiner.Step(part));
    if (refiner.step() % kNoteEvery == 0) {
      const double last = refiner.LastPsnr();
      if (last > 0) psnr = psnr == 0 ? last : 0.9 * psnr + 0.1 * last;  // smoothed: views differ by several dB
      const auto now = static_cast<int64_t>(std::min(1.0, done()) * static_cast<double>(total));
      note = Cat(Fixed(psnr, 2), " dB at low resolution, ", WithThousands(refiner.size()), " Gaussians");
      progress.Advance(std::max<int64_t>(0, now - shown), note);
      shown = std::max(shown, now);
    }
    report.interrupted = StopRequested() && done() < 1;
    if (report.interrupted) return {};
    if (checkpoint.IsDue(refiner.step()) && done() < 1) {
      checkpoint.Write(refiner.state(), "no new checkpoint");
    }
    part = done();
    // Steps lost with a GPU are repeated while there is time.
    if (part >= 1 && !refiner.MoveToHost()) part = done();
  }
  if (shown < total) progress.Advance(total - shown, note);
  return {};
}

// Removes invisible and non-finite Gaussians, except among the last `fixed`.
GaussianCloud Pruned(GaussianCloud cloud, int64_t fixed, RefineReport& report) {
  const auto least = static_cast<float>(std::log(kInvisible / (1 - kInvisible)));
  std::vector<int64_t> kept;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    const bool seen = IsUsable(cloud, i) && cloud.opacity_logits[static_cast<size_t>(i)] >= least;
    if (seen || i >= cloud.size() - fixed) kept.push_back(i);
  }
  const int64_t pruned = cloud.size() - static_cast<int64_t>(kept.size());
  if (pruned == 0 || kept.empty()) return cloud;
  report.pruned = pruned;
  return Subset(cloud, kept).value();
}

// Runs the iterations from the start or a checkpoint until done or stopped.
Result<GaussianCloud> RunRefinement(const RefineInput& input, const GaussianCloud& start, bool resumes, double upscale,
                                    const RefineControl& control, RefineViews& views, RefineReport& report) {
  RefinePlan& plan = report.plan;
  std::string settings;
  if (!control.checkpoint.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(settings, Settings(input, start, plan.options, views));
  }
  FitState state;
  if (resumes) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(state, ReadFitCheckpoint(control.checkpoint, settings));
    report.resumed_at = state.step;
    LogInfo(Cat("resuming at step ", WithThousands(state.step), " from ", control.checkpoint.string()));
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(
        GaussianCloud split,
        SplitGaussians(start, {.copies = *plan.options.copies, .seed = input.seed, .each = plan.each}));
    plan.each = std::vector<int>();
    state = Fitter::Fresh(std::move(split));
  }
  const RefineCheckpoint checkpoint(control, plan.options.seconds.has_value(), settings);
  const RefineProblem problem{views.render, upscale, views.scene_scale, input.seed, Last(start, input.fixed)};
  ANCHORSPLAT_ASSIGN_OR_RETURN(Refiner refiner,
                               Refiner::Begin(plan.options, problem, std::move(views.train), std::move(state)));
  ANCHORSPLAT_RETURN_IF_ERROR(MakeSteps(refiner, plan.options, checkpoint, report));
  report.steps = refiner.step();
  report.times = refiner.times();
  if (report.interrupted && checkpoint.kept()) {
    Leave(refiner.state(), control.outputs);
    checkpoint.Write(refiner.state(), "no checkpoint to resume from");
  }
  GaussianCloud result = Pruned(std::move(refiner.state().cloud), input.fixed, report);
  result.render_mode = input.cloud.render_mode;
  result.comments = start.comments;  // checkpoints have neither
  return result;
}

// Whether the result is better than the start, with the reason if not. On held-out photographs PSNR mostly reflects
// light and poses, so at about equal PSNR, SSIM decides.
bool IsWorthIt(const RefinePlan& plan, const Consistency& after, bool interrupted) {
  const Consistency& before = plan.start;
  if (after.psnr > before.psnr + plan.least_gain) return true;
  if (!plan.options.images.empty() && plan.least_gain == 0 && after.ssim > before.ssim &&
      after.psnr > before.psnr - kAboutTheSame) {
    return true;
  }
  const std::string numbers = Cat(Fixed(before.psnr, 2), " dB and SSIM ", Fixed(before.ssim, 4), " before, ",
                                  Fixed(after.psnr, 2), " and ", Fixed(after.ssim, 4), " after, at low resolution");
  LogInfo(interrupted ? Cat("stopped early: keeping the start, as refinement is no better so far (", numbers, ")")
          : after.psnr > before.psnr
              ? Cat("refinement discarded: the splat holds more detail than the pictures, and gained little (", numbers,
                    ")")
              : Cat("refinement discarded: the start matches the views at least as well (", numbers, ")"));
  return false;
}

Refined KeptStart(GaussianCloud start, RefineReport report) {
  report.kept_start = true;
  report.pruned = 0;
  report.after = report.before;
  return {std::move(start), std::move(report)};
}

}  // namespace

Result<Refined> Refine(RefineInput input, const RefineOptions& given, const RefineControl& control) {
  const Stopwatch watch;
  RefineReport report;
  const auto timed = [&](Refined refined) {
    refined.report.seconds = watch.Total();
    return refined;
  };

  ANCHORSPLAT_ASSIGN_OR_RETURN(const RefineOptions options, ChooseRefineOptions(input, given));
  const int64_t left_out = KeepToBudget(options.max_gaussians, input.fixed, input.start);
  // A copy of the input reduced to the budget. Only pictures can tell whether to start from it.
  std::optional<GaussianCloud> fewer;
  const int64_t changing = input.cloud.size() - input.fixed;
  if (!options.images.empty() && options.max_gaussians > 0 && changing > options.max_gaussians) {
    fewer = input.cloud;
    KeepToBudget(options.max_gaussians, input.fixed, *fewer);
  }
  const GaussianCloud& as_it_is = fewer ? *fewer : input.cloud;
  if (left_out > 0) {
    LogWarning(Cat("--max-gaussians ", WithThousands(options.max_gaussians), ": dropped the ", WithThousands(left_out),
                   " Gaussians with the least opacity × size"));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(RefineViews views, OpenRefineViews(input, options));
  if (const int times = views.times_larger; times > 1) {
    LogInfo(Cat("the splat was fitted to pictures at 1/", times, " of this size; using the detail of these"));
    // They show part of the closer view, or all of it.
    input.upscale = std::max(1.0, input.upscale / times);
    if (options.enlarged) input.upscale = std::round(input.upscale);
  }
  const bool resumes = control.resume && Exists(control.checkpoint);
  ANCHORSPLAT_ASSIGN_OR_RETURN(report.plan, PlanRefinement(input, as_it_is, options, resumes, views));
  const RefinePlan& plan = report.plan;
  if (!plan.why.empty()) LogInfo(plan.why);
  report.views = static_cast<int64_t>(views.train.views().size());
  report.input_psnr = views.input_psnr;
  report.before = plan.start.psnr;
  GaussianCloud start = plan.from_input ? as_it_is : std::move(input.start);
  if (plan.nothing_to_do) return timed(KeptStart(WithoutLast(std::move(start), input.fixed), std::move(report)));
  report.copies = *plan.options.copies;
  double upscale = input.upscale;
  if (plan.options.enlarged) {
    ANCHORSPLAT_RETURN_IF_ERROR(EnlargeViews(plan.options.enlarge_with, static_cast<int>(upscale), start, views));
    upscale = 1;
    ANCHORSPLAT_ASSIGN_OR_RETURN(report.plan.start,
                                 MeasureConsistency(start, upscale, input.cloud, plan.options, views));
    report.plan.least_gain = 0;  // the enlarged views include what the splat knows beyond the pictures
    report.before = plan.start.psnr;
  }

  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud result,
                               RunRefinement(input, start, resumes, upscale, control, views, report));

  ANCHORSPLAT_ASSIGN_OR_RETURN(const Consistency after,
                               MeasureConsistency(result, upscale, input.cloud, plan.options, views));
  report.after = after.psnr;
  if (!IsWorthIt(plan, after, report.interrupted)) {
    return timed(KeptStart(WithoutLast(std::move(start), input.fixed), std::move(report)));
  }
  return timed({WithoutLast(std::move(result), input.fixed), std::move(report)});
}

}  // namespace anchorsplat
