#include "cli/with_lab/bench_gpu.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "bench/gpu_bench.h"
#include "bench/gpu_bench_scene.h"
#include "cli/stop_signal.h"
#include "cli/table.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/run_context.h"
#include "core/text.h"
#include "formats/cloud_io.h"
#include "io/atomic_file.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

struct GpuBenchFlags {
  DeviceFlags device{.device = {DeviceChoice::Kind::kGpu}};
  bool small = false;
  std::vector<int64_t> gaussians;
  std::vector<std::string> sizes;  // checked: WIDTHxHEIGHT
  int repeats = 0;
  std::string output;
};

std::optional<std::array<int, 2>> ParseSize(const std::string& word) {
  const size_t x = word.find('x');
  if (x == std::string::npos || x == 0 || word.size() > 11) return std::nullopt;
  const std::string width = word.substr(0, x), height = word.substr(x + 1);
  const auto whole = [](const std::string& digits) {
    return !digits.empty() && digits.size() <= 5 && digits.find_first_not_of("0123456789") == std::string::npos;
  };
  if (!whole(width) || !whole(height)) return std::nullopt;
  const std::array<int, 2> size = {std::stoi(width), std::stoi(height)};
  if (size[0] < 1 || size[1] < 1 || size[0] > 16384 || size[1] > 16384) return std::nullopt;
  return size;
}

GpuBenchOptions OptionsFrom(const GpuBenchFlags& flags, const SharedFlags& shared) {
  GpuBenchOptions options = flags.small ? SmallGpuBench() : GpuBenchOptions();
  if (!flags.gaussians.empty()) options.gaussians = flags.gaussians;
  if (!flags.sizes.empty()) {
    options.sizes.clear();
    for (const std::string& word : flags.sizes) options.sizes.push_back(*ParseSize(word));
  }
  if (flags.repeats > 0) options.repeats = flags.repeats;
  options.seed = shared.seed;
  return options;
}

std::string SizeWord(int width, int height) { return Cat(width, "x", height); }
std::string Milliseconds(double seconds) { return seconds > 0 ? Fixed(1e3 * seconds, 2) : ""; }
std::string Small(double value) {
  std::ostringstream text;
  text.precision(1);
  text << std::scientific << value;
  return text.str();
}
std::string NameOf(const GpuBenchRow& row) {
  return Cat(WithThousands(row.gaussians), " Gaussians at ", SizeWord(row.width, row.height));
}
double Worst(const GpuBenchReference& cpu) { return *std::ranges::max_element(cpu.gradient_l2); }

nlohmann::json ToJson(const GpuBenchRow& row) {
  nlohmann::json json = {{"gaussians", row.gaussians}, {"width", row.width}, {"height", row.height}};
  if (!row.problem.empty()) json["problem"] = row.problem;
  if (const std::string broken = BrokenPromise(row); !broken.empty()) json["broken_promise"] = broken;
  const auto put = [&](const char* name, double value) { json[name] = value > 0 ? nlohmann::json(value) : nullptr; };
  put("first_seconds", row.first);
  put("upload_seconds", row.upload);
  put("forward_seconds", row.forward);
  put("backward_seconds", row.backward);
  put("picture_seconds", row.picture);
  put("waiting_share", row.waiting);
  json["resident"] = row.resident;
  json["visible"] = row.visible;
  json["pairs"] = row.pairs;
  json["runs"] = row.runs;
  if (row.cpu) {
    const GpuBenchReference& cpu = *row.cpu;
    nlohmann::json gradients;
    for (size_t c = 0; c < kGpuBenchGradients.size(); ++c) gradients[kGpuBenchGradients[c]] = cpu.gradient_l2[c];
    json["cpu"] = {{"forward_seconds", cpu.forward},
                   {"backward_seconds", cpu.backward},
                   {"visible", cpu.visible},
                   {"out_of_order", cpu.out_of_order},
                   {"values", cpu.values},
                   {"values_beyond_1e-4", cpu.beyond},
                   {"gradient_relative_l2", gradients}};
  } else if (!row.no_cpu.empty()) {
    json["no_cpu"] = row.no_cpu;
  }
  if (row.views) {
    json["views"] = {{"count", row.views->count},
                     {"seconds", row.views->seconds},
                     {"waits", row.views->waits},
                     {"together", {{"seconds", row.views->seconds_together}, {"waits", row.views->waits_together}}}};
  }
  if (!row.kernels.empty()) {
    nlohmann::json& kernels = json["kernels"] = nlohmann::json::array();
    for (const KernelTime& time : row.kernels) {
      kernels.push_back({{"entry", time.entry}, {"calls", time.calls}, {"seconds", time.seconds}});
      if (time.unchecked) kernels.back()["unchecked_seconds"] = *time.unchecked;
    }
    json["kernels_clock"] = row.kernels_by_gpu ? "gpu" : "host";
    if (!row.no_unchecked.empty()) json["no_unchecked"] = row.no_unchecked;
  }
  return json;
}

void PrintKernels(const GpuBenchReport& report) {
  // Of the largest that there is.
  const auto row = std::find_if(report.rows.rbegin(), report.rows.rend(),
                                [](const GpuBenchRow& candidate) { return !candidate.kernels.empty(); });
  if (row == report.rows.rend()) return;
  std::vector<std::vector<std::string>> table = {{"kernel", "calls", "ms", "unchecked"}};
  std::vector<KernelTime> kernels = row->kernels;
  std::ranges::stable_sort(kernels, std::greater<>(), &KernelTime::seconds);
  for (const KernelTime& time : kernels) {
    table.push_back({time.entry, Cat(time.calls), Fixed(1e3 * time.seconds, 2),
                     time.unchecked ? Fixed(1e3 * *time.unchecked, 2) : "-"});
  }
  std::cout << "\n"
            << NameOf(*row) << ", one picture and its gradient, kernel by kernel: milliseconds of all calls by "
            << (row->kernels_by_gpu ? "the GPU's clock"
                                    : Cat("the host's clock, which adds a round trip of ",
                                          Milliseconds(report.round_trip), " ms a call"))
            << "\nunchecked: the same without the checks that the library compiles into kernels, for comparison only"
            << (row->no_unchecked.empty() ? "" : Cat("\nthere is nothing to compare with: ", row->no_unchecked))
            << "\n\n"
            << FormatTable(table);
}

void PrintTable(const GpuBenchReport& report, const GpuBenchOptions& options) {
  const GpuAdapter& adapter = report.adapter;
  std::cout << adapter.name << ", " << adapter.backend << ", " << anchorsplat::NameOf(adapter.type) << ", "
            << adapter.driver << "\nmilliseconds per picture, fastest of " << options.repeats << ", against a CPU of "
            << ThreadCount() << " threads\n\n";
  std::vector<std::vector<std::string>> table = {{"Gaussians", "size", "forward", "backward", "CPU", "CPU'", "upload",
                                                  "to host", "waiting", "pairs", "order", "> 1e-4", "gradients"}};
  for (const GpuBenchRow& row : report.rows) {
    if (!row.problem.empty()) continue;  // told below
    const bool there = row.cpu.has_value();
    table.push_back({WithThousands(row.gaussians), SizeWord(row.width, row.height), Milliseconds(row.forward),
                     Milliseconds(row.backward), there ? Milliseconds(row.cpu->forward) : "",
                     there ? Milliseconds(row.cpu->backward) : "", Milliseconds(row.upload), Milliseconds(row.picture),
                     row.waiting > 0 ? Cat(Fixed(100 * row.waiting, 0), " %") : "",
                     row.pairs > 0 ? WithThousands(row.pairs) : "", there ? WithThousands(row.cpu->out_of_order) : "",
                     there ? WithThousands(row.cpu->beyond) : "", there ? Small(Worst(*row.cpu)) : ""});
  }
  std::cout
      << FormatTable(table)
      << "\nforward, backward: of a splat that is on the GPU, with nothing read back; CPU, CPU': the same on the CPU\n"
         "upload: of the splat; to host: from a splat to a picture, both in host memory\n"
         "waiting: share of forward and backward for which the host waits; pairs: of tiles and Gaussians\n"
         "order: Gaussians that stand elsewhere by depth than on the CPU; > 1e-4: values further than that from the "
         "CPU's\n"
         "gradients: relative L2 distance from the CPU's, the worst of six\n";
  for (const GpuBenchRow& row : report.rows) {
    if (!row.problem.empty()) std::cout << NameOf(row) << ": " << row.problem << "\n";
    if (!row.no_cpu.empty()) std::cout << NameOf(row) << ": not on the CPU, " << row.no_cpu << "\n";
    if (!row.resident && row.problem.empty()) {
      std::cout << NameOf(row) << ": uploaded in blocks, more --max-gpu-memory would keep it there\n";
    }
    if (row.views) {
      // Of all views: a wait that is shared is not a tenth of one.
      const auto waits = [&](double of_one) { return Fixed(of_one * row.views->count, 0); };
      std::cout << NameOf(row) << ", " << row.views->count << " views: one by one " << Milliseconds(row.views->seconds)
                << " ms a view and " << waits(row.views->waits) << " waits for the GPU in all, together "
                << Milliseconds(row.views->seconds_together) << " ms a view and " << waits(row.views->waits_together)
                << "\n";
    }
    if (const std::string broken = BrokenPromise(row); !broken.empty())
      std::cout << NameOf(row) << ": " << broken << "\n";
  }
  PrintKernels(report);
}

// What other programs need to draw the same: GAUSSIANS.ply, and the cameras of all sizes.
Status WriteScenes(const GpuBenchFlags& flags, const SharedFlags& shared) {
  const GpuBenchOptions options = OptionsFrom(flags, shared);
  nlohmann::json json = {{"splats", nlohmann::json::array()}, {"cameras", nlohmann::json::array()}};
  for (const auto& [width, height] : options.sizes) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Camera camera, GpuBenchCamera(width, height));
    const Pinhole& k = camera.intrinsics;
    json["cameras"].push_back({{"width", width},
                               {"height", height},
                               {"fx", k.fx},
                               {"fy", k.fy},
                               {"cx", k.cx},
                               {"cy", k.cy},
                               {"rotation", camera.world_to_camera.rotation},
                               {"translation", camera.world_to_camera.translation}});
  }
  const fs::path folder = flags.output;
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) return Error{ErrorCode::kIo, Cat(flags.output, ": the folder cannot be made: ", failed.message())};
  for (const int64_t gaussians : options.gaussians) {
    const std::string name = Cat(gaussians, ".ply");
    CloudWriteOptions write;
    write.overwrite = shared.overwrite;
    ANCHORSPLAT_RETURN_IF_ERROR(WriteCloud(folder / name, GpuBenchCloud(gaussians, options.seed), write));
    json["splats"].push_back({{"file", name}, {"gaussians", gaussians}});
  }
  return WriteWholeFile(folder / "scenes.json", json.dump(2) + "\n", shared.overwrite);
}

Status RunGpuBench(const GpuBenchFlags& flags, Program& program) {
  const SharedFlags& shared = program.flags;
  if (!flags.output.empty()) return WriteScenes(flags, shared);
  const GpuBenchOptions options = OptionsFrom(flags, shared);
  // Not the run's device: that draws on the CPU, which is what is compared with.
  const RunScope memory({.max_gpu_memory = flags.device.max_gpu_memory});
  std::optional<StopSignal> stop_signal(std::in_place);
  // What is known is known also where a driver takes the program with it.
  const auto done = [](const GpuBenchRow& row) {
    LogInfo(row.problem.empty() ? Cat(NameOf(row), ": forward ", Milliseconds(row.forward), " ms, backward ",
                                      Milliseconds(row.backward), " ms")
                                : Cat(NameOf(row), ": ", row.problem));
  };
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GpuBenchReport report, BenchGpu(flags.device.device, options, done));
  stop_signal.reset();
  if (shared.json) {
    nlohmann::json rows = nlohmann::json::array();
    for (const GpuBenchRow& row : report.rows) rows.push_back(ToJson(row));
    PrintJson({{"bench", "gpu"},
               {"adapter",
                {{"name", report.adapter.name},
                 {"driver", report.adapter.driver},
                 {"backend", report.adapter.backend},
                 {"type", anchorsplat::NameOf(report.adapter.type)}}},
               {"threads", ThreadCount()},
               {"repeats", options.repeats},
               {"round_trip_seconds", report.round_trip},
               {"interrupted", report.interrupted},
               {"rows", rows}});
  } else {
    PrintTable(report, options);
  }
  const auto bad = [](const GpuBenchRow& row) { return !row.problem.empty() || !BrokenPromise(row).empty(); };
  if (report.interrupted) {
    program.exit_code = ExitCode(ErrorCode::kInterrupted);
  } else if (std::ranges::any_of(report.rows, bad)) {
    program.exit_code = kPartialExitCode;
  }
  return {};
}

}  // namespace

void AddGpuBench(CLI::App& bench, Program& program) {
  CLI::App& verb = AddVerb(bench, program, "gpu", "Pictures and gradients on a GPU against the CPU: time and accuracy",
                           "anchorsplat bench gpu --device 0 --max-gpu-memory 16G");
  const auto flags = std::make_shared<GpuBenchFlags>();
  verb.add_flag("--small", flags->small, "What a software adapter does in a minute");
  verb.add_option("--gaussians", flags->gaussians, "Of the made-up splats, one or more (default: 20000 340000 3000000)")
      ->check(CLI::Range(int64_t{1}, int64_t{100'000'000}));
  verb.add_option("--size", flags->sizes, "Pixels, one or more (default: 256x256 512x512 1920x1080)")
      ->check(CLI::Validator(
          [](const std::string& word) {
            return ParseSize(word) ? std::string() : Cat(word, " is not WIDTHxHEIGHT, of 1 to 16384 pixels");
          },
          ""));
  verb.add_option("--repeats", flags->repeats, "The fastest counts (default: 5, 2 with --small)")
      ->check(CLI::Range(1, 1000));
  verb.add_option("--write-scenes", flags->output,
                  "Folder for the splats and cameras, which other programs can then draw; measures nothing");
  flags->device.AddTo(verb);
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunGpuBench(*flags, program); }; });
}

}  // namespace anchorsplat
