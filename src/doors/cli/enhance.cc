#include "enhance/enhance.h"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/batch.h"
#include "cli/before_after_page.h"
#include "cli/clean_output.h"
#include "cli/help.h"
#include "cli/named_messages.h"
#include "cli/output_plan.h"
#include "cli/standard_output.h"
#include "cli/stop_signal.h"
#include "cli/verb.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/memory_limit.h"
#include "core/parallel.h"
#include "core/row_arrays.h"
#include "core/splat_comments.h"
#include "core/text.h"
#include "core/world_up.h"
#include "enhance/gaussian_budget.h"
#include "fit/checkpoint_guard.h"
#include "fit/fitter.h"
#include "formats/cloud_output.h"
#include "formats/extra_properties.h"
#include "formats/opened_splat.h"
#include "formats/registry.h"
#include "formats/wrapped_splat.h"
#include "io/atomic_file.h"
#include "io/input_record.h"
#include "request/choice.h"
#include "request/enhance_flags.h"
#include "request/words.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

struct EnhanceWords {
  std::vector<std::string> inputs;
  std::string output;
  std::string out_dir;
  EnhanceFlags how;
  SizeFlags size;
  bool view = false;
  std::string to = ".ply";
  const CLI::Option* to_option = nullptr;
  const StandardOutput* piped = nullptr;  // destination of the single output

  OutputMemory* memory() const { return piped != nullptr ? piped->memory() : nullptr; }
};

// Of neighbours, their frames and the choice of copies, per Gaussian of the input; measured (docs/benchmarks.md).
constexpr uint64_t kWorkingBytes = 300;

// Bytes of arrays that exist at the same time if `worked` Gaussians are enhanced.
uint64_t NeededBytes(int64_t in, int64_t worked, int64_t out, int sh_degree) {
  const uint64_t own = static_cast<uint64_t>(in) * RowBytes(sh_degree);
  if (out <= in) return own;  // changed in place
  const uint64_t made = static_cast<uint64_t>(out) * RowBytes(sh_degree);
  return std::max(own + static_cast<uint64_t>(worked) * kWorkingBytes + made,
                  2 * made);  // reordered at the end
}

// Checks that need no input.
Status CheckOutput(const fs::path& output, const CloudWriteOptions& write) {
  const SplatFormat* format = FormatOfExtension(output);
  if (format == nullptr || format->write == nullptr) {
    std::string known;
    for (const SplatFormat& f : Formats()) {
      if (f.write != nullptr) known += Cat(" ", f.extensions.front());
    }
    return Error{ErrorCode::kBadArgument, Cat(output.string(), ": cannot write this format; supported:", known)};
  }
  return CheckCanWriteCloud(output, 0, write);
}

// Checkpoint of a run for this output, and how to recognise one.
struct Checkpoint {
  fs::path path;  // empty: no checkpoint
  bool (*is_checkpoint)(const fs::path&) = nullptr;
};

Checkpoint CheckpointOf(const EnhanceWords& flags, const EnhanceOptions& options, const fs::path& output) {
  if (flags.piped != nullptr && options.control.checkpoint.empty()) return {};  // standard output has no folder
  const auto plan = PlanEnhancement(options);
  if (!plan.ok() || !plan->KeepsCheckpoint(options)) return {};
  return {options.control.checkpoint.empty() ? fs::path(output.string() + ".checkpoint") : options.control.checkpoint,
          plan->method->is_checkpoint};
}

// All files written for an output.
std::vector<fs::path> OutputFiles(const EnhanceWords& flags, const fs::path& output) {
  std::vector<fs::path> files = FilesOfCloud(output, kMaxShDegree);
  if (flags.view) files.push_back(PagePath(output));
  return files;
}

// Output of each input. No two may be the same.
Result<std::vector<fs::path>> OutputPaths(const EnhanceWords& flags) {
  if (flags.output.empty() == flags.out_dir.empty()) {
    return Error{ErrorCode::kBadArgument, "no output: pass -o FILE for one input, --out-dir DIR for several"};
  }
  for (const std::string& input : flags.inputs) RecordSplat(input);
  if (!flags.output.empty()) {
    if (flags.inputs.size() > 1) {
      return Error{ErrorCode::kBadArgument,
                   Cat(flags.inputs.size(), " inputs but one -o file: pass --out-dir DIR instead")};
    }
    return std::vector<fs::path>{flags.output};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckOutDir(flags.out_dir));
  std::vector<fs::path> outputs;
  std::map<fs::path, std::string> taken;
  for (const std::string& input : flags.inputs) {
    const fs::path output = fs::path(flags.out_dir) / WithoutPacking(fs::path(input).filename());
    const auto [other, fresh] = taken.emplace(output, input);
    if (!fresh) {
      return Error{ErrorCode::kBadArgument,
                   Cat(other->second, " and ", input, " would both become ", output.string(), ": rename one")};
    }
    outputs.push_back(output);
  }
  return outputs;
}

Status MakeOutDir(const EnhanceWords& flags) {
  if (flags.out_dir.empty()) return {};
  std::error_code code;
  fs::create_directories(flags.out_dir, code);
  if (code) return Error{ErrorCode::kIo, Cat(flags.out_dir, ": cannot create this folder: ", code.message())};
  return {};
}

// Predicted size and time. `outside`: number of Gaussians outside the region, which stay unchanged.
OutputPlan PlanOf(const EnhanceOptions& options, const std::string& input, const fs::path& output,
                  const CloudExtent& extent, int64_t outside = 0) {
  const SplatFormat& to = *FormatOfExtension(output);
  OutputPlan plan{.input = input, .output = output, .gaussians_in = extent.gaussians};
  const int64_t worked = extent.gaussians - outside;
  EnhanceOptions within = options;
  if (options.max_gaussians > outside) SetBudget(within, options.max_gaussians - outside);
  plan.gaussians = outside + std::max<int64_t>(0, ExpectedGaussians(worked, within));
  if (to.predicted_size != nullptr) plan.bytes = to.predicted_size(plan.gaussians, extent.sh_degree);
  plan.roughly = to.size_is_estimate;
  plan.needed = NeededBytes(extent.gaussians, worked, plan.gaussians, extent.sh_degree);
  plan.seconds = ExpectedSeconds(worked, options, ThreadCount());
  if (plan.seconds) *plan.seconds += static_cast<double>(plan.gaussians) * to.seconds_per_gaussian;
  return plan;
}

int64_t CountOutside(const std::optional<Region>& region, const GaussianCloud& cloud) {
  int64_t outside = 0;
  if (!region) return 0;
  const Region from_origin = RelativeToOrigin(*region, cloud.origin);
  for (int64_t i = 0; i < cloud.size(); ++i) outside += from_origin.Contains(cloud.means.data() + 3 * i) ? 0 : 1;
  return outside;
}

std::string SourceInWords(PixelSizeSource source) {
  if (source == PixelSizeSource::kRead) return "estimated";
  const bool measured = source == PixelSizeSource::kCameras || source == PixelSizeSource::kPictures;
  return Cat(measured ? "from " : "", NameOf(source));
}

// What the method worked with; empty if it needs no pixel size.
std::string Details(const EnhanceReport& r) {
  if (r.pixel_size_source == PixelSizeSource::kNone) return "";
  if (r.pixel_size_source == PixelSizeSource::kUnknown) return ", left unchanged";
  const char* invented = IsInvented(r) ? ", detail invented" : "";
  if (r.filter_strength == 0) return *invented != 0 ? Cat(" ", r.upscale, "x", invented) : ", left unchanged";
  return Cat(" ", r.upscale, "x", invented, ", filter strength ", Fixed(r.filter_strength, 2), ", pixel size ",
             r.pixel_size, " (", SourceInWords(r.pixel_size_source), ")");
}

// Removes the extras of unusable Gaussians. Returns the means of the others, to check later whether the Gaussians are
// still the same; empty if there are no extras.
Buffer<float> KeepUsable(ExtraProperties& extras, const GaussianCloud& cloud) {
  if (extras.empty()) return {};
  std::vector<char> usable(static_cast<size_t>(cloud.size()));
  for (size_t i = 0; i < usable.size(); ++i) usable[i] = IsUsable(cloud, static_cast<int64_t>(i)) ? 1 : 0;
  Buffer<float> means = cloud.means;
  KeepRows(means, 3, usable);
  KeepRows(extras, usable);
  return means;
}

// Bad values came from a file: names it.
Error Of(const std::string& input, Error error) {
  if (error.code == ErrorCode::kBadFile && error.message.starts_with(kNoneUsable)) {
    error.message = Cat(input, ": ", error.message);
  }
  return error;
}

// After an interruption, adds how to continue.
Error WithWayOn(Error error, const fs::path& checkpoint) {
  if (error.code == ErrorCode::kInterrupted && !checkpoint.empty() && Exists(checkpoint)) {
    error.message += Cat("; to continue, add --resume, which reads ", checkpoint.string());
  }
  return error;
}

// What is known about how large the output becomes.
enum class Forecast { kUnknown, kAccepted, kSaid };

// Enhances one file; returns its row of the results.
Result<nlohmann::json> EnhanceOne(const EnhanceWords& flags, const SharedFlags& shared, EnhanceOptions options,
                                  const std::string& input, const fs::path& output, Forecast forecast) {
  const DeviceUse device;
  const MemoryLimit limit(flags.size.arrays(), output.parent_path());
  std::optional<StopSignal> stop_signal(std::in_place, StopSignal::Leaves::kNothing);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedSplat file, OpenedSplat::Open(input));
  ExtraProperties extras;
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud cloud, file.Read({}, &extras));
  stop_signal.reset();  // so that Ctrl-C ends the question
  const OutputPlan plan =
      PlanOf(options, input, output, {cloud.size(), cloud.sh_degree}, CountOutside(options.region, cloud));
  bool said = forecast == Forecast::kSaid;
  if (forecast == Forecast::kUnknown) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(said, AskIfLarge({&plan, 1}, flags.size, shared));
  }
  if (!said) options.starting = [&plan, &flags] { Say(plan, flags.size); };
  Buffer<float> means = KeepUsable(extras, cloud);
  GaussianCloud before;
  if (flags.view) {
    ANCHORSPLAT_RETURN_IF_ERROR(CheckPageFits(output, cloud, options));
    before = cloud;
  }
  const CloudWriteOptions write{.overwrite = shared.overwrite, .memory = flags.memory()};
  // Again, now that files beside the inputs are known.
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCanWriteCloud(output, cloud.sh_degree, write));
  const auto [checkpoint, is_checkpoint] = CheckpointOf(flags, options, output);
  options.control.checkpoint = checkpoint;
  options.control.outputs = OutputFiles(flags, output);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto lock, HoldCheckpoint(checkpoint));
  const bool leaves_something = !checkpoint.empty();
  stop_signal.emplace(leaves_something ? StopSignal::Leaves::kWhatIsDone : StopSignal::Leaves::kNothing);
  auto result = Enhance(std::move(cloud), options);
  if (leaves_something) stop_signal.reset();
  if (!result.ok()) return WithWayOn(Of(input, result.error()), checkpoint);
  Enhanced enhanced = *std::move(result);
  if (!extras.empty() && enhanced.report.cleaned) {
    std::vector<char> kept(means.size() / 3, 1);
    for (const int64_t i : enhanced.report.cleaned->rows) kept[static_cast<size_t>(i)] = 0;
    KeepRows(means, 3, kept);
    KeepRows(extras, kept);
  }
  if (!extras.empty() && enhanced.cloud.means != means) {
    if (const std::string lost = extras.lost(/*writer_keeps=*/false); !lost.empty()) {
      LogWarning(Cat(input, ": extra properties dropped, as the Gaussians changed: ", lost));
    }
    extras = {};
  }
  if (options.cameras && !UpOf(enhanced.cloud.comments)) {
    if (const auto up = WorldUp(options.cameras->cameras)) enhanced.cloud.comments.push_back(UpComment(*up));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(WriteCloudOrSaveBeside(output, enhanced.cloud, write, extras));
  const EnhanceReport& r = enhanced.report;
  before.render_mode = enhanced.cloud.render_mode;  // both as trained
  if (flags.view) ANCHORSPLAT_RETURN_IF_ERROR(WritePage(input, before, output, enhanced, WriteOptionsFrom(shared)));
  if (r.interrupted) {
    if (!checkpoint.empty() && Exists(checkpoint)) {
      const Status noted = NoteFilesLeft(checkpoint);
      if (!noted.ok())
        LogWarning(Cat("--resume will need -w to replace the files written so far: ", noted.error().message));
    }
    return WithWayOn({ErrorCode::kInterrupted, Cat("stopped; ", output.string(), " holds the result so far")},
                     checkpoint);
  }
  if (!checkpoint.empty()) RemoveCheckpoint(checkpoint, is_checkpoint);
  nlohmann::json json = ToJson(r);
  json["input"] = input;
  json["output"] = output.string();
  json["device"] = device.ToJson();
  if (flags.view) json["view"] = PagePath(output).string();
  if (!shared.json && !shared.quiet) {
    ResultsBeside(flags.memory()) << OneLine(input) << " -> " << OutputName(output, flags.memory()) << "\n  "
                                  << WithThousands(r.gaussians_in)
                                  << (r.gaussians_in == 1 ? " Gaussian in, " : " Gaussians in, ")
                                  << WithThousands(r.gaussians_out) << " out; " << r.method << Details(r) << "; "
                                  << HumanSeconds(r.seconds_in_all) << " (analysis "
                                  << HumanSeconds(r.seconds_in_all - r.seconds) << ", " << r.method << " "
                                  << HumanSeconds(r.seconds) << ")\n";
    if (flags.view) {
      std::error_code unknown;
      std::cout << "  " << OneLine(PagePath(output)) << ": " << HumanBytes(fs::file_size(PagePath(output), unknown))
                << "; open it in any browser\n";
    }
  }
  return json;
}

Status RunInputs(const EnhanceWords& flags, Program& program) {
  const SharedFlags& shared = program.flags;
  const EnhanceOptions& asked = flags.how.options;
  if (!asked.refine.images.empty() && flags.inputs.size() > 1) {
    return Error{ErrorCode::kBadArgument, Cat("--images works with one input only, not ", flags.inputs.size())};
  }
  if (!asked.control.checkpoint.empty() && flags.inputs.size() > 1) {
    return Error{ErrorCode::kBadArgument, Cat("--checkpoint works with one input only, not ", flags.inputs.size())};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const EnhanceOptions options, MakeEnhanceOptions(flags.how, shared.seed));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto outputs, OutputPaths(flags));
  if (flags.view) ANCHORSPLAT_RETURN_IF_ERROR(CheckPages(outputs));
  ANCHORSPLAT_RETURN_IF_ERROR(MakeOutDir(flags));

  if (options.quality == "best" && options.refine.images.empty()) {
    LogInfo("--quality best works better with the training pictures. Pass them with --images");
  }
  // Check all outputs before the first computation, so that a batch does not fail half-way.
  for (const fs::path& output : outputs) {
    const auto [checkpoint, is_checkpoint] = CheckpointOf(flags, options, output);
    const std::vector<fs::path> files = OutputFiles(flags, output);
    if (!checkpoint.empty()) {
      ANCHORSPLAT_RETURN_IF_ERROR(
          CheckCheckpoint(checkpoint, files, options.control.resume, shared.overwrite, is_checkpoint));
      if (options.control.resume) RecordWhatWasLeft(checkpoint, files);
    }
    ANCHORSPLAT_RETURN_IF_ERROR(CheckOutput(output, {.overwrite = shared.overwrite, .memory = flags.memory()}));
    if (shared.overwrite) {  // so that an interruption may replace them
      for (const fs::path& file : files) RecordOwnFile(file);
    }
    if (flags.view) ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(PagePath(output), shared.overwrite));
  }

  std::vector<BatchItem> items;
  std::vector<Forecast> forecasts;
  std::vector<OutputPlan> plans;
  for (size_t i = 0; i < outputs.size(); ++i) {
    items.push_back({flags.inputs[i], outputs[i].string()});
    // Only the data says how many Gaussians lie in a region.
    const std::optional<CloudExtent> extent = options.region ? std::nullopt : ExtentOf(flags.inputs[i]);
    forecasts.push_back(extent ? Forecast::kAccepted : Forecast::kUnknown);
    if (extent) plans.push_back(PlanOf(options, flags.inputs[i], outputs[i], *extent));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const bool said, AskIfLarge(plans, flags.size, shared));
  if (said) std::ranges::replace(forecasts, Forecast::kAccepted, Forecast::kSaid);
  return RunBatch(
      items,
      [&](size_t i) {
        std::optional<NamedMessages> named;
        if (items.size() > 1) named.emplace(flags.inputs[i]);
        return EnhanceOne(flags, shared, options, flags.inputs[i], outputs[i], forecasts[i]);
      },
      program);
}

Status RunEnhance(const EnhanceWords& flags, Program& program) {
  if (!IsStandardOutput(flags.output)) {
    if (flags.to_option->count() == 0) return RunInputs(flags, program);
    return Error{ErrorCode::kBadArgument, "--to works only with -o -"};
  }
  if (flags.view) return Error{ErrorCode::kBadArgument, "--view cannot write a page beside standard output"};
  if (flags.how.options.control.resume && flags.how.options.control.checkpoint.empty()) {
    return Error{ErrorCode::kBadArgument, "--resume with -o - needs --checkpoint"};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const StandardOutput piped, StandardOutput::ForSplat(flags.to, program.flags));
  EnhanceWords words = flags;
  words.piped = &piped;
  words.output = piped.path().string();
  ANCHORSPLAT_RETURN_IF_ERROR(RunInputs(words, program));
  return piped.Send();
}

}  // namespace

void AddEnhance(CLI::App& app, Program& program) {
  CLI::App& verb = AddVerb(app, program, "enhance", "Make a splat hold up when seen closer",
                           "anchorsplat enhance scan.ply -o scan-4x.ply --cameras transforms.json");
  const auto flags = std::make_shared<EnhanceWords>();
  verb.add_option("inputs", flags->inputs, "Splat files")->required()->check(NotEmpty());
  auto* output = verb.add_option("-o,--output", flags->output, "Output file, for one input; - is standard output")
                     ->type_name("FILE");
  flags->to_option = verb.add_option("--to", flags->to, kPipedFormatHelp)->type_name("FORMAT")->capture_default_str();
  verb.add_option("--out-dir", flags->out_dir, "Output folder; files keep the names of the inputs")
      ->type_name("FOLDER")
      ->excludes(output);
  verb.add_flag("--view", flags->view, "Also write an HTML page beside the output that shows before and after");
  flags->how.AddTo(verb);
  flags->size.AddTo(verb);
  program.device.AddTo(verb);
  ShortenHelp(verb, {"--output", "--out-dir", "--upscale", "--quality", "--cameras", "--images", "--region",
                     "--max-gaussians", "--view", "--device", "--overwrite", "--quiet", "--json"});
  verb.callback([flags, &verb, &program] {
    flags->how.options.given = GivenOptions(verb);
    program.run = [flags, &program] { return RunEnhance(*flags, program); };
  });
}

}  // namespace anchorsplat
