#include <unistd.h>

#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "cli/clean_output.h"
#include "cli/stop_signal.h"
#include "cli/table.h"
#include "cli/verb.h"
#include "core/companion.h"
#include "core/file_system.h"
#include "core/text.h"
#include "request/choice.h"
#include "train/train_request.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

struct TrainFlags {
  TrainRequest request;
  std::vector<std::string> datasets, validation;
  std::string captures, config, out, cache, start;
};

// The program linked with LibTorch, with the same command line. It is separate because loading LibTorch takes half a
// second.
Status RunInTrainingProgram(const std::vector<std::string>& words) {
  const fs::path program = CompanionFile("anchorsplat-train");
  if (!Exists(program)) {
    return Error{ErrorCode::kNotFound,
                 "this program was built without LibTorch, which training needs (see `anchorsplat doctor`)"};
  }
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  execv(program.c_str(), arguments.data());
  return Error{ErrorCode::kIo, Cat(program.string(), ": cannot be started")};
}

nlohmann::json ToJson(const std::optional<TrainQuality>& quality) {
  if (!quality) return nullptr;
  nlohmann::json json = {{"psnr", quality->psnr}, {"ssim", quality->ssim}};
  json["lpips"] = quality->lpips ? nlohmann::json(*quality->lpips) : nlohmann::json();
  return json;
}

nlohmann::json ToJson(const TrainReport& r) {
  return {{"output", r.file.string()},
          {"steps", r.steps},
          {"resumed_at", r.resumed_at},
          {"skipped", r.skipped},
          {"objects", r.objects},
          {"validation_objects", r.validation_objects},
          {"parameters", r.parameters},
          {"loss", r.loss},
          {"seconds", r.seconds},
          {"validation", {{"raw", ToJson(r.raw)}, {"filter", ToJson(r.filter)}, {"model", ToJson(r.model)}}}};
}

void PrintReport(const TrainReport& r) {
  std::cout << OneLine(r.file) << ": " << WithThousands(r.parameters) << " parameters after " << WithThousands(r.steps)
            << (r.steps == 1 ? " step on " : " steps on ") << r.objects << " objects, " << HumanSeconds(r.seconds)
            << "\n";
  if (!r.model) return;
  std::vector<std::vector<std::string>> rows = {{"validation", "PSNR", "SSIM", "LPIPS"}};
  const auto add = [&](const char* name, const TrainQuality& q) {
    rows.push_back({name, Fixed(q.psnr, 3), Fixed(q.ssim, 4), q.lpips ? Fixed(*q.lpips, 4) : "-"});
  };
  add("raw", *r.raw);
  add("filter", *r.filter);
  add("model", *r.model);
  std::cout << FormatTable(rows);
}

Status RunTrain(TrainFlags& flags, const Program& program) {
  if (flags.datasets.empty() && flags.captures.empty()) {
    return Error{ErrorCode::kBadArgument, "nothing to train on: pass folders of data sets, or --captures FOLDER"};
  }
  if (program.trainer.run == nullptr) return RunInTrainingProgram(program.words);
  TrainRequest& request = flags.request;
  request.datasets.assign(flags.datasets.begin(), flags.datasets.end());
  request.validation.assign(flags.validation.begin(), flags.validation.end());
  request.captures = flags.captures;
  request.config = flags.config;
  request.out = flags.out;
  request.cache = flags.cache;
  request.start = flags.start;
  request.overwrite = program.flags.overwrite;
  std::optional<StopSignal> stop_signal(std::in_place);
  const auto report = program.trainer.run(request);
  stop_signal.reset();
  if (!report.ok()) return report.error();
  if (report->interrupted) {
    return Error{ErrorCode::kInterrupted, Cat("stopped after step ", WithThousands(report->steps), "; ",
                                              report->file.string(), " is saved; continue with --resume")};
  }
  if (program.flags.json) {
    PrintJson(ToJson(*report));
  } else if (!program.flags.quiet) {
    PrintReport(*report);
  }
  return {};
}

}  // namespace

void AddTrain(CLI::App& app, Program& program) {
  CLI::App& verb = AddVerb(app, program, "train", "Train a network on data sets",
                           "anchorsplat train data/ --config configs/compact-k4.toml -o run");
  const auto flags = std::make_shared<TrainFlags>();
  TrainRequest& request = flags->request;
  verb.add_option("datasets", flags->datasets, "Folders of `dataset build`, or in the published layout")
      ->check(NotEmpty());
  verb.add_option("--captures", flags->captures,
                  "Folder of captures to train on as well: a splat is fitted to most views, the others are the truth")
      ->type_name("FOLDER")
      ->check(CLI::ExistingDirectory);
  verb.add_option("--config", flags->config, "Training recipe, a TOML file (docs/training.md)")
      ->type_name("FILE")
      ->required()
      ->check(CLI::ExistingFile);
  verb.add_option("-o,--output,--out", flags->out, "Folder for the network, its log and its checkpoint")
      ->type_name("FOLDER")
      ->required()
      ->check(NotEmpty());
  verb.add_option("--validation", flags->validation,
                  "Data sets to validate on, or their split \"validation\" (default: that split of the training data)")
      ->type_name("FOLDER");
  verb.add_option("--split", request.split, "Train on this split (default: \"train\" if there are splits, else all)")
      ->type_name("NAME");
  verb.add_option("--cache", flags->cache,
                  "Folder of ground-truth pictures that trainings can share (default: OUT/cache)")
      ->type_name("FOLDER");
  verb.add_option("--start", flags->start, "Start from the weights of another training, its checkpoint.safetensors")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
  verb.add_flag("--resume", request.resume, "Continue the training in the output folder");
  verb.add_option("--steps", request.steps, "Total steps (default: from the recipe)")
      ->check(CLI::Range(int64_t{1}, int64_t{1'000'000'000}));
  verb.add_option("--minutes", request.minutes, "Train for so many minutes, with the schedule scaled to them")
      ->check(Positive());
  verb.callback([flags, &program, &verb] {
    if (verb.get_option("--seed")->count() > 0) flags->request.seed = program.flags.seed;
    program.run = [flags, &program] { return RunTrain(*flags, program); };
  });
}

}  // namespace anchorsplat
