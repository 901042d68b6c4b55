#include "cli/with_lab/bench_reading.h"

#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cli/table.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/run_context.h"
#include "core/text.h"
#include "eval/reading_row.h"
#include "eval/reading_score.h"
#include "eval/reading_table.h"
#include "formats/cloud_io.h"
#include "io/atomic_file.h"
#include "io/input_file.h"
#include "io/input_record.h"
#include "reading/features.h"
#include "reading/reading_model.h"
#include "request/choice.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr size_t kBounds = 3;  // the deciders that know the truth come last

struct ReadingFlags {
  std::vector<std::string> splats;
  bool features = false;
  std::string tasks, output;
  int views = 4;
  std::string table, decisions, folds;
  double loss_weight = kLossWeight;
};

Status PrintFeatures(const ReadingFlags& flags, Program& program) {
  const SharedFlags& shared = program.flags;
  nlohmann::json splats = nlohmann::json::array(), names;
  for (const std::string& file : flags.splats) {
    const Result<GaussianCloud> cloud = ReadCloud(file);
    const auto read = cloud.ok() ? FeaturesOf(*cloud) : Result<SplatFeatures>(cloud.error());
    if (!read.ok()) {
      const std::string why =
          cloud.ok() ? Cat(file, ": ", read.error().message) : read.error().message;  // which names the file
      if (flags.splats.size() == 1) return Error{read.error().code, why};
      LogWarning(why);
      program.exit_code = kPartialExitCode;
      continue;
    }
    if (shared.json) {
      names = FeatureNames();
      splats.push_back({{"file", file}, {"unit", read->unit}, {"features", read->values}});
      continue;
    }
    std::vector<std::vector<std::string>> table = {{file, Cat("unit ", read->unit)}};
    for (size_t k = 0; k < FeatureNames().size(); ++k) {
      table.push_back({FeatureNames()[k], std::isnan(read->values[k]) ? "not known" : Fixed(read->values[k], 4)});
    }
    std::cout << FormatTable(table);
  }
  // Names apart: values keep their order, as in the rows of the table.
  if (shared.json) PrintJson({{"bench", "reading"}, {"names", names}, {"splats", splats}});
  return {};
}

// Whether a row is there that was made of the same task and the same files.
bool IsRowOf(const fs::path& path, const std::string& state) {
  if (!IsFile(path)) return false;
  RecordOwnFile(path);  // this command's own, to be replaced
  const auto file = InputFile::Open(path);
  if (!file.ok()) return false;
  const auto text = file->ReadAll(uint64_t{1} << 24);
  if (!text.ok()) return false;
  const auto row = nlohmann::json::parse(*text, nullptr, /*allow_exceptions=*/false);
  return row.is_object() && row.contains("state") && row["state"] == state;
}

// Every row is a file of its own, so that this goes on where it was stopped, and several may work side by side.
Status MakeRows(const ReadingFlags& flags, Program& program) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<ReadingTask> tasks, ReadReadingTasks(flags.tasks));
  std::error_code code;
  fs::create_directories(flags.output, code);
  if (code) return Error{ErrorCode::kIo, Cat(flags.output, ": cannot make this folder: ", code.message())};
  ReadingRows rows(flags.views);
  int64_t made = 0, there = 0, failed = 0;
  {
    Progress progress("rows", std::ssize(tasks));
    for (const ReadingTask& task : tasks) {
      if (StopRequested()) return Error{ErrorCode::kInterrupted, "stopped; run the same command to continue"};
      const fs::path path = fs::path(flags.output) / (task.id + ".json");
      if (!program.flags.overwrite && IsRowOf(path, rows.StateOf(task))) {
        ++there;
        progress.Advance(1, task.id);
        continue;
      }
      fs::remove(path, code);  // of other files: no row of theirs may stay where none can be made
      if (const auto row = rows.Make(task); row.ok()) {
        ANCHORSPLAT_RETURN_IF_ERROR(WriteWholeFile(path, row->dump() + "\n", true));
        ++made;
      } else {
        LogWarning(Cat(task.id, ": ", row.error().message));
        ++failed;
      }
      progress.Advance(1, task.id);
    }
  }
  if (program.flags.json) {
    PrintJson({{"bench", "reading"}, {"made", made}, {"there", there}, {"failed", failed}});
  } else {
    std::cout << WithThousands(made) << " rows made, " << WithThousands(there) << " were there, "
              << WithThousands(failed) << " failed\n";
  }
  if (failed > 0) program.exit_code = kPartialExitCode;
  return {};
}

std::string Share(int64_t part, int64_t whole) {
  return whole > 0 ? Cat(Fixed(100.0 * static_cast<double>(part) / static_cast<double>(whole), 0), " %") : "";
}

nlohmann::json ToJson(const ReadingScore& score) {
  return {{"group", score.group},
          {"rows", score.rows},
          {"mean", score.mean},
          {"worst", score.worst},
          {"worst_id", score.worst_id},
          {"low", score.low},
          {"losing", score.losing},
          {"intervals", score.intervals},
          {"held", score.held},
          {"interval_width", score.width},
          {"named", score.named},
          {"recognised", score.recognised},
          {"could_be_accused", score.could_be_accused},
          {"accused", score.accused},
          {"seconds", score.seconds}};
}

// As --decisions reads them.
nlohmann::json ToJson(std::span<const ReadingRow> rows, const Decisions& decisions) {
  nlohmann::json json = nlohmann::json::array();
  for (size_t i = 0; i < rows.size(); ++i) {
    const ReadingDecision& d = decisions[i];
    json.push_back({{"id", rows[i].id}, {"method", d.method}, {"low", d.low}, {"high", d.high}, {"made", d.made}});
    if (d.method == "none") continue;
    json.back()["mode"] = NameOf(d.mode.value_or(rows[i].DrawnMode()));
    json.back()["pixel"] = d.pixel;
  }
  return json;
}

// Rows of one decider: its own numbers, and beside them what was to be had.
std::vector<std::string> Cells(const std::string& name, const ReadingScore& s) {
  const auto gain = [&](double value) { return s.rows > 0 ? Fixed(value, 2) : std::string(); };
  return {name,
          WithThousands(s.rows),
          gain(s.mean),
          gain(s.worst),
          gain(s.low),
          s.rows > 0 ? Cat(Fixed(100 * s.losing, 1), " %") : "",
          Share(s.held, s.intervals),
          s.intervals > 0 ? Cat(Fixed(s.width, 1), "×") : "",
          Share(s.recognised, s.named),
          Share(s.accused, s.could_be_accused),
          s.seconds > 0 ? Fixed(s.seconds, 2) : ""};
}

// Who is taken for what, a row for each way to be made.
std::string ConfusionTable(std::span<const ReadingRow> rows, const Decisions& decisions) {
  const auto counts = TakenFor(rows, decisions);
  std::set<std::string> said;
  for (const auto& [made, of] : counts) {
    for (const auto& [word, count] : of) said.insert(word);
  }
  std::vector<std::vector<std::string>> table = {{"untagged, made … taken for"}};
  table[0].insert(table[0].end(), said.begin(), said.end());
  for (const auto& [made, of] : counts) {
    table.push_back({made});
    for (const std::string& word : said) {
      const auto found = of.find(word);
      table.back().push_back(found == of.end() ? "" : WithThousands(found->second));
    }
  }
  return FormatTable(table);
}

std::vector<std::string> Heading(const std::string& name) {
  return {name, "rows", "mean", "worst", "2 %", "lose", "held", "width", "known", "accused", "s"};
}

Status Score(const ReadingFlags& flags, const SharedFlags& shared) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<ReadingRow> rows, ReadReadingTable(flags.table));
  std::vector<std::pair<std::string, Decisions>> deciders;
  if (!flags.decisions.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto given, ReadReadingDecisions(flags.decisions, rows));
    if (given.size() < rows.size()) {
      LogWarning(Cat(flags.decisions, ": decides ", WithThousands(std::ssize(given)), " of ",
                     WithThousands(std::ssize(rows)), " rows; the others are left alone"));
    }
    deciders.emplace_back(fs::path(flags.decisions).filename().string(), GivenDecisions(rows, given));
  }
  if (!flags.folds.empty()) {
    std::vector<ReadingModel> models;
    for (int fold = 0; fold < kReadingFolds; ++fold) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorFile file,
                                   TensorFile::Open(fs::path(flags.folds) / Cat("fold-", fold, ".safetensors")));
      ANCHORSPLAT_ASSIGN_OR_RETURN(ReadingModel model, ReadingModel::Load(file));
      models.push_back(std::move(model));
    }
    deciders.emplace_back("model", ReadDecisions(rows, models, flags.loss_weight));
    deciders.emplace_back("model, cameras", ReadDecisions(rows, models, flags.loss_weight, 1));
    deciders.emplace_back("model, cameras 4x as wide", ReadDecisions(rows, models, flags.loss_weight, 4));
  }
  deciders.emplace_back("the list", TodaysDecisions(rows));
  for (const char* method : {"filter", "network"}) {
    double multiple = 0;
    Decisions fixed = FixedDecisions(rows, method, multiple);
    deciders.emplace_back(Cat("true pixel × ", multiple, ", ", method), std::move(fixed));
  }
  deciders.emplace_back("best of all", BestDecisions(rows));
  const CurveError error = ErrorOfCurves(rows);
  if (shared.json) {
    nlohmann::json json = {{"bench", "reading"},
                           {"rows", rows.size()},
                           {"curve_error", {{"rows", error.rows}, {"median", error.median}, {"p95", error.most}}},
                           {"deciders", nlohmann::json::array()}};
    for (const auto& [name, decisions] : deciders) {
      nlohmann::json& decider =
          json["deciders"].emplace_back(nlohmann::json{{"name", name}, {"taken_for", TakenFor(rows, decisions)}});
      for (const ReadingScore& score : ScoreReadings(rows, decisions)) decider["groups"].push_back(ToJson(score));
      if (name == "model") decider["decisions"] = ToJson(rows, decisions);
    }
    PrintJson(json);
    return {};
  }
  std::vector<std::vector<ReadingScore>> scores;
  for (const auto& [name, decisions] : deciders) scores.push_back(ScoreReadings(rows, decisions));
  std::vector<std::vector<std::string>> overall = {Heading("all rows")};
  for (size_t d = 0; d < deciders.size(); ++d) overall.push_back(Cells(deciders[d].first, scores[d][0]));
  for (size_t d = 0; d + kBounds < deciders.size(); ++d) {
    std::vector<std::vector<std::string>> table = {Heading(deciders[d].first)};
    table[0].insert(table[0].end(), {"true filter", "true network", "best"});
    for (size_t g = 0; g < scores[d].size(); ++g) {
      table.push_back(Cells(scores[d][g].group, scores[d][g]));
      for (size_t bound = deciders.size() - kBounds; bound < deciders.size(); ++bound) {
        table.back().push_back(scores[bound][g].rows > 0 ? Fixed(scores[bound][g].mean, 2) : "");
      }
    }
    std::cout << FormatTable(table) << "\n" << ConfusionTable(rows, deciders[d].second) << "\n";
  }
  std::cout << FormatTable(overall) << "\n";
  std::cout << "mean, worst, 2 % quantile: gain over the splat as it is, dB; lose: rows that lose more than "
            << kReadingLoss
            << "\nheld: intervals that hold the true pixel; width: upper over lower end, geometric mean\n"
               "known: untagged splats recognised\n"
               "accused: untagged splats with lost width that are taken for widened or enhanced\n"
               "s: seconds before the method begins, median\n"
               "true: mean gain with the true pixel; best: of the best measured method\n"
            << "interpolated gains are off by " << Fixed(error.median, 2) << " dB in the median and "
            << Fixed(error.most, 2) << " dB at the 95th percentile, over " << WithThousands(error.rows)
            << " measured decisions\n";
  return {};
}

Status RunReading(const ReadingFlags& flags, Program& program) {
  const int asked = (flags.features ? 1 : 0) + (flags.tasks.empty() ? 0 : 1) + (flags.table.empty() ? 0 : 1);
  if (asked != 1) {
    return Error{ErrorCode::kBadArgument,
                 "pass exactly one of --features (of splats), --tasks (rows of the table) and --score (a table)"};
  }
  if (flags.features && flags.splats.empty()) return Error{ErrorCode::kBadArgument, "--features needs a splat"};
  if (!flags.features && !flags.splats.empty()) {
    return Error{ErrorCode::kBadArgument, "splats are for --features"};
  }
  if (flags.features) return PrintFeatures(flags, program);
  return flags.tasks.empty() ? Score(flags, program.flags) : MakeRows(flags, program);
}

}  // namespace

void AddReadingBench(CLI::App& bench, Program& program) {
  CLI::App& verb = AddVerb(bench, program, "reading", "Measure the estimates from splats",
                           "anchorsplat bench reading --score data/reading.jsonl.gz");
  const auto flags = std::make_shared<ReadingFlags>();
  verb.add_option("splats", flags->splats, "Splat files");
  verb.add_flag("--features", flags->features, "Print the model's input for these splats");
  CLI::Option* const tasks = verb.add_option(
      "--tasks", flags->tasks, "Make rows of the table for these splats (JSON lines by scripts/reading-table.py)");
  tasks->needs(verb.add_option("-o,--output", flags->output,
                               "Folder for a file per row; existing rows of unchanged splats are kept")
                   ->needs(tasks)
                   ->check(NotEmpty()));
  verb.add_option("--views", flags->views, "Held-out views per gain")
      ->needs(tasks)
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  CLI::Option* const table = verb.add_option(
      "--score", flags->table, "Table to score: what the rules before the model gained, and what is possible");
  verb.add_option("--decisions", flags->decisions, "Also score these decisions (JSON lines)")->needs(table);
  CLI::Option* const folds =
      verb.add_option("--folds", flags->folds,
                      "Also score these models, each on the fold it has not seen (folder by scripts/train-reading.py)")
          ->needs(table);
  verb.add_option("--losses-count", flags->loss_weight, "With --folds: extra weight of a lost decibel")
      ->needs(folds)
      ->check(NotNegative())
      ->capture_default_str();
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunReading(*flags, program); }; });
}

}  // namespace anchorsplat
