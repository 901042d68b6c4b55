#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/clean_output.h"
#include "cli/help.h"
#include "cli/stop_signal.h"
#include "cli/verb.h"
#include "cli/with_lab/dataset.h"
#include "cli/with_lab/mesh_views.h"
#include "core/parallel.h"
#include "core/text.h"
#include "dataset/dataset_builder.h"
#include "dataset/dataset_split.h"
#include "dataset/object_builder.h"
#include "dataset/process_pool.h"
#include "dataset/recipe.h"
#include "request/choice.h"

namespace anchorsplat {

namespace {

struct BuildFlags {
  std::vector<std::string> meshes;
  std::string list;
  std::string objects;
  std::string output;
  std::string recipe;
  ViewSetFlags views;
  ObjectSettings settings;
  int jobs = 0;
  double timeout = 4 * 3600;
  bool retry = false;
  std::string licence;
  std::string creator;
  bool plan = false;
};

Result<Recipe> MakeRecipe(const BuildFlags& flags, const SharedFlags& shared) {
  ObjectSettings settings = flags.settings;
  ANCHORSPLAT_ASSIGN_OR_RETURN(settings.views, flags.views.Options(shared));
  settings.views.overwrite = false;
  settings.seed = shared.seed;
  if (!flags.recipe.empty()) return ReadRecipe(flags.recipe, settings);
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(settings));
  return SingleRecipe(settings);
}

void PrintPlan(const DatasetPlan& plan, const std::string& dataset) {
  nlohmann::json wanted = nlohmann::json::array();
  for (const PlannedObject& o : plan.wanted) {
    wanted.push_back({{"name", o.name}, {"source", o.source}, {"base", o.base}, {"job", o.job.string()}});
  }
  const DatasetBuildReport& r = plan.report;
  PrintJson({{"dataset", dataset},
             {"wanted", wanted},
             {"objects", r.objects},
             {"there_already", r.there_already},
             {"other_settings", r.other_settings},
             {"failed", r.failed},
             {"rejected", r.rejected}});
}

Status RunBuild(const BuildFlags& flags, Program& program) {
  const SharedFlags& shared = program.flags;
  DatasetBuildOptions options;
  ANCHORSPLAT_ASSIGN_OR_RETURN(options.recipe, MakeRecipe(flags, shared));
  // Fits of small pictures use one core each better than several together.
  const int cores = ThreadCount();
  options.jobs = flags.jobs > 0 ? flags.jobs : cores;
  options.threads = std::max(1, cores / options.jobs);
  options.timeout_seconds = flags.timeout;
  options.overwrite = shared.overwrite;
  options.retry = flags.retry;
  options.licence = flags.licence;
  options.creator = flags.creator;
  options.program = OwnProgram();
  std::vector<std::string> meshes = flags.meshes;
  if (!flags.list.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto listed, ReadAddressList(flags.list));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto resolved, ResolveAddresses(listed, flags.objects));
    meshes.insert(meshes.end(), resolved.begin(), resolved.end());
  }
  if (flags.plan) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const DatasetPlan plan, PlanDataset(meshes, flags.output, options));
    PrintPlan(plan, flags.output);
    return {};
  }
  std::optional<StopSignal> stop_signal(std::in_place);
  auto built = BuildDataset(meshes, flags.output, options);
  stop_signal.reset();
  if (!built.ok()) return built.error();
  const DatasetBuildReport& r = *built;
  if (shared.json) {
    PrintJson({{"dataset", flags.output},
               {"objects", r.objects},
               {"built", r.built},
               {"there_already", r.there_already},
               {"other_settings", r.other_settings},
               {"failed", r.failed},
               {"rejected", r.rejected},
               {"interrupted", r.interrupted},
               {"seconds", r.seconds}});
  } else if (!shared.quiet) {
    std::cout << OneLine(flags.output) << ": " << r.objects << (r.objects == 1 ? " object: " : " objects: ") << r.built
              << " built in " << HumanSeconds(r.seconds) << ", " << r.there_already << " already there, " << r.failed
              << " failed, " << r.rejected << " rejected for their training PSNR\n";
    if (r.other_settings > 0) {
      std::cout << r.other_settings << " of them " << (r.other_settings == 1 ? "was" : "were")
                << " made with other settings; -w makes them again\n";
    }
    if (r.failed > 0)
      std::cout << "reasons are in " << OneLine(flags.output) << "/failures.jsonl; --retry retries them\n";
  }
  if (r.interrupted) {
    return Error{ErrorCode::kInterrupted, Cat(flags.output, ": stopped; run the same command to continue")};
  }
  if (r.failed > 0) program.exit_code = kPartialExitCode;
  return {};
}

}  // namespace

void AddDatasetBuild(CLI::App& parent, Program& program) {
  CLI::App& verb = AddVerb(parent, program, "build", "Make a low- and a high-quality splat of every mesh",
                           "anchorsplat dataset build models/*.obj furniture.sh3f -o data/ --recipe mix.toml");
  const auto flags = std::make_shared<BuildFlags>();
  verb.add_option("meshes", flags->meshes,
                  "Mesh files, furniture libraries, catalog.sh3f#object, or folders of pictures with cameras");
  auto* objects = verb.add_option("--objects", flags->objects, "Folder of the meshes in --list")
                      ->type_name("FOLDER")
                      ->check(NotEmpty());
  verb.add_option("--list", flags->list, "Text file with a mesh per line, such as data/test-30.txt")
      ->type_name("FILE")
      ->check(NotEmpty())
      ->needs(objects);
  verb.add_option("-o,--output", flags->output, "Folder of the data set")
      ->type_name("FOLDER")
      ->required()
      ->check(NotEmpty());
  verb.add_option("--recipe", flags->recipe, "TOML file with a mix of fit schedules and resolutions")
      ->type_name("FILE")
      ->check(NotEmpty());
  verb.add_option("--steps", flags->settings.fit_steps, "Steps of the low-quality fits")
      ->check(CLI::Range(1, 10'000'000))
      ->capture_default_str();
  verb.add_option("--hold-out", flags->settings.hold_out, "Hold out every Nth view; 0: none")
      ->check(CLI::Range(0, 100000))
      ->capture_default_str();
  verb.add_option("--downscale", flags->settings.downscale,
                  "For folders of pictures: downscale of the low-resolution views")
      ->check(CLI::Range(2, 64))
      ->capture_default_str();
  verb.add_option("--max-gaussians", flags->settings.max_gaussians, "Most Gaussians of a fit; 0: no limit")
      ->check(NotNegative())
      ->capture_default_str();
  verb.add_option("--min-psnr", flags->settings.min_train_psnr,
                  "Reject objects whose fit has less PSNR on its training views, dB")
      ->capture_default_str();
  verb.add_option("--jobs", flags->jobs, "Objects made at the same time (default: one per core)")
      ->check(CLI::Range(1, 1024));
  verb.add_option("--timeout", flags->timeout, "Most seconds per object; 0: no limit")
      ->check(NotNegative())
      ->capture_default_str();
  verb.add_option("--licence", flags->licence, "Licence of meshes that name none, such as GPL-2.0-or-later")
      ->type_name("NAME")
      ->check(NotEmpty());
  verb.add_option("--creator", flags->creator, "Creator of meshes that name none")
      ->type_name("NAME")
      ->check(NotEmpty());
  verb.add_flag("--retry", flags->retry, "Retry objects that failed in an earlier run");
  verb.add_flag(
      "--plan", flags->plan,
      "Only update the lists, write a job per missing object and print the jobs as JSON, for `anchorsplat batch "
      "dataset`");
  flags->views.AddTo(verb);
  ShortenHelp(verb, {"--output", "--recipe", "--list", "--objects", "--views", "--size", "--low-size", "--steps",
                     "--jobs", "--retry", "--quiet", "--json"});
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunBuild(*flags, program); }; });
}

namespace {

struct ObjectFlags {
  std::string job;
  std::string output;
};

// Started by `build` for every object; internal.
Status RunObject(const ObjectFlags& flags) {
  DieWithParent();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ObjectJob job, ReadObjectJob(flags.job));
  const StopSignal stop_signal;
  const auto record = BuildObject(job, flags.output, OwnProgram());
  return record.ok() ? Status() : Status(record.error());
}

}  // namespace

void AddDatasetObject(CLI::App& parent, Program& program) {
  CLI::App& verb = AddVerb(parent, program, "object", "Make one object of a data set (started by build)",
                           "anchorsplat dataset object data/.building/chair.job -o data/");
  const auto flags = std::make_shared<ObjectFlags>();
  verb.add_option("job", flags->job, "File that says what to make")->required();
  verb.add_option("-o,--output", flags->output, "Folder of the data set")
      ->type_name("FOLDER")
      ->required()
      ->check(NotEmpty());
  verb.group("");  // not listed
  verb.callback([flags, &program] { program.run = [flags] { return RunObject(*flags); }; });
}

}  // namespace anchorsplat
