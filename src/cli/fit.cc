#include "fit/fit.h"

#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "cli/clean_output.h"
#include "cli/stop_signal.h"
#include "cli/verb.h"
#include "core/log.h"
#include "core/text.h"
#include "fit/checkpoint_guard.h"
#include "fit/initial_cloud.h"
#include "fit/training_views.h"
#include "formats/cloud_io.h"
#include "formats/cloud_output.h"
#include "formats/gsplat_checkpoint/gsplat_checkpoint_writer.h"
#include "formats/opened_splat.h"
#include "formats/registry.h"
#include "formats/write_losses.h"
#include "io/atomic_file.h"
#include "io/input_record.h"
#include "request/choice.h"
#include "request/fit_flags.h"
#include "request/parse.h"
#include "request/words.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// All that a fit writes.
std::vector<fs::path> OutputFiles(const FitFlags& flags) {
  std::vector<fs::path> files = FilesOfCloud(flags.output, flags.standard.objective.render.sh_degree);
  if (!flags.gsplat_checkpoint.empty()) files.emplace_back(flags.gsplat_checkpoint);
  return files;
}

// What can be known to fail before hours of work, once the inputs are known.
Status CheckOutputs(const FitFlags& flags, const FitControl& control, bool overwrite) {
  const SplatFormat* format = FormatOfExtension(flags.output);
  if (format == nullptr || format->write == nullptr) {
    return Error{ErrorCode::kBadArgument, Cat("-o ", flags.output, ": not a format that is written (.ply is)")};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCheckpoint(control.checkpoint, control.outputs, flags.resume, overwrite));
  // A continued fit replaces what its interruption left.
  if (flags.resume) RecordWhatWasLeft(control.checkpoint, control.outputs);
  for (const fs::path& path : control.outputs) {
    ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(path, overwrite));
    if (overwrite) RecordOwnFile(path);  // so that an interruption leaves it under this name
  }
  return {};
}

// Where the Gaussians begin, and in words.
struct Start {
  InitialPoints points;
  std::string origin;
};

Result<Start> ChooseStart(const FitFlags& flags, const TrainingViews& views, uint64_t seed) {
  if (!flags.init_splat.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud cloud, ReadCloud(flags.init_splat));
    return Start{Thinned(PointsOf(cloud), flags.init_points), "splat"};
  }
  if (flags.init == FitInit::kPoints && views.points.size() == 0) {
    return Error{ErrorCode::kBadArgument, Cat(flags.project, ": --init points, but the project has none")};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(InitialPoints points, InitialPointsOf(flags.init, views, flags.init_points, seed));
  return Start{std::move(points), NameOf(flags.init, views)};
}

nlohmann::json ToJson(const ViewQuality& quality) {
  return {{"views", quality.views}, {"psnr", quality.psnr}, {"ssim", quality.ssim}};
}

nlohmann::json ToJson(const FitFlags& flags, const std::string& origin, const FitOptions& options, const FitReport& r) {
  const auto& t = r.times;
  nlohmann::json json = {
      {"project", flags.project},
      {"output", flags.output},
      {"steps", r.steps},
      {"resumed_at", r.resumed_at},
      {"initial_points", origin},
      {"settings", nlohmann::json::parse(ToJsonText(options))},
      {"scene_scale", r.scene_scale},
      {"gaussians",
       {{"in", r.gaussians_in},
        {"out", r.gaussians_out},
        {"duplicated", r.duplicated},
        {"split", r.split},
        {"pruned", r.pruned},
        {"relocated", r.relocated},
        {"added", r.added}}},
      {"loss", r.loss},
      {"seconds", r.seconds},
      {"stages",
       {{"load", t.load},
        {"render", t.objective.render},
        {"loss", t.objective.loss},
        {"backward", t.objective.backward},
        {"adam", t.adam},
        {"densify", t.densify}}},
  };
  json["train"] = ToJson(r.train);
  json["held_out"] = r.held_out.views > 0 ? ToJson(r.held_out) : nlohmann::json();
  return json;
}

void PrintReport(const FitFlags& flags, const FitReport& r) {
  std::cout << OneLine(flags.output) << ": " << WithThousands(r.gaussians_out) << " Gaussians after "
            << WithThousands(r.steps) << " steps in " << HumanSeconds(r.seconds)
            << "\n  training views: " << r.train.views << ", " << Fixed(r.train.psnr, 2) << " dB, SSIM "
            << Fixed(r.train.ssim, 4) << "\n";
  if (r.held_out.views > 0) {
    std::cout << "  held-out views: " << r.held_out.views << ", " << Fixed(r.held_out.psnr, 2) << " dB, SSIM "
              << Fixed(r.held_out.ssim, 4) << "\n";
  }
}

// Each file that can be written is, whatever becomes of the other one.
Status WriteResults(const FitFlags& flags, const Fitted& fitted, bool overwrite) {
  const Status splat = WriteCloudOrKeep(flags.output, fitted.cloud, {.overwrite = overwrite});
  if (flags.gsplat_checkpoint.empty()) return splat;
  const Status checkpoint = WriteOrKeep(flags.gsplat_checkpoint, overwrite, [&](const fs::path& path, bool replace) {
    return WriteGsplatCheckpoint(path, fitted.cloud, std::max<int64_t>(0, fitted.report.steps - 1),
                                 {.overwrite = replace});
  });
  if (checkpoint.ok()) {
    for (const std::string& loss : WriteLosses(*FormatOfName("pt"), fitted.cloud)) {
      LogWarning(Cat(flags.gsplat_checkpoint, ": ", loss));
    }
  }
  if (splat.ok() || checkpoint.ok()) return splat.ok() ? checkpoint : splat;
  return Error{splat.error().code, Cat(splat.error().message, "; ", checkpoint.error().message)};
}

Error Interrupted(const FitFlags& flags, const FitReport& report, int64_t steps, const fs::path& checkpoint) {
  std::string after = "there is nothing to resume from";
  if (report.kept_step == report.steps) {
    after = Cat("--resume goes on from ", checkpoint.string());
  } else if (report.kept_step) {
    after = Cat("--resume goes on at step ", WithThousands(*report.kept_step), " from ", checkpoint.string());
  }
  return {ErrorCode::kInterrupted, Cat("stopped after ", WithThousands(report.steps), " of ", WithThousands(steps),
                                       " steps; ", flags.output, " is what there was, ", after)};
}

Status RunFit(const FitFlags& flags, const SharedFlags& shared) {
  FitControl control;
  control.checkpoint = flags.checkpoint.empty() ? flags.output + ".checkpoint" : flags.checkpoint;
  control.checkpoint_every = flags.checkpoint_every;
  control.resume = flags.resume;
  control.deliver = [&](const Fitted& fitted) { return WriteResults(flags, fitted, shared.overwrite); };
  control.outputs = OutputFiles(flags);
  if (!flags.init_splat.empty()) RecordSplat(flags.init_splat);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TrainingViews views, OpenProject(flags.project, {.hold_out = flags.hold_out}));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckOutputs(flags, control, shared.overwrite));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto lock, HoldCheckpoint(control.checkpoint));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const FitOptions options, MakeFitOptions(flags, views.background, shared.seed));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Start start, ChooseStart(flags, views, shared.seed));
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud initial,
                               InitialCloud(start.points, views.scene_scale, StartOptions(options)));
  LogInfo(Cat(views.train.size(), " training views, ", views.held_out.size(), " held out, scene scale ",
              Fixed(views.scene_scale, 3), ", ", WithThousands(initial.size()), " initial Gaussians"));

  std::optional<StopSignal> stop_signal(std::in_place);
  auto fitted = Fit(views, std::move(initial), options, control);
  stop_signal.reset();
  if (!fitted.ok()) return fitted.error();
  if (fitted->report.interrupted) return Interrupted(flags, fitted->report, options.steps, control.checkpoint);
  if (shared.json) {
    PrintJson(ToJson(flags, start.origin, options, fitted->report));
  } else if (!shared.quiet) {
    PrintReport(flags, fitted->report);
  }
  return {};
}

}  // namespace

void AddFit(CLI::App& app, Program& program) {
  CLI::App& verb = AddVerb(app, program, "fit", "Optimise a splat from pictures (standard 3DGS)",
                           "anchorsplat fit scan/ -o scan.ply --max-gaussians 200000");
  const auto flags = std::make_shared<FitFlags>();
  flags->AddTo(verb);
  verb.callback([flags, &verb, &program] {
    flags->given = GivenOptions(verb);
    program.run = [flags, &program] { return RunFit(*flags, program.flags); };
  });
}

}  // namespace anchorsplat
