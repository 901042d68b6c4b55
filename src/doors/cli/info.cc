#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/clean_output.h"
#include "cli/lab.h"
#include "cli/table.h"
#include "cli/verb.h"
#include "core/splat_comments.h"
#include "core/statistics.h"
#include "core/text.h"
#include "formats/opened_splat.h"
#include "formats/registry.h"
#include "request/choice.h"
#include "request/findings.h"
#include "request/parse.h"

namespace anchorsplat {

namespace {

std::string_view ModeName(std::optional<RenderMode> mode) {
  return mode ? NameOf(*mode) : "not tagged (render, compare and view assume classic)";
}

std::string Number(double value) {
  if (std::isnan(value)) return "-";  // no Gaussians
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

// World coordinate with as many digits as `mean` alone would have.
std::string Coordinate(float mean, double origin) {
  if (origin == 0) return Number(mean);
  char text[400];
  const int decimals = mean == 0 ? 0 : std::clamp(3 - static_cast<int>(std::floor(std::log10(std::fabs(mean)))), 0, 9);
  std::snprintf(text, sizeof text, "%.*f", decimals, origin + double{mean});
  return text;
}

constexpr size_t kMostCredit = 1000;  // bytes shown of a credit

void PrintTable(const SplatFindings& f) {
  const CloudStatistics& s = f.statistics;
  std::cout << OneLine(f.file) << "\n"
            << "  Gaussians    " << WithThousands(s.gaussians) << ", SH degree " << s.sh_degree << "\n"
            << "  file         " << HumanBytes(f.file_bytes) << (f.format.empty() ? "" : ", " + f.format) << "\n"
            << "  render mode  " << ModeName(f.render_mode) << "\n";
  if (!f.render_mode && !f.lost_no_width) {
    std::cout << "  looks like   " << DescribeProvenance(f) << "\n";
  }
  std::cout << "  can sharpen  " << TreatmentInWords(f) << "\n";
  for (const std::string& credit : CreditsOf(f.comments)) {
    std::cout << "  credit       " << Printable(credit, kMostCredit) << "\n";
  }
  if (const auto up = UpOf(f.comments)) {
    std::cout << "  up           " << Number((*up)[0]) << " " << Number((*up)[1]) << " " << Number((*up)[2])
              << " (from the comments; axes RDF)\n";
  }
  for (const auto& [name, value] : f.facts.all()) std::cout << "  " << name << "  " << value << "\n";
  if (!IsZero(f.origin)) {
    std::cout << "  origin       " << TextOf(f.origin)
              << " (positions are stored relative to it; bounds are in the world)\n";
  }
  if (s.bounds) {
    std::cout << "  bounds      ";
    for (size_t a = 0; a < 3; ++a) {
      std::cout << (a == 0 ? " x " : ", ")
                << (a == 1   ? "y "
                    : a == 2 ? "z "
                             : "")
                << Coordinate(s.bounds->min[a], f.origin[a]) << " to " << Coordinate(s.bounds->max[a], f.origin[a]);
    }
    std::cout << " (axes RDF, for convert: --action-axes RDF)\n";
  }
  if (f.reading.ok()) {
    std::cout << "  training pixel  " << Number(f.reading->pixel) << " (likely " << Number(f.reading->low) << " to "
              << Number(f.reading->high) << ")\n";
  }
  std::cout << "\n";
  const auto row = [](const char* name, const Percentiles& p) {
    std::vector<std::string> cells = {name};
    for (const float value : p) cells.push_back(Number(value));
    return cells;
  };
  std::cout << FormatTable({{"percentile", "1 %", "10 %", "50 %", "90 %", "99 %"},
                            row("largest axis", s.largest_axis),
                            row("smallest axis", s.smallest_axis),
                            row("axis ratio", s.axis_ratio),
                            row("opacity", s.opacity)});
  std::cout << "\nsize as:";
  for (const SplatFormat& format : Formats()) {
    if (format.write == nullptr || format.predicted_size == nullptr) continue;
    std::cout << "  " << format.name << (format.size_is_estimate ? " about " : " ")
              << HumanBytes(format.predicted_size(s.gaussians, s.sh_degree));
  }
  std::cout << "\n\n" << (f.problems.empty() ? "no problems found" : "found:") << "\n";
  for (const std::string& problem : f.problems) std::cout << "  - " << problem << "\n";
}

// A network's weights instead of a splat.
Status RunModelInfo(const std::string& path, const SharedFlags& shared) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const NetworkFindings found, InspectNetwork(path));
  if (shared.json) {
    PrintJson(ToJson(found));
    return {};
  }
  std::cout << OneLine(path) << "\n  parameters   " << WithThousands(found.parameters) << " in " << found.tensors
            << " tensors\n";
  for (const auto& [key, value] : found.facts)
    std::cout << "  " << Printable(key) << "  " << Printable(value, 2000) << "\n";
  return {};
}

struct InfoFlags {
  std::string file;
  std::string from;  // name of a format; empty: recognised
};

Status RunInfo(const InfoFlags& flags, const SharedFlags& shared) {
  const std::string& path = flags.file;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SplatFormat* const from, ParseInputFormat("--from", flags.from));
  if (from == nullptr && LooksLikeNetwork(path)) return RunModelInfo(path, shared);
  if (from == nullptr && path != "-" && LooksLikeMesh(path)) return RunMeshInfo(path, shared);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedSplat file, OpenedSplat::Open(path, from));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SplatFindings findings, InspectSplat(file, path));
  if (shared.json) {
    PrintJson(ToJson(findings));
  } else {
    PrintTable(findings);
  }
  return {};
}

}  // namespace

void AddInfo(CLI::App& app, Program& program) {
  CLI::App& verb = AddVerb(app, program, "info", "Inspect a splat, a network or a mesh, and report problems",
                           "anchorsplat info scan.ply --json");
  const auto flags = std::make_shared<InfoFlags>();
  verb.add_option("file", flags->file, "Splat, network weights, mesh, or library.sh3f[#object]")->required();
  verb.add_option("--from", flags->from, kInputFormatHelp)->type_name("FORMAT")->check(NotEmpty());
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunInfo(*flags, program.flags); }; });
}

}  // namespace anchorsplat
