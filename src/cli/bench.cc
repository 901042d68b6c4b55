#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "bench/io_bench.h"
#include "cli/table.h"
#include "cli/verb.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

Status RunIo(const IoBenchOptions& options, const SharedFlags& shared) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const IoBenchReport report, RunIoBench(options));
  if (shared.json) {
    nlohmann::json rows = nlohmann::json::array();
    for (const IoBenchRow& row : report.Rows()) {
      rows.push_back({{"name", row.name}, {"seconds", row.seconds}, {"bytes", row.bytes}});
      if (row.ratio) rows.back()["ratio"] = {{"value", *row.ratio}, {"meaning", row.ratio_meaning}};
    }
    PrintJson({{"bench", "io"},
               {"gaussians", report.gaussians},
               {"sh_degree", report.sh_degree},
               {"file_bytes", report.file_bytes},
               {"read_ratio", report.read_ratio()},
               {"write_ratio", report.write_ratio()},
               {"memory_ratio", report.memory_ratio()},
               {"rows", rows}});
    return {};
  }
  std::vector<std::vector<std::string>> table = {{"what", "time", "rate", "ratio", "of what"}};
  for (const IoBenchRow& row : report.Rows()) {
    const double rate = row.seconds > 0 ? static_cast<double>(row.bytes) / row.seconds : 0;
    table.push_back({row.name, row.seconds > 0 ? HumanSeconds(row.seconds) : "",
                     rate > 0 ? HumanBytes(static_cast<uint64_t>(rate)) + "/s" : "",
                     row.ratio ? Fixed(*row.ratio, 2) : "", row.ratio_meaning});
  }
  std::cout << WithThousands(report.gaussians) << " Gaussians, SH degree " << report.sh_degree << ", "
            << HumanBytes(report.file_bytes) << "\n\n"
            << FormatTable(table);
  return {};
}

}  // namespace

void AddBench(CLI::App& app, Program& program) {
  CLI::App& verb = *app.add_subcommand("bench", "Measure this machine, as ratios to its own limits");
  verb.require_subcommand(1);
  verb.footer("Example:\n  anchorsplat bench render");

  CLI::App& io = AddVerb(verb, program, "io", "Reading and writing PLY against bare reads, writes and copies",
                         "anchorsplat bench io --gaussians 500000");
  const auto options = std::make_shared<IoBenchOptions>();
  io.add_option("--gaussians", options->gaussians, "How many")
      ->check(CLI::Range(int64_t{1000}, int64_t{100'000'000}))
      ->capture_default_str();
  io.add_option("--sh-degree", options->sh_degree, "Of the spherical harmonics")
      ->check(CLI::Range(0, 3))
      ->capture_default_str();
  io.add_option("--repeats", options->repeats, "The fastest counts")->check(CLI::Range(1, 1000))->capture_default_str();
  io.add_option("--folder", options->folder, "Where to make the file (default: the system's temporary folder)");
  io.callback([options, &program] { program.run = [options, &program] { return RunIo(*options, program.flags); }; });
}

}  // namespace anchorsplat
