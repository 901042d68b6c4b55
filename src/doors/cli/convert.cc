#include "formats/convert.h"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/batch.h"
#include "cli/clean_output.h"
#include "cli/edit_steps_report.h"
#include "cli/help.h"
#include "cli/output_plan.h"
#include "cli/standard_output.h"
#include "cli/stop_signal.h"
#include "cli/verb.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/memory_limit.h"
#include "core/parallel.h"
#include "core/text.h"
#include "formats/cloud_output.h"
#include "formats/opened_splat.h"
#include "formats/registry.h"
#include "formats/wrapped_splat.h"
#include "io/atomic_file.h"
#include "io/input_record.h"
#include "published/published_checkpoint_writer.h"
#include "request/choice.h"
#include "request/convert_flags.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr double kSecondsToRead = 2e-7;  // a Gaussian, on one core
constexpr std::string_view kStreamedName = "lod-meta.json";

struct ConvertWords {
  std::vector<std::string> paths;  // inputs, and the output as the last one without --out-dir
  std::string out_dir;
  std::string to = ".ply";
  const CLI::Option* to_option = nullptr;
  bool lod = false;
  ConvertFlags how;
  SizeFlags size;
  const StandardOutput* piped = nullptr;  // destination of the single output
};

// "scan.compressed.ply" without its extension; the folder's name for "scan/meta.json", or for a "scan" that contains
// it.
std::string Stem(const fs::path& input) {
  const fs::path found = SplatPath(input);
  if ((found.filename() == "meta.json" || found.filename() == "lod-meta.json") && found.has_parent_path()) {
    const std::string folder = RealPath(found.parent_path()).filename().string();
    return folder.empty() ? "meta" : folder;
  }
  const fs::path plain = WithoutPacking(input.filename());
  const std::string name = plain.string();
  const SplatFormat* format = FormatOfExtension(plain);
  size_t longest = plain.extension().string().size();
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
  std::vector<fs::path> inputs;
  fs::path output;
  size_t output_at = 0;    // among the paths, from 1; 0: not among them
  bool has_output = true;  // else `output` is only for the report
};

Result<std::vector<Job>> Jobs(const ConvertWords& flags, bool overwrite) {
  std::vector<Job> jobs;
  if (flags.out_dir.empty()) {
    const size_t count = flags.paths.size();
    if (count < 2 && flags.how.edits.dry_run) {  // nothing is written, so no output is needed
      jobs.push_back({.inputs = {flags.paths[0]}, .output = "dry-run.ply", .has_output = false});
      return jobs;
    }
    if (count < 2) return Error{ErrorCode::kBadArgument, "pass IN OUT, or inputs with --out-dir DIR"};
    jobs.push_back({{flags.paths.begin(), flags.paths.end() - 1},
                    flags.piped != nullptr ? flags.piped->path() : fs::path(flags.paths.back()),
                    count});
    if (!flags.lod) return jobs;
    // A folder ("scene.v2" is one) stands for its lod-meta.json.
    fs::path& output = jobs.back().output;
    if (IsFolder(output) || FormatOfExtension(output) == nullptr) output /= kStreamedName;
    if (output.filename() == kStreamedName) return jobs;
    return Error{ErrorCode::kBadArgument,
                 Cat("--lod needs a folder, or lod-meta.json in one, as OUT, not ", output.string())};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckOutDir(flags.out_dir));
  // SOG gets one folder each; the dot of ".spz" is optional. A slash would lead out of --out-dir.
  const bool folders = flags.lod || flags.to == "meta.json" || flags.to == kStreamedName;
  const std::string extension = flags.lod                   ? Cat("/", kStreamedName)
                                : folders                   ? "/" + flags.to
                                : flags.to.starts_with('.') ? flags.to
                                                            : "." + flags.to;
  const bool leads_away = !folders && extension.find('/') != std::string::npos;
  const SplatFormat* const format = leads_away ? nullptr : FormatOfExtension(fs::path("x" + extension));
  if (format == nullptr || format->write == nullptr) {
    return Error{ErrorCode::kBadArgument,
                 Cat("--to: '", Printable(flags.to), "' cannot be written; supported: ", WrittenFormats())};
  }
  std::vector<fs::path> inputs, outputs;
  for (const std::string& input : flags.paths) {
    inputs.emplace_back(input);
    outputs.push_back(fs::path(flags.out_dir) / (Stem(input) + extension));
  }
  // All inputs must be recorded before the first output is written.
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
    // Checks all before reading the first, so that a batch does not fail half-way.
    for (const fs::path& file : FilesOfCloud(output, kMaxShDegree)) ANCHORSPLAT_RETURN_IF_ERROR(CheckNotInput(file));
    if (!overwrite && !flags.how.edits.dry_run && Exists(output)) {
      return Error{ErrorCode::kExists, Cat(output.string(), " exists; -w replaces it")};
    }
    jobs.push_back({{input}, output});
  }
  for (const Job& job : jobs) {
    if (flags.how.edits.dry_run) break;
    std::error_code code;
    fs::create_directories(job.output.parent_path(), code);
    if (code) {
      return Error{ErrorCode::kIo,
                   Cat(job.output.parent_path().string(), ": cannot create this folder: ", code.message())};
    }
  }
  return jobs;
}

// "scan.ply", or "scan.ply and 2 more".
std::string NamesOf(const Job& job) {
  std::string names = OneLine(job.inputs[0]);
  if (job.inputs.size() > 1) names += Cat(" and ", job.inputs.size() - 1, " more");
  return names;
}

void Print(const OutputMemory* piped, const Job& job, const Converted& done) {
  const ConvertReport& r = done.report;
  std::ostream& out = ResultsBeside(piped);
  out << NamesOf(job) << " (" << r.input_format << ", " << HumanBytes(r.input_bytes) << ")";
  if (done.dry_run) {
    if (job.has_output) out << " -> " << OutputName(job.output, piped);
    out << "\n  " << WithThousands(r.gaussians_read) << " Gaussians of SH degree " << r.sh_degree_read << " in, "
        << WithThousands(r.gaussians_written) << " of degree " << r.sh_degree_written << " out";
    if (r.predicted_bytes) {
      out << " (" << r.output_format << ", " << (r.predicted_roughly ? "about " : "") << HumanBytes(*r.predicted_bytes)
          << ")";
    }
    out << "; nothing was written\n";
    PrintSteps(done.steps, out);
    return;
  }
  out << " -> " << OutputName(job.output, piped) << " (" << r.output_format << ", " << HumanBytes(r.output_bytes);
  if (r.predicted_bytes) {
    out << ", predicted " << (r.predicted_roughly ? "about " : "") << HumanBytes(*r.predicted_bytes);
  }
  out << ")\n  " << WithThousands(r.gaussians_read) << " Gaussians of SH degree " << r.sh_degree_read << " in, "
      << WithThousands(r.gaussians_written) << " of degree " << r.sh_degree_written << " out; read in "
      << HumanSeconds(r.read_seconds) << ", written in " << HumanSeconds(r.write_seconds) << '\n';
  PrintSteps(done.steps, out);
  if (r.error) out << FormatAttributeError(*r.error);
  if (const auto& loss = done.loss) {
    out << "  pictures    PSNR " << Fixed(loss->mean_psnr, 2) << " dB on average, " << Fixed(loss->min_psnr, 2)
        << " dB at worst, over " << loss->views << " views\n";
  }
}

// Network weights become .safetensors only.
Status ConvertModel(const ConvertWords& flags, const SharedFlags& shared) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto edits, ActionsAmongPaths(flags.how.edits));
  if (flags.how.edits.dry_run || std::ranges::any_of(edits, [](const auto& actions) { return !actions.empty(); })) {
    return Error{ErrorCode::kBadArgument, "edits and --dry-run work on splats, not on a network's .safetensors"};
  }
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

// Predicted output, from the header.
std::optional<OutputPlan> PlanOf(const ConvertOptions& options, const Job& job) {
  const SplatFormat* const to = FormatOfExtension(job.output);
  if (to == nullptr || to->predicted_size == nullptr) return std::nullopt;
  CloudExtent all;
  for (const fs::path& input : job.inputs) {
    const std::optional<CloudExtent> extent = ExtentOf(input, options.input_format);
    if (!extent) return std::nullopt;
    all.gaussians += extent->gaussians;
    all.sh_degree = std::max(all.sh_degree, extent->sh_degree);
  }
  OutputPlan plan{.input = NamesOf(job), .output = job.output, .gaussians_in = all.gaussians};
  plan.gaussians = std::min(all.gaussians, options.max_gaussians.value_or(all.gaussians));
  const int degree = options.sh_degree.value_or(all.sh_degree);
  plan.bytes = to->predicted_size(plan.gaussians, degree);
  plan.roughly = to->size_is_estimate;
  plan.needed = static_cast<uint64_t>(all.gaussians) * RowBytes(all.sh_degree);
  plan.seconds = static_cast<double>(plan.gaussians) * (to->seconds_per_gaussian + kSecondsToRead) / ThreadCount();
  return plan;
}

// Converts, measures and reports one file. Returns its row of the JSON document.
Result<nlohmann::json> RunJob(const Job& job, const EditJob& edits, int views, const SharedFlags& shared) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Converted done, ConvertAndMeasure(edits, job.output, views));
  if (!shared.json && (!shared.quiet || done.dry_run)) Print(edits.convert.write.memory, job, done);
  nlohmann::json json = ToJson(done);
  json["input"] = job.inputs[0].string();
  for (const fs::path& input : job.inputs) {
    if (job.inputs.size() > 1) json["inputs"].push_back(input.string());
  }
  if (job.has_output) json["output"] = job.output.string();
  return json;
}

Status RunJobs(const ConvertWords& flags, Program& program) {
  const SharedFlags& shared = program.flags;
  if (flags.out_dir.empty() && flags.paths.size() == 2 && fs::path(flags.paths[1]).extension() == ".safetensors") {
    return ConvertModel(flags, shared);
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(ConvertOptions options, MakeConvertOptions(flags.how, shared.overwrite));
  if (flags.piped != nullptr) options.write.memory = flags.piped->memory();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto jobs, Jobs(flags, shared.overwrite));
  std::vector<fs::path> outputs;
  for (const Job& job : jobs) outputs.push_back(job.output);
  ANCHORSPLAT_RETURN_IF_ERROR(CheckConvertEffects(flags.how, outputs));
  std::vector<EditJob> edits;
  for (const Job& job : jobs) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(EditJob edit, MakeEditJob(flags.how.edits, job.inputs, job.output_at, options));
    edits.push_back(std::move(edit));
  }
  std::vector<BatchItem> items;
  for (const Job& job : jobs) items.push_back({job.inputs[0].string(), job.output.string()});
  std::vector<OutputPlan> plans;
  for (const Job& job : jobs) {
    if (flags.how.edits.dry_run) break;
    if (std::optional<OutputPlan> plan = PlanOf(options, job)) plans.push_back(*std::move(plan));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(SayAndAsk(plans, flags.size, shared));
  const StopSignal stop_signal(StopSignal::Leaves::kNothing);
  const auto run = [&](size_t k) {
    fs::path folder = jobs[k].output.parent_path();
    if (!folder.empty() && !IsFolder(folder)) folder = folder.parent_path();  // created with the output
    const MemoryLimit limit(flags.size.arrays(), folder);
    return RunJob(jobs[k], edits[k], flags.how.views, shared);
  };
  return RunBatch(items, run, program);
}

Status RunConvert(const ConvertWords& flags, Program& program) {
  const bool is_piped = flags.out_dir.empty() && flags.paths.size() >= 2 && IsStandardOutput(flags.paths.back());
  if (!is_piped && flags.out_dir.empty() && flags.to_option->count() > 0) {
    return Error{ErrorCode::kBadArgument, "--to works only with --out-dir or the output -"};
  }
  if (!is_piped) return RunJobs(flags, program);
  if (flags.to_option->count() == 0) {
    return Error{ErrorCode::kBadArgument, "the output - needs a format, such as --to .ply"};
  }
  if (flags.lod) return Error{ErrorCode::kBadArgument, "--lod writes several files, and standard output is one"};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const StandardOutput piped, StandardOutput::ForSplat(flags.to, program.flags));
  ConvertWords words = flags;
  words.piped = &piped;
  ANCHORSPLAT_RETURN_IF_ERROR(RunJobs(words, program));
  return piped.Send();
}

}  // namespace

void AddConvert(CLI::App& app, Program& program) {
  CLI::App& verb = AddVerb(app, program, "convert", "Convert, shrink, sort, transform, crop, clean and merge splats",
                           "anchorsplat convert scan.ply scan.spz --report");
  const auto flags = std::make_shared<ConvertWords>();
  flags->how.edits.paths =
      verb.add_option("paths", flags->paths,
                      Cat("IN OUT; several IN and OUT to merge them; or only inputs, with --out-dir. - is standard "
                          "input or output. Writes ",
                          WrittenFormats(), ", and a network's weights as .safetensors"))
          ->required();
  verb.add_option("--out-dir", flags->out_dir, "Output folder; files keep the names of the inputs")
      ->type_name("FOLDER");
  flags->to_option =
      verb.add_option("--to", flags->to,
                      "Format of files in --out-dir or of standard output, by extension; meta.json and lod-meta.json "
                      "make a folder each")
          ->type_name("FORMAT")
          ->capture_default_str();
  verb.add_flag(
      "--lod", flags->lod,
      "Write a streamed SOG with levels of detail: OUT is a folder. An OUT named lod-meta.json needs no --lod");
  flags->how.AddTo(verb);
  flags->size.AddTo(verb);
  ShortenHelp(verb, {"--out-dir", "--to", "--sh-degree", "--min-opacity", "--max-gaussians", "--lod", "--report",
                     "--translate", "--rotate", "--scale", "--up", "--filter-box", "--filter-sphere",
                     "--filter-floaters", "--action-axes", "--dry-run", "--overwrite", "--quiet", "--json"});
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunConvert(*flags, program); }; });
}

}  // namespace anchorsplat
