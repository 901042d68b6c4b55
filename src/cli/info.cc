#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>

#include "cli/choice.h"
#include "cli/clean_output.h"
#include "cli/mesh_info.h"
#include "cli/parse.h"
#include "cli/table.h"
#include "cli/verb.h"
#include "core/credit.h"
#include "core/file_system.h"
#include "core/statistics.h"
#include "core/text.h"
#include "enhance/enhanced_mark.h"
#include "enhance/pixel_size_guard.h"
#include "enhance/trained_kind.h"
#include "formats/opened_splat.h"
#include "formats/registry.h"
#include "io/input_file.h"
#include "model/compact/compact_network.h"
#include "model/published/published_checkpoint_writer.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

namespace {

// Everything `info` found, once for the table and once for JSON.
struct Findings {
  std::string file;
  std::string format;  // by content
  FormatFacts facts;
  uint64_t file_bytes = 0;
  GaussianCloud cloud;
  CloudStatistics statistics;
  Result<PixelSizeFinding> pixel_size = Error{};
  std::optional<TrainedKind> looks;   // by its sizes, whatever the file says; nothing where there are too few Gaussians
  std::vector<std::string> problems;  // sentences
};

std::string Rows(int64_t count, int64_t of) {
  return Cat(WithThousands(count), " of ", WithThousands(of), count == 1 ? " Gaussian" : " Gaussians");
}

std::vector<std::string> Problems(const CloudStatistics& s) {
  std::vector<std::string> out;
  const auto add = [&](int64_t count, const char* what) {
    if (count > 0) out.push_back(Rows(count, s.gaussians) + " " + what);
  };
  add(s.not_finite, "with NaN or infinite values; no verb draws them, and enhance drops them");
  add(s.zero_quaternions, "with a zero quaternion; rendered without rotation");
  add(s.zero_scales, "with a scale of zero (log-scale -Inf) on some axis; legal, flat or a point");
  add(s.outliers, "more than ten times farther out than the middle 98 %");
  add(s.unnormalised_quaternions, "with quaternions that are not normalised; legal, as trainers leave them so");
  add(s.implausible, "farther out or longer than a million units: is the file damaged, or of another kind?");
  add(s.invisible, "with an opacity below 1/255; never drawn");
  if (s.linear_looking_scales)
    out.push_back("scales look like lengths, not logarithms: was the file converted wrongly?");
  if (s.linear_looking_opacities)
    out.push_back("opacities look like 0 to 1, not logits: was the file converted wrongly?");
  return out;
}

std::string_view ModeName(const GaussianCloud& cloud) {
  return cloud.render_mode ? NameOf(*cloud.render_mode) : "not said (render, compare and view take it for classic)";
}

std::string_view InWords(const std::optional<TrainedKind>& kind) {
  if (!kind) return "like nothing: too few Gaussians to tell";
  switch (*kind) {
    case TrainedKind::kAntialiased:
      return "like an antialiased one: it has lost a little width, and enhance treats it as one";
    case TrainedKind::kWidened:
      return "like one of Mip-Splatting, or enhanced already: it has lost no width, and enhance leaves it alone";
    case TrainedKind::kUnclear:
      return "neither like a classic nor an antialiased one, or changed since: enhance gives back only a little width";
    default:
      return "like a classic one: enhance gives back the width that its fit has lost";
  }
}

std::string Number(double value) {
  if (std::isnan(value)) return "-";  // of no Gaussian at all
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

constexpr size_t kMostCredit = 1000;  // bytes of one that are shown

void PrintTable(const Findings& f) {
  const CloudStatistics& s = f.statistics;
  std::cout << OneLine(f.file) << "\n"
            << "  Gaussians    " << WithThousands(s.gaussians) << ", SH degree " << s.sh_degree << "\n"
            << "  file         " << HumanBytes(f.file_bytes) << (f.format.empty() ? "" : ", " + f.format) << "\n"
            << "  render mode  " << ModeName(f.cloud) << "\n";
  if (!f.cloud.render_mode && !HasLostNoWidth(f.cloud)) {
    std::cout << "  it looks     " << InWords(f.looks) << "\n";
  }
  for (const std::string& credit : CreditsOf(f.cloud.comments)) {
    std::cout << "  credit       " << Printable(credit, kMostCredit) << "\n";
  }
  for (const auto& [name, value] : f.facts.all()) std::cout << "  " << name << "  " << value << "\n";
  if (s.bounds) {
    std::cout << "  bounds      ";
    for (size_t a = 0; a < 3; ++a) {
      std::cout << (a == 0 ? " x " : ", ")
                << (a == 1   ? "y "
                    : a == 2 ? "z "
                             : "")
                << Number(s.bounds->min[a]) << " to " << Number(s.bounds->max[a]);
    }
    std::cout << "\n";
  }
  if (f.pixel_size.ok()) {
    std::cout << "  training pixel, estimated  " << Number(f.pixel_size->estimate.size) << " (likely "
              << Number(f.pixel_size->estimate.low) << " to " << Number(f.pixel_size->estimate.high) << ")\n";
    for (const std::string& contradiction : f.pixel_size->contradictions)
      std::cout << "    but " << contradiction << "\n";
    if (f.pixel_size->contradicted()) {
      std::cout << "    so enhance would take the smallest plausible pixel, " << Number(f.pixel_size->size) << "\n";
    }
  } else {
    std::cout << "  training pixel  no estimate: " << f.pixel_size.error().message << "\n";
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
  std::cout << "\nwritten as:";
  for (const SplatFormat& format : Formats()) {
    if (format.write == nullptr || format.predicted_size == nullptr) continue;
    std::cout << "  " << format.name << (format.size_is_estimate ? " about " : " ")
              << HumanBytes(format.predicted_size(s.gaussians, s.sh_degree));
  }
  std::cout << "\n\n" << (f.problems.empty() ? "no problems found" : "found:") << "\n";
  for (const std::string& problem : f.problems) std::cout << "  - " << problem << "\n";
}

nlohmann::json ToJson(const Findings& f) {
  const CloudStatistics& s = f.statistics;
  const auto percentiles = [](const Percentiles& values) {
    nlohmann::json out;
    for (size_t k = 0; k < values.size(); ++k) out[Cat("p", std::lround(100 * kPercentiles[k]))] = values[k];
    return out;
  };
  nlohmann::json json = {{"file", f.file},
                         {"format", f.format},
                         {"facts", nlohmann::json::object()},
                         {"bytes", f.file_bytes},
                         {"gaussians", s.gaussians},
                         {"sh_degree", s.sh_degree},
                         {"bounds", nullptr},
                         {"render_mode", nullptr},
                         {"looks", nullptr},
                         {"comments", f.cloud.comments},
                         {"credits", CreditsOf(f.cloud.comments)},
                         {"largest_axis", percentiles(s.largest_axis)},
                         {"smallest_axis", percentiles(s.smallest_axis)},
                         {"axis_ratio", percentiles(s.axis_ratio)},
                         {"opacity", percentiles(s.opacity)},
                         {"pixel_size", nullptr},
                         {"counts",
                          {{"not_finite", s.not_finite},
                           {"zero_quaternions", s.zero_quaternions},
                           {"unnormalised_quaternions", s.unnormalised_quaternions},
                           {"zero_scales", s.zero_scales},
                           {"invisible", s.invisible},
                           {"implausible", s.implausible},
                           {"outliers", s.outliers}}},
                         {"linear_looking_scales", s.linear_looking_scales},
                         {"linear_looking_opacities", s.linear_looking_opacities},
                         {"problems", f.problems},
                         {"predicted_bytes", nlohmann::json::object()},
                         {"predicted_roughly", nlohmann::json::array()}};
  for (const auto& [name, value] : f.facts.all()) json["facts"][name] = value;
  if (s.bounds) json["bounds"] = {{"min", s.bounds->min}, {"max", s.bounds->max}};
  if (f.cloud.render_mode) json["render_mode"] = ModeName(f.cloud);
  if (f.looks) json["looks"] = NameOf(*f.looks);
  if (f.pixel_size.ok()) {
    json["pixel_size"] = {{"estimate", f.pixel_size->estimate.size},
                          {"low", f.pixel_size->estimate.low},
                          {"high", f.pixel_size->estimate.high},
                          {"contradictions", f.pixel_size->contradictions},
                          {"used", f.pixel_size->size}};
  }
  for (const SplatFormat& format : Formats()) {
    if (format.write == nullptr || format.predicted_size == nullptr) continue;
    json["predicted_bytes"][std::string(format.name)] = format.predicted_size(s.gaussians, s.sh_degree);
    if (format.size_is_estimate) json["predicted_roughly"].push_back(format.name);
  }
  return json;
}

// By content: gsplat keeps splats in files of the same kind, and other formats are zip archives too.
bool LooksLikeModel(const std::filesystem::path& path) {
  if (!IsFile(path)) return false;  // a pipe can be read only once
  const auto in = InputFile::Open(path);
  const auto beginning = in.ok() ? in->Head(16) : Result<std::string>(in.error());
  if (!beginning.ok() || !LooksLikeTensorFile(std::as_bytes(std::span(*beginning)))) return false;
  const auto file = TensorFile::Open(path);
  if (file.ok()) return file->Find("splats.means") == nullptr;
  const std::filesystem::path extension = path.extension();
  return extension == ".pth" || extension == ".safetensors";  // a broken one
}

// What is in a network's weights.
struct ModelFindings {
  std::map<std::string, std::string> facts;  // the file's metadata and the architecture
  std::vector<TensorSpec> learned;           // tensors of parameters
  size_t tensors = 0;                        // all
};

Result<ModelFindings> LookAtCompactNetwork(const TensorFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const CompactNetwork network, LoadCompactNetwork(file));
  ModelFindings found{file.metadata(), CompactTensors(network.config()), file.tensors().size()};
  std::erase_if(found.learned, [](const TensorSpec& tensor) { return tensor.name.starts_with("domain."); });
  for (const auto& [key, value] : ToMetadata(network.config())) found.facts[key] = value;
  return found;
}

Result<ModelFindings> LookAtCheckpoint(const std::string& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Checkpoint checkpoint, Checkpoint::Open(path));
  ModelFindings found{checkpoint.file().metadata(), PublishedTensors(checkpoint.config()),
                      checkpoint.file().tensors().size()};
  std::erase_if(found.learned, [](const TensorSpec& tensor) {
    return tensor.counter || tensor.name.ends_with("running_mean") || tensor.name.ends_with("running_var");
  });
  for (const auto& [key, value] : ArchitectureMetadata(checkpoint.config())) found.facts[key] = value;
  return found;
}

// A network's weights instead of a splat.
Status RunModelInfo(const std::string& path, const SharedFlags& shared) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorFile file, TensorFile::Open(path));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ModelFindings found,
                               IsCompactNetwork(file) ? LookAtCompactNetwork(file) : LookAtCheckpoint(path));
  int64_t parameters = 0;
  for (const TensorSpec& tensor : found.learned) {
    int64_t size = 1;
    for (const int64_t side : tensor.shape) size *= side;
    parameters += size;
  }
  if (shared.json) {
    PrintJson({{"file", path},
               {"kind", "model"},
               {"tensors", found.tensors},
               {"parameters", parameters},
               {"metadata", found.facts}});
    return {};
  }
  std::cout << OneLine(path) << "\n  parameters   " << WithThousands(parameters) << " in " << found.tensors
            << " tensors\n";
  for (const auto& [key, value] : found.facts)
    std::cout << "  " << Printable(key) << "  " << Printable(value, 2000) << "\n";
  return {};
}

struct InfoFlags {
  std::string file;
  std::string from;  // name of a format; empty: found out
};

Status RunInfo(const InfoFlags& flags, const SharedFlags& shared) {
  const std::string& path = flags.file;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SplatFormat* const from, ParseInputFormat("--from", flags.from));
  if (from == nullptr && LooksLikeModel(path)) return RunModelInfo(path, shared);
  if (from == nullptr && LooksLikeMesh(path)) return RunMeshInfo(path, shared);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedSplat file, OpenedSplat::Open(path, from));
  Findings findings;
  findings.file = path;
  findings.file_bytes = file.bytes();
  ANCHORSPLAT_ASSIGN_OR_RETURN(findings.cloud, file.Read());
  findings.format = file.format()->name;
  if (file.format()->describe != nullptr) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(findings.facts, file.format()->describe(file.input()));
  }
  findings.statistics = ComputeStatistics(findings.cloud);
  findings.looks = FindTrainedKind(findings.cloud);
  // As `enhance` takes it.
  GaussianCloud& cloud = findings.cloud;
  const bool untold = !cloud.render_mode && !HasLostNoWidth(cloud);
  if (untold && findings.looks == TrainedKind::kAntialiased) cloud.render_mode = RenderMode::kAntialiased;
  findings.pixel_size = FindPixelSize(cloud);
  if (untold) cloud.render_mode.reset();
  findings.problems = Problems(findings.statistics);
  if (shared.json) {
    PrintJson(ToJson(findings));
  } else {
    PrintTable(findings);
  }
  return {};
}

}  // namespace

void AddInfo(CLI::App& app, Program& program) {
  CLI::App& verb =
      AddVerb(app, program, "info", "What is in a splat file, a model or a mesh, and what is wrong with it",
              "anchorsplat info scan.ply --json");
  const auto flags = std::make_shared<InfoFlags>();
  verb.add_option("file", flags->file, "Splat file, checkpoint of a network, mesh, or library.sh3f[#object]")
      ->required();
  verb.add_option("--from", flags->from, kInputFormatHelp)->check(NotEmpty());
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunInfo(*flags, program.flags); }; });
}

}  // namespace anchorsplat
