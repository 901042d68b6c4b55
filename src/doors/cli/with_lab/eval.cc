#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/clean_output.h"
#include "cli/help.h"
#include "cli/lab.h"
#include "cli/verb.h"
#include "cli/with_lab/open_lpips.h"
#include "core/log.h"
#include "core/text.h"
#include "enhance/filter.h"
#include "eval/evaluation.h"
#include "eval/filter_sweep.h"
#include "eval/report.h"
#include "eval/summary.h"
#include "request/choice.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// What the objects of a benchmark are made from.
enum class EvalRecipe { kNone, kReal };

struct EvalFlags {
  std::string benchmark;
  std::string out;
  EvalRecipe recipe = EvalRecipe::kNone;
  std::vector<std::string> methods;  // empty: MethodsOf the recipe
  std::optional<int64_t> fit_steps;
  Protocol protocol = Protocol::kHeldOut;
  MethodOptions method_options;
  std::string split;
  std::vector<std::string> objects;
  std::vector<std::string> kinds;
  size_t max_views = 0;
  std::string lpips;
  std::string lpips_weights;
  bool choose_f = false;
  bool plan = false;
};

std::vector<std::string> MethodsOf(EvalRecipe recipe) {
  if (recipe == EvalRecipe::kReal) return {"raw", "upsample", "filter", "model", "auto", "good", "best"};
  return {"raw", "upsample", "filter"};
}

Result<std::vector<EvalMethod>> MakeMethods(const EvalFlags& flags) {
  std::vector<EvalMethod> methods;
  if (flags.choose_f) {
    for (const double f : FilterStrengths()) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(EvalMethod method, MakeEvalMethod(Cat("filter@", f), flags.method_options));
      methods.push_back(std::move(method));
    }
    return methods;
  }
  for (const std::string& word : flags.methods) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(EvalMethod method, MakeEvalMethod(word, flags.method_options));
    methods.push_back(std::move(method));
  }
  return methods;
}

// The best f over all objects, by mean PSNR at each strength. Rows are in the order of the strengths.
Result<double> ChooseStrength(const std::vector<MethodSummary>& summaries) {
  const std::span<const double> strengths = FilterStrengths();
  std::vector<double> psnr;
  psnr.reserve(summaries.size());
  for (const MethodSummary& summary : summaries) psnr.push_back(summary.psnr.mean);
  if (psnr.size() != strengths.size()) {
    return Error{ErrorCode::kBadFile, "cannot choose a strength: some were not measured"};
  }
  return TopOfParabola(strengths, psnr);
}

Status RunEval(EvalFlags flags, Program& program) {
  const DeviceUse device;
  if (flags.methods.empty()) flags.methods = MethodsOf(flags.recipe);
  flags.method_options.fit_steps = flags.fit_steps.value_or(flags.method_options.fit_steps);
  const SharedFlags& shared = program.flags;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<EvalMethod> methods, MakeMethods(flags));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::optional<Lpips> lpips, OpenLpips(flags.lpips, flags.lpips_weights));
  EvaluationOptions options;
  options.protocol = flags.protocol;
  options.split = flags.split;
  options.objects = flags.objects;
  options.kinds = flags.kinds;
  options.max_views = flags.max_views;
  options.lpips = lpips ? &*lpips : nullptr;
  if (flags.recipe == EvalRecipe::kReal) {
    if (!flags.split.empty())
      return Error{ErrorCode::kBadArgument, "--split has no effect on captures; select them with --objects"};
    options.captures.emplace();
    options.captures->seed = shared.seed;
    options.captures->steps = flags.fit_steps.value_or(options.captures->steps);
  }
  options.seed = shared.seed;
  options.again = shared.overwrite;
  if (flags.plan) {
    if (options.captures) {
      return Error{ErrorCode::kBadArgument, "--plan does not work with --recipe real, whose methods share fits"};
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<std::string> objects, ObjectsToEvaluate(flags.benchmark, options));
    nlohmann::json words = nlohmann::json::array();
    for (size_t k = 0; k < methods.size(); ++k) {
      words.push_back(
          {{"word", flags.choose_f ? methods[k].name : flags.methods[k]}, {"file", FileStem(methods[k].name)}});
    }
    PrintJson({{"objects", objects}, {"methods", words}});
    return {};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Evaluation evaluation, Evaluate(flags.benchmark, methods, flags.out, options));
  if (!evaluation.failures.empty()) program.exit_code = kPartialExitCode;
  if (evaluation.results.empty()) {
    return Error{ErrorCode::kBadFile, Cat("no object could be measured: ", evaluation.failures.size(), " failures")};
  }
  const std::vector<MethodSummary> summaries = Summarise(evaluation, shared.seed);
  const fs::path folder(flags.benchmark);
  const std::string title =
      Cat("Evaluation of ", (folder.has_filename() ? folder : folder.parent_path()).filename().string());
  ANCHORSPLAT_RETURN_IF_ERROR(WriteReports(flags.out, evaluation, summaries, title, shared.seed));
  nlohmann::json json = ToJson(evaluation, summaries, shared.seed);
  std::string chosen;
  if (flags.choose_f) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double f, ChooseStrength(summaries));
    json["chosen_f"] = f;
    chosen = Cat("\nBest strength over all objects: ", Fixed(f, 3), "   (--filter-f ", Fixed(f, 3), ")\n");
  }
  if (shared.json) {
    json["device"] = device.ToJson();
    PrintJson(json);
  } else {
    std::cout << ToMarkdown(evaluation, summaries, title, shared.seed) << chosen;
    if (!shared.quiet) {
      std::cout << "\nWritten: " << OneLine(fs::path(flags.out) / "table.md")
                << ", table.csv, results.json, contact_sheet.png\n";
    }
  }
  return {};
}

}  // namespace

void AddEval(CLI::App& app, Program& program) {
  CLI::App& verb = AddVerb(app, program, "eval", "Measure methods against the ground truth of a benchmark",
                           "anchorsplat eval test-30 -o results --methods raw,upsample,filter,model.safetensors");
  const auto flags = std::make_shared<EvalFlags>();
  verb.add_option("benchmark", flags->benchmark, "Folder with a folder per object (docs/eval.md)")
      ->required()
      ->check(NotEmpty());
  verb.add_option("-o,--output", flags->out,
                  "Folder for tables and results; existing results are kept (-w: measured again)")
      ->type_name("FOLDER")
      ->required()
      ->check(NotEmpty());
  AddChoice(
      verb, "--recipe", flags->recipe, {{"none", EvalRecipe::kNone}, {"real", EvalRecipe::kReal}},
      "real: the benchmark holds captures (photographs with cameras); fit a splat to each at a quarter of its size");
  auto* methods =
      verb.add_option("--methods", flags->methods,
                      "Comma-separated: raw, filter, filter@F, filter-auto, filter-best, upsample, bicubic, network "
                      "files (also upscalers), auto, fast, good, best, methods of enhance (refine@k=1@steps=400: "
                      "with options; model-auto: without cameras) (default: raw,upsample,filter; "
                      "with --recipe real also model,auto,good,best)")
          ->type_name("LIST")
          ->delimiter(',');
  AddChoice(verb, "--protocol", flags->protocol, {{"heldout", Protocol::kHeldOut}, {"upstream", Protocol::kUpstream}},
            "heldout: views that no fit has seen; upstream: as the published evaluation");
  auto* strength = verb.add_option("--filter-f", flags->method_options.filter_strength,
                                   "Strength of 'filter' (default: 1 - (1 - 1/upscale²)/3.6)")
                       ->check(CLI::Range(0.0, kMaxFilterStrength));
  verb.add_flag("--choose-f", flags->choose_f,
                "Measure the filter at several strengths and report the best; for a validation split")
      ->excludes(methods)
      ->excludes(strength);
  verb.add_option("--fit-steps", flags->fit_steps,
                  "Fit steps of 'bicubic' (default: 15000) and of --recipe real (default: 5000)")
      ->check(CLI::Range(int64_t{1}, int64_t{1'000'000}));
  verb.add_option("--split", flags->split, "Only objects of this split: train, validation or test")->type_name("NAME");
  verb.add_option("--objects", flags->objects, "Only these objects, comma-separated")
      ->type_name("NAMES")
      ->delimiter(',');
  verb.add_option("--kinds", flags->kinds,
                  "Only objects of these kinds (entries of the data set's recipe), comma-separated")
      ->type_name("NAMES")
      ->delimiter(',');
  verb.add_option("--max-views", flags->max_views, "Most views per object; 0: all")
      ->check(NotNegative())
      ->capture_default_str();
  verb.add_flag("--plan", flags->plan, "Only print the objects and methods as JSON, for `anchorsplat batch eval`");
  AddLpipsFlags(verb, flags->lpips, flags->lpips_weights);
  program.device.AddTo(verb);
  ShortenHelp(verb, {"--output", "--methods", "--recipe", "--split", "--objects", "--max-views", "--lpips", "--device",
                     "--overwrite", "--quiet", "--json"});
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunEval(*flags, program); }; });
}

}  // namespace anchorsplat
