#include "fit/fit.h"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "cli/clean_output.h"
#include "cli/help.h"
#include "cli/standard_output.h"
#include "cli/stop_signal.h"
#include "cli/verb.h"
#include "core/log.h"
#include "core/text.h"
#include "fit/checkpoint_guard.h"
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

struct FitWords {
  std::string project;
  std::string output;
  std::string gsplat_checkpoint;
  FitFlags how;
  std::string to = ".ply";
  const CLI::Option* to_option = nullptr;
  const StandardOutput* piped = nullptr;  // destination of the output

  OutputMemory* memory() const { return piped != nullptr ? piped->memory() : nullptr; }
};

// All files that a fit writes.
std::vector<fs::path> OutputFiles(const FitWords& flags) {
  std::vector<fs::path> files = FilesOfCloud(flags.output, flags.how.standard.objective.render.sh_degree);
  if (!flags.gsplat_checkpoint.empty()) files.emplace_back(flags.gsplat_checkpoint);
  return files;
}

// Checks before hours of work, once the inputs are known.
Status CheckOutputs(const FitWords& flags, const FitControl& control, bool overwrite) {
  const SplatFormat* format = FormatOfExtension(flags.output);
  const auto is_piped = [&](const fs::path& path) { return flags.piped != nullptr && path == flags.piped->path(); };
  if (format == nullptr || format->write == nullptr) {
    return Error{ErrorCode::kBadArgument, Cat("-o ", flags.output, ": not a format that is written (.ply is)")};
  }
  if (!control.checkpoint.empty()) {
    ANCHORSPLAT_RETURN_IF_ERROR(CheckCheckpoint(control.checkpoint, control.outputs, flags.how.resume, overwrite));
  }
  // A resumed fit replaces what its interruption left.
  if (flags.how.resume) RecordWhatWasLeft(control.checkpoint, control.outputs);
  for (const fs::path& path : control.outputs) {
    if (is_piped(path)) continue;
    ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(path, overwrite));
    if (overwrite) RecordOwnFile(path);  // so that an interruption may replace it
  }
  return {};
}

void PrintReport(const FitWords& flags, const FitReport& r) {
  std::ostream& out = ResultsBeside(flags.memory());
  out << OutputName(flags.output, flags.memory()) << ": " << WithThousands(r.gaussians_out) << " Gaussians after "
      << WithThousands(r.steps) << (r.steps == 1 ? " step in " : " steps in ") << HumanSeconds(r.seconds)
      << "\n  training views: " << r.train.views << ", " << Fixed(r.train.psnr, 2) << " dB, SSIM "
      << Fixed(r.train.ssim, 4) << "\n";
  if (r.held_out.views > 0) {
    out << "  held-out views: " << r.held_out.views << ", " << Fixed(r.held_out.psnr, 2) << " dB, SSIM "
        << Fixed(r.held_out.ssim, 4) << "\n";
  }
}

// Writes each file even if the other fails.
Status WriteResults(const FitWords& flags, const Fitted& fitted, bool overwrite) {
  const Status splat =
      WriteCloudOrSaveBeside(flags.output, fitted.cloud, {.overwrite = overwrite, .memory = flags.memory()});
  if (flags.gsplat_checkpoint.empty()) return splat;
  const Status checkpoint =
      WriteOrSaveBeside(flags.gsplat_checkpoint, overwrite, [&](const fs::path& path, bool replace) {
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

Error Interrupted(const FitWords& flags, const FitReport& report, int64_t steps, const fs::path& checkpoint) {
  std::string after = "no checkpoint to resume from";
  if (report.kept_step == report.steps) {
    after = Cat("--resume continues from ", checkpoint.string());
  } else if (report.kept_step) {
    after = Cat("--resume continues at step ", WithThousands(*report.kept_step), " from ", checkpoint.string());
  }
  return {ErrorCode::kInterrupted,
          Cat("stopped after ", WithThousands(report.steps), " of ", WithThousands(steps), " steps; ", flags.output,
              flags.piped != nullptr ? " was not written; " : " holds the result so far; ", after)};
}

Status RunProject(const FitWords& flags, const SharedFlags& shared) {
  const DeviceUse device;
  FitControl control;
  control.checkpoint = flags.how.checkpoint;
  // Standard output has no files beside it.
  if (flags.how.checkpoint.empty() && flags.piped == nullptr) control.checkpoint = flags.output + ".checkpoint";
  control.checkpoint_every = flags.how.checkpoint_every;
  control.resume = flags.how.resume;
  control.deliver = [&](const Fitted& fitted) { return WriteResults(flags, fitted, shared.overwrite); };
  control.outputs = OutputFiles(flags);
  if (!flags.how.init_splat.empty()) RecordSplat(flags.how.init_splat);
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      const TrainingViews views,
      OpenProject(flags.project, {.hold_out = flags.how.hold_out, .downscale = flags.how.downscale}));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckOutputs(flags, control, shared.overwrite));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto lock, HoldCheckpoint(control.checkpoint));
  ANCHORSPLAT_ASSIGN_OR_RETURN(FitOptions options, MakeFitOptions(flags.how, views.background, shared.seed));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ChosenStart start, ChooseFitStart(flags.how, views, flags.project, shared.seed));
  ANCHORSPLAT_ASSIGN_OR_RETURN(FirstGaussians first, MakeFirstGaussians(flags.how, views, start, options));
  LogInfo(Cat(views.train.size(), " training views, ", views.held_out.size(), " held out, scene scale ",
              Fixed(views.scene_scale, 3), ", ", WithThousands(first.cloud.size()), " initial Gaussians"));

  std::optional<StopSignal> stop_signal(std::in_place);
  auto fitted = Fit(views, std::move(first.cloud), options, control);
  stop_signal.reset();
  if (!fitted.ok()) return fitted.error();
  if (fitted->report.interrupted) return Interrupted(flags, fitted->report, options.steps, control.checkpoint);
  if (shared.json) {
    nlohmann::json json = ToJson(options, start.origin, first.shell, fitted->report);
    json["project"] = flags.project;
    json["output"] = flags.output;
    json["device"] = device.ToJson();
    PrintJson(json);
  } else if (!shared.quiet) {
    PrintReport(flags, fitted->report);
  }
  return {};
}

Status RunFit(const FitWords& flags, const SharedFlags& shared) {
  if (!IsStandardOutput(flags.output)) {
    if (flags.to_option->count() == 0) return RunProject(flags, shared);
    return Error{ErrorCode::kBadArgument, "--to works only with -o -"};
  }
  if ((flags.how.resume || flags.how.checkpoint_every > 0) && flags.how.checkpoint.empty()) {
    return Error{ErrorCode::kBadArgument, "--resume and --checkpoint-every with -o - need --checkpoint"};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const StandardOutput piped, StandardOutput::ForSplat(flags.to, shared));
  FitWords words = flags;
  words.piped = &piped;
  words.output = piped.path().string();
  ANCHORSPLAT_RETURN_IF_ERROR(RunProject(words, shared));
  return piped.Send();
}

}  // namespace

void AddFit(CLI::App& app, Program& program) {
  CLI::App& verb = AddVerb(app, program, "fit", "Optimise a splat from pictures (standard 3DGS)",
                           "anchorsplat fit scan/ -o scan.ply --max-gaussians 200000");
  const auto flags = std::make_shared<FitWords>();
  verb.add_option(
          "project", flags->project,
          "Folder with pictures and cameras: COLMAP, NeRF-synthetic, transforms.json, Metashape, OpenSfM, Bundler, "
          "or of `dataset build`")
      ->required()
      ->check(NotEmpty());
  verb.add_option("-o,--output", flags->output, "Output file; - is standard output")
      ->type_name("FILE")
      ->required()
      ->check(NotEmpty());
  flags->to_option = verb.add_option("--to", flags->to, kPipedFormatHelp)->type_name("FORMAT")->capture_default_str();
  verb.add_option("--gsplat-checkpoint", flags->gsplat_checkpoint, "Also write a checkpoint of gsplat's trainer (.pt)")
      ->type_name("FILE")
      ->check(NotEmpty());
  flags->how.AddTo(verb);
  program.device.AddTo(verb);
  ShortenHelp(verb,
              {"--output", "--steps", "--max-gaussians", "--strategy", "--downscale", "--hold-out", "--background",
               "--exposure", "--mip-filter", "--resume", "--to", "--device", "--overwrite", "--quiet", "--json"});
  verb.callback([flags, &verb, &program] {
    flags->how.given = GivenOptions(verb);
    program.run = [flags, &program] { return RunFit(*flags, program.flags); };
  });
}

}  // namespace anchorsplat
