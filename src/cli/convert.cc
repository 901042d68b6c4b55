#include "formats/convert.h"

#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/choice.h"
#include "cli/verb.h"
#include "core/text.h"
#include "formats/registry.h"
#include "metrics/conversion_loss.h"
#include "model/checkpoint_writer.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

struct ConvertFlags {
  std::vector<std::string> paths;  // inputs, and the output as the last one without --out-dir
  std::string out_dir;
  std::string to = ".ply";
  std::string axes;
  int views = 8;
  bool report = false;
  ConvertOptions options;
};

// "scan.compressed.ply" without the extension of its format.
std::string Stem(const fs::path& input) {
  const std::string name = input.filename().string();
  const SplatFormat* format = FormatOfExtension(input);
  size_t longest = input.extension().string().size();
  for (size_t k = 0; format != nullptr && k < format->extensions.size(); ++k) {
    const std::string_view extension = format->extensions[k];
    if (name.size() > extension.size()) longest = std::max(longest, extension.size());
  }
  return name.substr(0, name.size() - longest);
}

Result<std::vector<std::pair<fs::path, fs::path>>> Jobs(const ConvertFlags& flags, bool overwrite) {
  std::vector<std::pair<fs::path, fs::path>> jobs;
  if (flags.out_dir.empty()) {
    if (flags.paths.size() != 2) {
      return Error{ErrorCode::kBadArgument, "say IN OUT, or several inputs with --out-dir DIR"};
    }
    jobs.emplace_back(flags.paths[0], flags.paths[1]);
    return jobs;
  }
  std::map<fs::path, std::string> taken;
  for (const std::string& input : flags.paths) {
    const fs::path output = fs::path(flags.out_dir) / (Stem(input) + flags.to);
    const auto [other, fresh] = taken.emplace(output, input);
    if (!fresh) {
      return Error{ErrorCode::kBadArgument,
                   Cat(other->second, " and ", input, " would both become ", output.string(), ": rename one")};
    }
    // Checked for all before the first is read: a batch should not fail half-way on something known at its start.
    if (!overwrite && fs::exists(output)) {
      return Error{ErrorCode::kExists, Cat(output.string(), " exists; -w replaces it")};
    }
    jobs.emplace_back(input, output);
  }
  std::error_code code;
  fs::create_directories(flags.out_dir, code);
  if (code) return Error{ErrorCode::kIo, Cat(flags.out_dir, ": cannot make this folder: ", code.message())};
  return jobs;
}

nlohmann::json ToJson(const Deviation& deviation) { return {{"rms", deviation.rms}, {"max", deviation.max}}; }

nlohmann::json ToJson(const fs::path& input, const fs::path& output, const ConvertReport& r,
                      const std::optional<ConversionLoss>& loss) {
  nlohmann::json json = {{"input", input.string()},
                         {"output", output.string()},
                         {"formats", {r.input_format, r.output_format}},
                         {"gaussians", {{"in", r.gaussians_read}, {"out", r.gaussians_written}}},
                         {"sh_degree", {{"in", r.sh_degree_read}, {"out", r.sh_degree_written}}},
                         {"bytes", {{"in", r.input_bytes}, {"out", r.output_bytes}}},
                         {"seconds", {{"read", r.read_seconds}, {"write", r.write_seconds}}}};
  if (r.predicted_bytes) json["bytes"]["predicted"] = *r.predicted_bytes;
  if (r.error) {
    json["error"] = {{"compared", r.error->compared},           {"left_out", r.error->left_out},
                     {"means", ToJson(r.error->means)},         {"log_scales", ToJson(r.error->log_scales)},
                     {"rotations", ToJson(r.error->rotations)}, {"opacities", ToJson(r.error->opacities)},
                     {"colors", ToJson(r.error->colors)},       {"harmonics", ToJson(r.error->harmonics)}};
  }
  if (loss) json["psnr"] = {{"mean", loss->mean_psnr}, {"min", loss->min_psnr}, {"views", loss->views}};
  return json;
}

void Print(const fs::path& input, const fs::path& output, const ConvertReport& r,
           const std::optional<ConversionLoss>& loss) {
  std::cout << input.string() << " (" << r.input_format << ", " << HumanBytes(r.input_bytes) << ") -> "
            << output.string() << " (" << r.output_format << ", " << HumanBytes(r.output_bytes);
  if (r.predicted_bytes) std::cout << ", predicted " << HumanBytes(*r.predicted_bytes);
  std::cout << ")\n  " << WithThousands(r.gaussians_read) << " Gaussians of SH degree " << r.sh_degree_read << " in, "
            << WithThousands(r.gaussians_written) << " of degree " << r.sh_degree_written << " out; read in "
            << HumanSeconds(r.read_seconds) << ", written in " << HumanSeconds(r.write_seconds) << '\n';
  if (r.error) std::cout << FormatAttributeError(*r.error);
  if (loss) {
    std::cout << "  pictures    PSNR " << Fixed(loss->mean_psnr, 2) << " dB on average, " << Fixed(loss->min_psnr, 2)
              << " dB at worst, over " << loss->views << " views\n";
  }
}

// A network's weights, which only become .safetensors.
Status ConvertModel(const ConvertFlags& flags, const SharedFlags& shared) {
  const fs::path from = flags.paths[0], to = flags.paths[1];
  if (!shared.overwrite && fs::exists(to))
    return Error{ErrorCode::kExists, Cat(to.string(), " exists; -w replaces it")};
  ANCHORSPLAT_RETURN_IF_ERROR(ConvertCheckpoint(from, to, {.overwrite = shared.overwrite}));
  std::error_code unknown;
  const uint64_t bytes = fs::file_size(to, unknown);
  if (shared.json) {
    PrintJson(
        nlohmann::json::array({{{"input", from.string()}, {"output", to.string()}, {"bytes", {{"out", bytes}}}}}));
  } else if (!shared.quiet) {
    std::cout << from.string() << " -> " << to.string() << " (" << HumanBytes(bytes) << ")\n";
  }
  return {};
}

Status RunConvert(const ConvertFlags& flags, const SharedFlags& shared) {
  if (flags.out_dir.empty() && flags.paths.size() == 2 && fs::path(flags.paths[1]).extension() == ".safetensors") {
    return ConvertModel(flags, shared);
  }
  ConvertOptions options = flags.options;
  options.write.overwrite = shared.overwrite;
  options.measure = flags.report;
  if (!flags.axes.empty()) ANCHORSPLAT_RETURN_IF_ERROR(ParseAxes(flags.axes, options));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto jobs, Jobs(flags, shared.overwrite));
  nlohmann::json results = nlohmann::json::array();
  for (const auto& [input, output] : jobs) {
    GaussianCloud cloud;
    ANCHORSPLAT_ASSIGN_OR_RETURN(const ConvertReport report,
                                 ConvertFile(input, output, options, flags.report ? &cloud : nullptr));
    std::optional<ConversionLoss> loss;
    if (report.error) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud back, ReadCloud(output));
      ANCHORSPLAT_ASSIGN_OR_RETURN(loss, MeasureConversionLoss(cloud, back, flags.views));
    }
    results.push_back(ToJson(input, output, report, loss));
    if (!shared.json && !shared.quiet) Print(input, output, report, loss);
  }
  if (shared.json) PrintJson(results);
  return {};
}

std::string WrittenFormats() {
  std::string text;
  for (const SplatFormat& format : Formats()) {
    if (format.write != nullptr) text += Cat(text.empty() ? "" : " ", format.extensions.front());
  }
  return text;
}

}  // namespace

void AddConvert(CLI::App& app, Program& program) {
  CLI::App& verb = AddVerb(app, program, "convert", "Change the format of a splat, its size, its order",
                           "anchorsplat convert scan.ply scan.spz --report");
  const auto flags = std::make_shared<ConvertFlags>();
  ConvertOptions& options = flags->options;
  verb.add_option("paths", flags->paths,
                  Cat("IN OUT, or inputs for --out-dir. Written: ", WrittenFormats(),
                      ", and .safetensors of a network's weights"))
      ->required();
  auto* out_dir = verb.add_option("--out-dir", flags->out_dir, "Folder to write to, under the inputs' names");
  verb.add_option("--to", flags->to, "Extension of the files in --out-dir")->capture_default_str()->needs(out_dir);
  verb.add_option("--sh-degree", options.sh_degree, "Spherical harmonics to keep, 0 to 3")->check(CLI::Range(0, 3));
  verb.add_option("--min-opacity", options.min_opacity, "Drop Gaussians that are fainter, 0 to 1")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  verb.add_option("--max-gaussians", options.max_gaussians, "Keep at most so many, those of the largest size x opacity")
      ->check(CLI::PositiveNumber);
  verb.add_option("--coords", flags->axes,
                  "What the files' axes really are where they do not follow their format, as IN:OUT, for example RUB: "
                  "for a PLY with y up, :RDF for an SPZ as careless programs expect it");
  AddChoice(verb, "--sort", options.write.order,
            {{"format", SplatOrder::kFormat},
             {"keep", SplatOrder::kKeep},
             {"morton", SplatOrder::kMorton},
             {"importance", SplatOrder::kImportance}},
            "Order of the Gaussians in the file");
  verb.add_option("--spz-version", options.write.spz_version, "4, or 3 for programs that only know gzip")
      ->check(CLI::IsMember({3, 4}))
      ->capture_default_str();
  verb.add_flag("--report", flags->report, "Read the output back: attribute errors, and PSNR of pictures of both");
  verb.add_option("--report-views", flags->views, "Views around the splat for the PSNR")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunConvert(*flags, program.flags); }; });
}

}  // namespace anchorsplat
