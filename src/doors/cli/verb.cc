#include "cli/verb.h"

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <iostream>
#include <new>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/clean_output.h"
#include "cli/gpu_report.h"
#include "cli/help.h"
#include "cli/json_sink.h"
#include "cli/verb_tree.h"
#include "cli/verb_words.h"
#include "core/log.h"
#include "core/memory_limit.h"
#include "core/parallel.h"
#include "core/run_context.h"
#include "core/text.h"
#include "gpu/open_gpu.h"
#include "io/input_record.h"
#include "request/choice.h"

namespace anchorsplat {

namespace {

int Fail(const SharedFlags& flags, const Error& error) {
  LogError(error.message);
  if (flags.json) PrintJson({{"error", {{"code", CodeName(error.code)}, {"message", error.message}}}});
  return ExitCode(error.code);
}

}  // namespace

CLI::App& AddVerb(CLI::App& app, Program& program, const std::string& name, const std::string& description,
                  const std::string& example) {
  CLI::App& verb = *app.add_subcommand(name, description);
  verb.footer("Example:\n  " + example);
  SharedFlags& flags = program.flags;
  const std::string group = kSharedFlagsGroup;
  verb.add_flag("-w,--overwrite", flags.overwrite, "Replace existing files (default: refuse)")->group(group);
  verb.add_flag("-q,--quiet", flags.quiet, "Print only warnings and errors")->group(group);
  verb.add_flag("--json", flags.json, "Print the result as JSON on stdout")->group(group);
  AddChoice(verb, "--progress", flags.json_progress, {{"bar", false}, {"json", true}},
            "On stderr. bar: text, with progress bars on a terminal; json: one JSON line per message and step")
      ->group(group);
  verb.add_option("--threads", flags.threads, "CPU threads; 0: all")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str()
      ->group(group);
  verb.add_option("--seed", flags.seed, "Random seed")->check(NotNegative())->capture_default_str()->group(group);
  return verb;
}

void AddVerbs(CLI::App& app, Program& program) {
  AddHelp(app);
  AddEnhance(app, program);
  AddInfo(app, program);
  AddRender(app, program);
  AddConvert(app, program);
  AddCompare(app, program);
  AddUpscale(app, program);
  AddEval(app, program);
  AddView(app, program);
  AddViews(app, program);
  AddFit(app, program);
  AddDataset(app, program);
  AddTrain(app, program);
  AddBench(app, program);
  AddDoctor(app, program);
  AddPython(app, program);
  AddManual(app, program);
  CheckNumbers(app);
}

void PrintJson(const nlohmann::json& json) {
  // Replacing invalid UTF-8: file names are bytes, JSON is text.
  std::cout << CleanJson(json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace)) << '\n';
}

int RunProgram(int argc, const char* const* argv, Trainer trainer) {
  const CleanOutput clean_output(std::cout);
  CLI::App app{"anchorsplat: makes a low-quality 3D Gaussian splat hold up when seen closer", "anchorsplat"};
  app.set_version_flag("--version", std::string("anchorsplat ") + ANCHORSPLAT_VERSION);
  app.require_subcommand(1);
  Program program;
  program.words.assign(argv, argv + argc);
  program.trainer = trainer;
  AddVerbs(app, program);
  // After a parse error the flags are not set: looks for --json in the words.
  const auto usage_error = [&program](const Error& error) {
    SharedFlags flags;
    flags.json = std::ranges::find(program.words, "--json") != program.words.end();
    return Fail(flags, error);
  };
  if (const Status verbs = CheckVerbWords(app, program.words); !verbs.ok()) return usage_error(verbs.error());
  const std::vector<std::string> words = WithLongNames(app, program.words);
  std::vector<const char*> pointers;
  for (const std::string& word : words) pointers.push_back(word.c_str());
  try {
    app.parse(argc, pointers.data());
  } catch (const CLI::ParseError& error) {
    // CLI11 answers --help and --version through this path with exit code 0.
    if (error.get_exit_code() == 0) return app.exit(error);
    std::string what = error.what();
    // An option that is not recognised may be why another is missing.
    const auto code = static_cast<CLI::ExitCodes>(error.get_exit_code());
    if (code == CLI::ExitCodes::ExtrasError || code == CLI::ExitCodes::RequiredError) {
      if (const std::string unknown = UnknownOption(app, words); !unknown.empty()) what = unknown;
    }
    return usage_error({ErrorCode::kBadArgument, Cat(what, " (--help shows how)")});
  }

  // Beyond the file size limit, a write fails instead of ending the program.
  std::signal(SIGXFSZ, SIG_IGN);
  const SharedFlags& flags = program.flags;
  SetLogSink(flags.json_progress ? MakeJsonSink(flags.quiet) : MakeTerminalSink(flags.quiet));
  SetThreadCount(flags.threads);
  // Runs that verbs start to be stoppable inherit this (stop_signal.h).
  const RunScope run({.device = program.device.device, .max_gpu_memory = program.device.max_gpu_memory});
  const InputRecord record;  // the verb never overwrites what it reads
  try {
    // A requested GPU that is missing is an error now, not after hours on the CPU.
    const auto gpu = GpuOfRun();
    if (!gpu.ok()) return Fail(flags, gpu.error());
    if (*gpu != nullptr) LogInfo(WorkingOn((*gpu)->adapter()));
    const Status status = program.run();
    if (!status.ok()) return Fail(flags, status.error());
    std::cout.flush();
    if (!std::cout) return Fail(flags, {ErrorCode::kIo, "cannot write to standard output"});
    return program.exit_code;
  } catch (const RunAbandoned&) {
    return Fail(flags, {ErrorCode::kInterrupted, "stopped; unfinished output was removed"});
  } catch (const DiskFull& none) {
    return Fail(flags, {ErrorCode::kIo, none.what()});
  } catch (const std::bad_alloc&) {
    return Fail(flags, {ErrorCode::kIo, "out of memory"});
  } catch (const std::exception& error) {
    return Fail(flags, {ErrorCode::kIo, Cat("unexpected failure: ", error.what(), " (please report this)")});
  }
}

}  // namespace anchorsplat
