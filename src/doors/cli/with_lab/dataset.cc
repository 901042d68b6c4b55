#include "cli/with_lab/dataset.h"

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/clean_output.h"
#include "cli/table.h"
#include "cli/verb.h"
#include "core/text.h"
#include "dataset/dataset_check.h"
#include "dataset/dataset_split.h"
#include "io/atomic_file.h"
#include "request/choice.h"

namespace anchorsplat {

namespace {

std::string Objects(int64_t count) { return Cat(count, count == 1 ? " object" : " objects"); }

struct SplitFlags {
  std::string dataset;
  SplitFractions fractions;
  std::map<std::string, std::string> lists;  // file by split
};

Status RunSplit(const SplitFlags& flags, const SharedFlags& shared) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Manifest manifest, ReadManifest(flags.dataset));
  const std::filesystem::path path = std::filesystem::path(flags.dataset) / kSplitsName;
  ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(path, shared.overwrite));
  Splits splits;
  if (flags.lists.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(splits, SplitByModel(manifest, flags.fractions, shared.seed));
  } else {
    std::map<std::string, std::vector<std::string>> lists;
    for (const auto& [split, file] : flags.lists) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(lists[split], ReadAddressList(file));
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(splits, SplitByLists(manifest, lists));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(WriteSplits(flags.dataset, splits));
  std::map<std::string, int64_t> counts;
  for (const auto& [name, split] : splits) ++counts[split];
  if (shared.json) {
    PrintJson({{"dataset", flags.dataset}, {"objects", manifest.size()}, {"splits", counts}});
  } else if (!shared.quiet) {
    std::cout << OneLine(path) << ": " << Objects(std::ssize(manifest));
    for (const auto& [split, count] : counts) std::cout << ", " << count << " for " << split;
    std::cout << '\n';
  }
  return {};
}

void AddDatasetSplit(CLI::App& parent, Program& program) {
  CLI::App& verb = AddVerb(parent, program, "split", "Divide a data set into training, validation and test objects",
                           "anchorsplat dataset split data/ --validation 0.1 --test 0.1");
  const auto flags = std::make_shared<SplitFlags>();
  verb.add_option("dataset", flags->dataset, "Folder of the data set")->required()->check(NotEmpty());
  verb.add_option("--validation", flags->fractions.validation, "Fraction of the models")
      ->check(Fraction())
      ->capture_default_str();
  verb.add_option("--test", flags->fractions.test, "Fraction of the models")->check(Fraction())->capture_default_str();
  for (const std::string split : {"train", "validation", "test"}) {
    verb.add_option_function<std::string>(
            "--" + split + "-list", [flags, split](const std::string& file) { flags->lists[split] = file; },
            "Text file of the meshes for " + split + ", instead of fractions")
        ->type_name("FILE")
        ->check(NotEmpty());
  }
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunSplit(*flags, program.flags); }; });
}

struct CheckFlags {
  std::string dataset;
  DatasetCheckOptions options;
};

Status RunCheck(const CheckFlags& flags, const SharedFlags& shared) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto problems, CheckDataset(flags.dataset, flags.options));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto failed, ReadFailures(flags.dataset));
  if (shared.json) {
    nlohmann::json list = nlohmann::json::array();
    for (const DatasetProblem& p : problems) list.push_back({{"object", p.object}, {"problem", p.sentence}});
    PrintJson({{"dataset", flags.dataset}, {"problems", list}, {"failed", failed.size()}});
  } else {
    for (const DatasetProblem& p : problems) std::cout << OneLine(p.sentence) << '\n';
    if (!failed.empty() && !shared.quiet) {
      std::cout << Objects(std::ssize(failed)) << " failed and " << (failed.size() == 1 ? "is" : "are")
                << " no part of it: " << OneLine(std::filesystem::path(flags.dataset) / kFailuresName) << '\n';
    }
  }
  if (!problems.empty()) {
    return Error{ErrorCode::kBadFile,
                 Cat(flags.dataset, ": ", problems.size(), problems.size() == 1 ? " problem" : " problems")};
  }
  if (!shared.json && !shared.quiet) std::cout << OneLine(flags.dataset) << ": complete and consistent\n";
  return {};
}

void AddDatasetCheck(CLI::App& parent, Program& program) {
  CLI::App& verb = AddVerb(parent, program, "check", "Check that a data set is complete and consistent",
                           "anchorsplat dataset check data/ --decode");
  const auto flags = std::make_shared<CheckFlags>();
  verb.add_option("dataset", flags->dataset, "Folder of the data set")->required()->check(NotEmpty());
  verb.add_flag("--decode", flags->options.decode, "Decode every picture, not only its header");
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunCheck(*flags, program.flags); }; });
}

nlohmann::json PartToJson(const DatasetSummary::Part& part) {
  return {{"objects", part.objects},
          {"train_psnr", part.train_psnr},
          {"held_out_psnr", part.held_out_psnr},
          {"gaussians", part.gaussians}};
}

nlohmann::json ToJson(const std::string& dataset, const DatasetSummary& s) {
  nlohmann::json recipes = nlohmann::json::object();
  for (const auto& [name, part] : s.recipes) recipes[name] = PartToJson(part);
  return {{"dataset", dataset},
          {"objects", s.objects},
          {"rejected", s.rejected},
          {"failed", s.failed},
          {"failures", s.failures},
          {"unfinished", s.unfinished},
          {"all", PartToJson(s.all)},
          {"recipes", recipes},
          {"splits", s.splits},
          {"licences", s.licences},
          {"seconds", {{"read", s.read_seconds}, {"views", s.view_seconds}, {"fit", s.fit_seconds}}},
          {"bytes", s.bytes}};
}

Status RunInfo(const std::string& dataset, const SharedFlags& shared) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const DatasetSummary s, SummarizeDataset(dataset));
  if (shared.json) {
    PrintJson(ToJson(dataset, s));
    return {};
  }
  std::cout << OneLine(dataset) << ": " << Objects(s.objects) << ", " << HumanBytes(s.bytes) << '\n'
            << "left out: " << s.rejected << " rejected for their training PSNR, " << s.failed << " failed";
  for (const auto& [stage, count] : s.failures) std::cout << " (" << OneLine(stage) << ' ' << count << ')';
  std::cout << ", " << s.unfinished << " unfinished\n";
  std::vector<std::vector<std::string>> rows = {{"recipe", "objects", "training PSNR", "held-out PSNR", "Gaussians"}};
  const auto add = [&](const std::string& name, const DatasetSummary::Part& part) {
    rows.push_back({name, std::to_string(part.objects), Fixed(part.train_psnr, 2), Fixed(part.held_out_psnr, 2),
                    WithThousands(static_cast<int64_t>(part.gaussians))});
  };
  for (const auto& [name, part] : s.recipes) add(name, part);
  if (s.recipes.size() > 1) add("all", s.all);
  std::cout << FormatTable(rows);
  for (const auto& [split, count] : s.splits) std::cout << OneLine(split) << ": " << Objects(count) << '\n';
  std::cout << "licences:";
  for (const auto& [licence, count] : s.licences) std::cout << ' ' << OneLine(licence) << " (" << count << ')';
  std::cout << "\ntime: meshes " << HumanSeconds(s.read_seconds) << ", views " << HumanSeconds(s.view_seconds)
            << ", fits " << HumanSeconds(s.fit_seconds) << '\n';
  return {};
}

void AddDatasetInfo(CLI::App& parent, Program& program) {
  CLI::App& verb = AddVerb(parent, program, "info", "Summarise a data set", "anchorsplat dataset info data/ --json");
  const auto dataset = std::make_shared<std::string>();
  verb.add_option("dataset", *dataset, "Folder of the data set")->required()->check(NotEmpty());
  verb.callback(
      [dataset, &program] { program.run = [dataset, &program] { return RunInfo(*dataset, program.flags); }; });
}

}  // namespace

void AddDataset(CLI::App& app, Program& program) {
  CLI::App& verb = *app.add_subcommand("dataset", "Build and inspect paired low-/high-quality data sets");
  verb.footer("Example:\n  anchorsplat dataset build models/*.obj -o data/");
  verb.require_subcommand(1);
  AddDatasetBuild(verb, program);
  AddDatasetObject(verb, program);
  AddDatasetRoom(verb, program);
  AddDatasetSplit(verb, program);
  AddDatasetCheck(verb, program);
  AddDatasetInfo(verb, program);
}

}  // namespace anchorsplat
