#include "formats/convert.h"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/batch.h"
#include "cli/clean_output.h"
#include "cli/verb.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/text.h"
#include "formats/cloud_output.h"
#include "formats/opened_splat.h"
#include "formats/registry.h"
#include "io/atomic_file.h"
#include "io/input_record.h"
#include "metrics/conversion_loss.h"
#include "model/published/published_checkpoint_writer.h"
#include "request/choice.h"
#include "request/mode_option.h"
#include "request/parse.h"
#include "request/write_flags.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

struct ConvertFlags {
  bool spz_version_given = false;
  std::vector<std::string> paths;  // inputs, and the output as the last one without --out-dir
  std::string out_dir;
  std::string to = ".ply";
  std::string from;
  std::optional<std::string> axes;
  int views = 8;
  bool report = false;
  ConvertOptions options;
};

// "scan.compressed.ply" without the extension of its format; "scan/meta.json", or "scan" where that is in it, is the
// folder's name.
std::string Stem(const fs::path& input) {
  const fs::path found = SplatPath(input);
  if (found.filename() == "meta.json" && found.has_parent_path()) {
    const std::string folder = RealPath(found.parent_path()).filename().string();
    return folder.empty() ? "meta" : folder;
  }
  const std::string name = input.filename().string();
  const SplatFormat* format = FormatOfExtension(input);
  size_t longest = input.extension().string().size();
  for (size_t k = 0; format != nullptr && k < format->extensions.size(); ++k) {
    const std::string_view extension = format->extensions[k];
    if (name.size() > extension.size()) longest = std::max(longest, extension.size());
  }
  return name.substr(0, name.size() - longest);
}

std::string WrittenFormats() {
  std::string text;
  for (const SplatFormat& format : Formats()) {
    if (format.write != nullptr) text += Cat(text.empty() ? "" : " ", format.extensions.front());
  }
  return text;
}

struct Job {
  fs::path input, output;
};

Result<std::vector<Job>> Jobs(const ConvertFlags& flags, bool overwrite) {
  std::vector<Job> jobs;
  if (flags.out_dir.empty()) {
    if (flags.paths.size() != 2) {
      return Error{ErrorCode::kBadArgument, "say IN OUT, or several inputs with --out-dir DIR"};
    }
    jobs.push_back({flags.paths[0], flags.paths[1]});
    return jobs;
  }
  // Folders of pictures get one folder each; ".spz" may be said without its dot. A slash would lead out of --out-dir.
  const bool folders = flags.to == "meta.json";
  const std::string extension = folders ? "/meta.json" : flags.to.starts_with('.') ? flags.to : "." + flags.to;
  const bool leads_away = !folders && extension.find('/') != std::string::npos;
  const SplatFormat* const format = leads_away ? nullptr : FormatOfExtension(fs::path("x" + extension));
  if (format == nullptr || format->write == nullptr) {
    return Error{ErrorCode::kBadArgument,
                 Cat("--to: '", Printable(flags.to), "' is no format that is written; written are ", WrittenFormats())};
  }
  std::vector<fs::path> inputs, outputs;
  for (const std::string& input : flags.paths) {
    inputs.emplace_back(input);
    outputs.push_back(fs::path(flags.out_dir) / (Stem(input) + extension));
  }
  // Those that are read later are inputs already when the first output is written.
  for (const fs::path& input : inputs) RecordSplat(input);
  std::map<fs::path, std::string> taken;
  for (size_t k = 0; k < inputs.size(); ++k) {
    const std::string& input = flags.paths[k];
    const fs::path& output = outputs[k];
    const auto [other, fresh] = taken.emplace(output, input);
    if (!fresh) {
      return Error{ErrorCode::kBadArgument,
                   Cat(other->second, " and ", input, " would both become ", output.string(), ": rename one")};
    }
    // Checked for all before the first is read: a batch should not fail half-way on something known at its start.
    for (const fs::path& file : FilesOfCloud(output, kMaxShDegree)) ANCHORSPLAT_RETURN_IF_ERROR(CheckIsNoInput(file));
    if (!overwrite && Exists(output)) {
      return Error{ErrorCode::kExists, Cat(output.string(), " exists; -w replaces it")};
    }
    jobs.push_back({input, output});
  }
  for (const Job& job : jobs) {
    std::error_code code;
    fs::create_directories(job.output.parent_path(), code);
    if (code) {
      return Error{ErrorCode::kIo,
                   Cat(job.output.parent_path().string(), ": cannot make this folder: ", code.message())};
    }
  }
  return jobs;
}

nlohmann::json ToJson(const Deviation& deviation) { return {{"rms", deviation.rms}, {"max", deviation.max}}; }

nlohmann::json ToJson(const Job& job, const ConvertReport& r, const std::optional<ConversionLoss>& loss) {
  nlohmann::json json = {{"input", job.input.string()},
                         {"output", job.output.string()},
                         {"formats", {r.input_format, r.output_format}},
                         {"gaussians", {{"in", r.gaussians_read}, {"out", r.gaussians_written}}},
                         {"sh_degree", {{"in", r.sh_degree_read}, {"out", r.sh_degree_written}}},
                         {"bytes", {{"in", r.input_bytes}, {"out", r.output_bytes}}},
                         {"seconds", {{"read", r.read_seconds}, {"write", r.write_seconds}}}};
  if (r.predicted_bytes) {
    json["bytes"]["predicted"] = *r.predicted_bytes;
    json["bytes"]["predicted_roughly"] = r.predicted_roughly;
  }
  if (r.error) {
    json["error"] = {{"compared", r.error->compared},           {"left_out", r.error->left_out},
                     {"means", ToJson(r.error->means)},         {"log_scales", ToJson(r.error->log_scales)},
                     {"rotations", ToJson(r.error->rotations)}, {"opacities", ToJson(r.error->opacities)},
                     {"colors", ToJson(r.error->colors)},       {"harmonics", ToJson(r.error->harmonics)}};
  }
  if (loss) json["psnr"] = {{"mean", loss->mean_psnr}, {"min", loss->min_psnr}, {"views", loss->views}};
  return json;
}

void Print(const Job& job, const ConvertReport& r, const std::optional<ConversionLoss>& loss) {
  std::cout << OneLine(job.input) << " (" << r.input_format << ", " << HumanBytes(r.input_bytes) << ") -> "
            << OneLine(job.output) << " (" << r.output_format << ", " << HumanBytes(r.output_bytes);
  if (r.predicted_bytes) {
    std::cout << ", predicted " << (r.predicted_roughly ? "about " : "") << HumanBytes(*r.predicted_bytes);
  }
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
  RecordInput(from);
  ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(to, shared.overwrite));
  ANCHORSPLAT_RETURN_IF_ERROR(ConvertCheckpoint(from, to, {.overwrite = shared.overwrite}));
  std::error_code unknown;
  const uint64_t bytes = fs::file_size(to, unknown);
  if (shared.json) {
    PrintJson(
        nlohmann::json::array({{{"input", from.string()}, {"output", to.string()}, {"bytes", {{"out", bytes}}}}}));
  } else if (!shared.quiet) {
    std::cout << OneLine(from) << " -> " << OneLine(to) << " (" << HumanBytes(bytes) << ")\n";
  }
  return {};
}

// One file: converted, measured where asked for, told. A row of the JSON document.
Result<nlohmann::json> RunJob(const Job& job, const ConvertOptions& options, int views, const SharedFlags& shared) {
  GaussianCloud cloud;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ConvertReport report,
                               ConvertFile(job.input, job.output, options, options.measure ? &cloud : nullptr));
  std::optional<ConversionLoss> loss;
  if (report.error) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud back, ReadCloud(job.output));
    ANCHORSPLAT_ASSIGN_OR_RETURN(loss, MeasureConversionLoss(cloud, back, views));
  } else if (options.measure) {
    LogWarning(Cat(job.output.string(), ": ", report.output_format,
                   " is only written, not read: --report has nothing to compare"));
  }
  if (!shared.json && !shared.quiet) Print(job, report, loss);
  return ToJson(job, report, loss);
}

Status RunConvert(const ConvertFlags& flags, Program& program) {
  const SharedFlags& shared = program.flags;
  if (flags.out_dir.empty() && flags.paths.size() == 2 && fs::path(flags.paths[1]).extension() == ".safetensors") {
    return ConvertModel(flags, shared);
  }
  ConvertOptions options = flags.options;
  options.write.overwrite = shared.overwrite;
  options.measure = flags.report;
  ANCHORSPLAT_ASSIGN_OR_RETURN(options.input_format, ParseInputFormat("--from", flags.from));
  if (flags.axes) {
    const Status axes = ParseAxes(*flags.axes, options);
    if (!axes.ok()) return Error{axes.error().code, Cat("--coords: ", axes.error().message)};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto jobs, Jobs(flags, shared.overwrite));
  const auto is_spz = [](const Job& job) { return job.output.extension() == ".spz"; };
  if (flags.spz_version_given && std::none_of(jobs.begin(), jobs.end(), is_spz)) {
    return Error{ErrorCode::kBadArgument, "--spz-version has no effect here; it has one where a .spz is written"};
  }
  const auto says_mode = [](const Job& job) {
    const SplatFormat* const format = FormatOfExtension(job.output);
    return format != nullptr && format->mode_tag != ModeTag::kNone;
  };
  if (options.render_mode && std::none_of(jobs.begin(), jobs.end(), says_mode)) {
    return Error{ErrorCode::kBadArgument,
                 "--mode has no effect here; it has one where a file is written that has a place for it (.ply, "
                 ".compressed.ply, .spz, .sog)"};
  }
  std::vector<BatchItem> items;
  for (const Job& job : jobs) items.push_back({job.input.string(), job.output.string()});
  return RunBatch(
      items, [&](size_t k) { return RunJob(jobs[k], options, flags.views, shared); }, program);
}

}  // namespace

void AddConvert(CLI::App& app, Program& program) {
  CLI::App& verb = AddVerb(app, program, "convert", "Change the format of a splat, its size, its order",
                           "anchorsplat convert scan.ply scan.spz --report");
  const auto flags = std::make_shared<ConvertFlags>();
  ConvertOptions& options = flags->options;
  verb.add_option("paths", flags->paths,
                  Cat("IN OUT, or inputs for --out-dir; - is standard input. Written: ", WrittenFormats(),
                      ", and .safetensors of a network's weights"))
      ->required();
  auto* out_dir = verb.add_option("--out-dir", flags->out_dir, "Folder to write to, under the inputs' names");
  verb.add_option("--to", flags->to, "Extension of the files in --out-dir; meta.json makes a folder of each")
      ->capture_default_str()
      ->needs(out_dir);
  verb.add_option("--from", flags->from, kInputFormatHelp)->check(NotEmpty());
  AddModeOption(verb, options.render_mode,
                "How the splat is rasterized, for a tag in the output (default: as the input says)");
  verb.add_option("--sh-degree", options.sh_degree, "Spherical harmonics to keep, 0 to 3")->check(CLI::Range(0, 3));
  verb.add_option("--min-opacity", options.min_opacity, "Drop Gaussians that are fainter, 0 to 1")
      ->check(Fraction())
      ->capture_default_str();
  verb.add_option("--max-gaussians", options.max_gaussians, "Keep at most so many, those of the largest size x opacity")
      ->check(AtLeastOne());
  verb.add_option("--coords", flags->axes,
                  "What the files' axes really are where they do not follow their format, as IN:OUT, for example RUB: "
                  "for a PLY with y up, :RDF for an SPZ as careless programs expect it")
      ->check(NotEmpty());
  auto* spz_version = AddWriteFlags(verb, options.write);
  auto* report =
      verb.add_flag("--report", flags->report, "Read the output back: attribute errors, and PSNR of pictures of both");
  verb.add_option("--report-views", flags->views, "Views around the splat for the PSNR")
      ->check(CLI::Range(1, 1000))
      ->needs(report)
      ->capture_default_str();
  verb.callback([flags, spz_version, &program] {
    flags->spz_version_given = spz_version->count() > 0;
    program.run = [flags, &program] { return RunConvert(*flags, program); };
  });
}

}  // namespace anchorsplat
