#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cli/exit_codes.h"
#include "core/result.h"
#include "io/write_options.h"
#include "request/device_flags.h"

namespace anchorsplat {

// The flags of every verb, declared once, in AddVerb.
struct SharedFlags {
  bool overwrite = false;
  bool quiet = false;
  bool json = false;           // stdout has one JSON document and nothing else
  bool json_progress = false;  // stderr has one JSON line per event (json_sink.h)
  int threads = 0;             // 0: the whole machine
  uint64_t seed = 0;
};

struct TrainReport;
struct TrainRequest;
// The training loop; null in a program without it (train/trainer.h).
struct Trainer {
  Result<TrainReport> (*run)(const TrainRequest&) = nullptr;
};

// The parsed command line; main runs it after parsing.
struct Program {
  SharedFlags flags;
  DeviceFlags device;  // set by verbs that rasterize; the CPU for all others
  std::function<Status()> run;
  // Of a successful run: kPartialExitCode if one of several inputs failed.
  int exit_code = 0;
  std::vector<std::string> words;  // argv
  Trainer trainer;
};

// Adds a subcommand with the shared flags, its description and an example for --help.
CLI::App& AddVerb(CLI::App& app, Program& program, const std::string& name, const std::string& description,
                  const std::string& example);

// One function per verb file.
void AddEnhance(CLI::App& app, Program& program);
void AddInfo(CLI::App& app, Program& program);
void AddRender(CLI::App& app, Program& program);
void AddCompare(CLI::App& app, Program& program);
void AddEval(CLI::App& app, Program& program);
void AddView(CLI::App& app, Program& program);
void AddUpscale(CLI::App& app, Program& program);
void AddViews(CLI::App& app, Program& program);
void AddConvert(CLI::App& app, Program& program);
void AddFit(CLI::App& app, Program& program);
void AddDataset(CLI::App& app, Program& program);
void AddTrain(CLI::App& app, Program& program);
void AddBench(CLI::App& app, Program& program);
void AddDoctor(CLI::App& app, Program& program);
void AddPython(CLI::App& app, Program& program);
void AddManual(CLI::App& app, Program& program);

// Adds all verbs, in the order of --help.
void AddVerbs(CLI::App& app, Program& program);

inline WriteOptions WriteOptionsFrom(const SharedFlags& flags) { return {.overwrite = flags.overwrite}; }

// Prints a JSON document to stdout. Numbers that are not finite become null.
void PrintJson(const nlohmann::json& json);

// Runs the program. Never throws.
int RunProgram(int argc, const char* const* argv, Trainer trainer = {});

}  // namespace anchorsplat
