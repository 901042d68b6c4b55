#include "enhance/enhance.h"

#include <charconv>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "cameras/camera_io.h"
#include "cli/batch.h"
#include "cli/before_after_page.h"
#include "cli/choice.h"
#include "cli/clean_output.h"
#include "cli/mode_option.h"
#include "cli/parse.h"
#include "cli/refine_flags.h"
#include "cli/stop_signal.h"
#include "cli/verb.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/text.h"
#include "core/world_up.h"
#include "fit/checkpoint_guard.h"
#include "fit/fitter.h"
#include "formats/cloud_output.h"
#include "formats/extra_properties.h"
#include "formats/opened_splat.h"
#include "formats/registry.h"
#include "formats/row_arrays.h"
#include "io/atomic_file.h"
#include "io/input_record.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

struct EnhanceFlags {
  std::vector<std::string> inputs;
  std::string output;
  std::string out_dir;
  std::string pixel_size = "auto";
  std::string cameras;
  EnhanceOptions options;
  std::string model_file;
  std::string shuffles = "identity";
  std::string compat;
  std::string copies = "auto";
  std::optional<RenderMode> mode;  // in place of the files' tags
  std::string background;          // of --clean
  bool view = false;
};

// What can be known to fail before anything is read.
Status CheckOutput(const fs::path& output, bool overwrite) {
  const SplatFormat* format = FormatOfExtension(output);
  if (format == nullptr || format->write == nullptr) {
    std::string known;
    for (const SplatFormat& f : Formats()) {
      if (f.write != nullptr) known += Cat(" ", f.extensions.front());
    }
    return Error{ErrorCode::kBadArgument, Cat(output.string(), ": not a format that is written; known are", known)};
  }
  return CheckCanWriteCloud(output, 0, {.overwrite = overwrite});
}

// Whether the user can stop it and go on later.
bool IsResumable(const EnhanceOptions& options) {
  const auto plan = PlanEnhancement(options);
  return plan.ok() && plan->method->resumable;
}

// Where the state of a refinement of this output goes when the user stops it; empty when it is not kept.
fs::path CheckpointOf(const EnhanceOptions& options, const fs::path& output) {
  if (!IsResumable(options) || options.refine.seconds) return {};
  return options.control.checkpoint.empty() ? fs::path(output.string() + ".checkpoint") : options.control.checkpoint;
}

// All that is written for an output.
std::vector<fs::path> OutputFiles(const EnhanceFlags& flags, const fs::path& output) {
  std::vector<fs::path> files = FilesOfCloud(output, kMaxShDegree);
  if (flags.view) files.push_back(PagePath(output));
  return files;
}

// Where each input goes. Nothing may be written twice.
Result<std::vector<fs::path>> OutputPaths(const EnhanceFlags& flags) {
  if (flags.output.empty() == flags.out_dir.empty()) {
    return Error{ErrorCode::kBadArgument, "say where to write: -o FILE for one input, --out-dir DIR for several"};
  }
  for (const std::string& input : flags.inputs) RecordSplat(input);
  if (!flags.output.empty()) {
    if (flags.inputs.size() > 1) {
      return Error{ErrorCode::kBadArgument, Cat(flags.inputs.size(), " inputs and one -o file: use --out-dir DIR")};
    }
    return std::vector<fs::path>{flags.output};
  }
  std::vector<fs::path> outputs;
  std::map<fs::path, std::string> taken;
  for (const std::string& input : flags.inputs) {
    const fs::path output = fs::path(flags.out_dir) / fs::path(input).filename();
    const auto [other, fresh] = taken.emplace(output, input);
    if (!fresh) {
      return Error{ErrorCode::kBadArgument,
                   Cat(other->second, " and ", input, " would both become ", output.string(), ": rename one")};
    }
    outputs.push_back(output);
  }
  return outputs;
}

Status MakeOutDir(const EnhanceFlags& flags) {
  if (flags.out_dir.empty()) return {};
  std::error_code code;
  fs::create_directories(flags.out_dir, code);
  if (code) return Error{ErrorCode::kIo, Cat(flags.out_dir, ": cannot make this folder: ", code.message())};
  return {};
}

nlohmann::json ToJson(const RefinePlan& plan) {
  nlohmann::json json = {
      {"from_input", plan.from_input}, {"nothing_to_do", plan.nothing_to_do}, {"least_gain", plan.least_gain}};
  if (!plan.why.empty()) json["why"] = plan.why;
  if (plan.nothing_to_do) return json;
  const RefineOptions& options = plan.options;
  if (options.steps) json["steps"] = *options.steps;
  if (options.seconds) json["seconds"] = *options.seconds;
  if (options.copies) json["k"] = *options.copies;
  if (options.rate) json["rate"] = *options.rate;
  if (plan.gaussians > 0) json["gaussians"] = plan.gaussians;
  return json;
}

nlohmann::json ToJson(const std::string& input, const fs::path& output, const EnhanceReport& r) {
  nlohmann::json json = {{"input", input},
                         {"output", output.string()},
                         {"method", r.method},
                         {"gaussians", {{"in", r.gaussians_in}, {"dropped", r.dropped}, {"out", r.gaussians_out}}},
                         {"seconds", r.seconds}};
  if (r.cleaned) {
    json["cleaned"] = {{"gaussians", r.cleaned->rows.size()}, {"views", r.cleaned->views}, {"psnr", nullptr}};
    if (std::isfinite(r.cleaned->psnr)) json["cleaned"]["psnr"] = r.cleaned->psnr;
  }
  if (!r.quality.empty()) json["quality"] = r.quality;
  for (const StepReport& step : r.steps) {
    const std::string key = json.contains(step.method) ? step.method + " again" : step.method;
    for (const auto& [name, value] : step.facts) {
      std::visit([&, &fact = name](auto told) { json[key][fact] = told; }, value);
    }
    if (step.plan) json[key]["plan"] = ToJson(*step.plan);
  }
  if (!r.pixel_size_source.empty()) {
    json["upscale"] = r.upscale;
    json["filter_strength"] = r.filter_strength;
    if (r.looks) json["looks"] = NameOf(*r.looks);
    json["pixel_size"] = {{"value", r.pixel_size}, {"source", r.pixel_size_source}};
    if (r.pixel_size_source == kUnknownPixelSize) json["pixel_size"]["value"] = nullptr;
    if (r.finding) {
      json["pixel_size"]["estimate"] = r.finding->estimate.size;
      json["pixel_size"]["contradictions"] = r.finding->contradictions;
    }
    if (!r.camera_rule.empty()) json["camera_rule"] = r.camera_rule;
    if (r.train_width) json["train_width"] = *r.train_width;
  }
  return json;
}

// "identity", the seed of PyTorch's generator, or five permutations such as 1230,0321,1023,3102,0321.
Result<Shuffles> ParseShuffles(const std::string& text) {
  if (text == "identity") return kNoShuffles;
  Shuffles shuffles;
  constexpr size_t kWidth = std::tuple_size_v<Shuffle> + 1;  // digits and a comma
  if (text.size() + 1 == kWidth * shuffles.size()) {
    bool well_formed = true;
    for (size_t i = 0; i < text.size(); ++i) {
      const bool comma = i % kWidth == kWidth - 1;
      well_formed &= comma ? text[i] == ',' : text[i] >= '0' && text[i] <= '9';
      if (!comma) shuffles[i / kWidth][i % kWidth] = static_cast<uint8_t>(text[i] - '0');
    }
    if (well_formed && Validate(shuffles).ok()) return shuffles;
  }
  uint64_t seed = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), seed);
  if (code == std::errc() && end == text.data() + text.size()) return ShufflesFromSeed(seed);
  return Error{ErrorCode::kBadArgument,
               Cat("--shuffles: '", Printable(text),
                   "' is neither 'identity', nor a seed, nor five permutations such as 1230,0321,1023,3102,0321")};
}

// What several flags say together.
Status FinishModelOptions(const EnhanceFlags& flags, ModelSettings& model) {
  if (!flags.options.refine.images.empty() && flags.inputs.size() > 1) {
    return Error{ErrorCode::kBadArgument,
                 Cat("--images are the pictures of one splat, and there are ", flags.inputs.size(), " inputs")};
  }
  if (!flags.options.control.checkpoint.empty() && flags.inputs.size() > 1) {
    return Error{ErrorCode::kBadArgument, Cat("--checkpoint is for one input, and there are ", flags.inputs.size())};
  }
  model.file = flags.model_file;
  model.options.upstream = flags.compat == "upstream";
  ANCHORSPLAT_ASSIGN_OR_RETURN(model.copies, ParseCopies("--copies", flags.copies));
  ANCHORSPLAT_ASSIGN_OR_RETURN(model.options.shuffles, ParseShuffles(flags.shuffles));
  return {};
}

// What the method worked with, where it is the filter's business.
std::string Details(const EnhanceReport& r) {
  if (r.pixel_size_source.empty()) return "";
  if (r.pixel_size_source == kUnknownPixelSize) return " not applied";
  return Cat(" x", r.upscale, ", strength ", Fixed(r.filter_strength, 3), ", pixel size ", r.pixel_size, " (",
             r.pixel_size_source, ")");
}

// Leaves those of `extras` that belong to Gaussians that are enhanced. The means of these Gaussians, by which the
// result shows whether they are still the same ones; nothing where there is nothing to keep.
Buffer<float> KeepUsable(ExtraProperties& extras, const GaussianCloud& cloud) {
  if (extras.empty()) return {};
  std::vector<char> usable(static_cast<size_t>(cloud.size()));
  for (size_t i = 0; i < usable.size(); ++i) usable[i] = IsUsable(cloud, static_cast<int64_t>(i)) ? 1 : 0;
  Buffer<float> means = cloud.means;
  KeepRows(means, 3, usable);
  KeepRows(extras, usable);
  return means;
}

// From one file to another; its entry of the results.
Result<nlohmann::json> EnhanceOne(const EnhanceFlags& flags, const SharedFlags& shared, EnhanceOptions options,
                                  const std::string& input, const fs::path& output) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedSplat file, OpenedSplat::Open(input));
  ExtraProperties extras;
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud cloud, file.Read({}, &extras));
  if (flags.mode) cloud.render_mode = flags.mode;
  Buffer<float> means = KeepUsable(extras, cloud);
  GaussianCloud before;
  if (flags.view) {
    ANCHORSPLAT_RETURN_IF_ERROR(CheckPageFits(output, cloud, options));
    before = cloud;
  }
  const CloudWriteOptions write{.overwrite = shared.overwrite};
  // Again, now that the inputs with the files beside them are known.
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCanWriteCloud(output, cloud.sh_degree, write));
  options.control.checkpoint = CheckpointOf(options, output);
  options.control.outputs = OutputFiles(flags, output);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto lock, HoldCheckpoint(options.control.checkpoint));
  std::optional<StopSignal> stop_signal(std::in_place);
  auto result = Enhance(std::move(cloud), options);
  stop_signal.reset();
  if (!result.ok()) return result.error();
  Enhanced enhanced = *std::move(result);
  if (!extras.empty() && enhanced.report.cleaned) {
    std::vector<char> kept(means.size() / 3, 1);
    for (const int64_t i : enhanced.report.cleaned->rows) kept[static_cast<size_t>(i)] = 0;
    KeepRows(means, 3, kept);
    KeepRows(extras, kept);
  }
  if (!extras.empty() && enhanced.cloud.means != means) {
    LogWarning(Cat(input, ": other properties of its Gaussians are dropped, as those of the result are others: ",
                   extras.lost(/*writer_keeps=*/false)));
    extras = {};
  }
  if (options.cameras && !UpOf(enhanced.cloud.comments)) {
    if (const auto up = WorldUp(options.cameras->cameras)) enhanced.cloud.comments.push_back(UpComment(*up));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(WriteCloudOrKeep(output, enhanced.cloud, write, extras));
  const EnhanceReport& r = enhanced.report;
  if (r.looks == TrainedKind::kAntialiased) before.render_mode = enhanced.cloud.render_mode;  // both as it was trained
  if (flags.view) ANCHORSPLAT_RETURN_IF_ERROR(WritePage(input, before, output, enhanced, WriteOptionsFrom(shared)));
  const fs::path& checkpoint = options.control.checkpoint;
  if (r.interrupted) {
    const bool resumable = !checkpoint.empty() && Exists(checkpoint);
    if (resumable) {
      const Status noted = NoteFilesLeft(checkpoint);
      if (!noted.ok()) LogWarning(Cat("going on will need -w for what is left here: ", noted.error().message));
    }
    return Error{ErrorCode::kInterrupted,
                 Cat("stopped; ", output.string(), " is as far as it came",
                     resumable ? Cat(", the same command with --resume goes on from ", checkpoint.string()) : "")};
  }
  if (!checkpoint.empty()) RemoveFitCheckpoint(checkpoint);
  nlohmann::json json = ToJson(input, output, r);
  if (flags.view) json["view"] = PagePath(output).string();
  if (!shared.json && !shared.quiet) {
    std::cout << OneLine(input) << " -> " << OneLine(output) << "\n  " << WithThousands(r.gaussians_in)
              << " Gaussians in, " << WithThousands(r.gaussians_out) << " out; " << r.method << Details(r) << ", "
              << HumanSeconds(r.seconds) << '\n';
    if (flags.view) {
      std::error_code unknown;
      std::cout << "  " << OneLine(PagePath(output)) << ": " << HumanBytes(fs::file_size(PagePath(output), unknown))
                << ", open it in any browser\n";
    }
  }
  return json;
}

Status RunEnhance(const EnhanceFlags& flags, Program& program) {
  const SharedFlags& shared = program.flags;
  EnhanceOptions options = flags.options;
  ANCHORSPLAT_RETURN_IF_ERROR(FinishModelOptions(flags, options.model));
  options.seed = shared.seed;
  ANCHORSPLAT_ASSIGN_OR_RETURN(options.pixel_size, ParsePixelSize("--pixel-size", flags.pixel_size));
  if (!flags.cameras.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(options.cameras, ReadCameras(flags.cameras));
  }
  if (!flags.background.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(options.background, ParseColor("--background", flags.background));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckOptions(options));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto outputs, OutputPaths(flags));
  if (flags.view) ANCHORSPLAT_RETURN_IF_ERROR(CheckPages(outputs));
  ANCHORSPLAT_RETURN_IF_ERROR(MakeOutDir(flags));

  // For all before the first is computed: a batch should not fail half-way on something known at its start.
  for (const fs::path& output : outputs) {
    const fs::path checkpoint = CheckpointOf(options, output);
    const std::vector<fs::path> files = OutputFiles(flags, output);
    if (!checkpoint.empty()) {
      ANCHORSPLAT_RETURN_IF_ERROR(CheckCheckpoint(checkpoint, files, options.control.resume, shared.overwrite));
      if (options.control.resume) RecordWhatWasLeft(checkpoint, files);
    }
    ANCHORSPLAT_RETURN_IF_ERROR(CheckOutput(output, shared.overwrite));
    if (shared.overwrite) {  // so that an interruption leaves them under these names
      for (const fs::path& file : files) RecordOwnFile(file);
    }
    if (flags.view) ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(PagePath(output), shared.overwrite));
  }

  std::vector<BatchItem> items;
  for (size_t i = 0; i < outputs.size(); ++i) items.push_back({flags.inputs[i], outputs[i].string()});
  return RunBatch(
      items, [&](size_t i) { return EnhanceOne(flags, shared, options, flags.inputs[i], outputs[i]); }, program);
}

std::string MethodHelp() {
  std::string text = "auto: the best one available without further input";
  for (const EnhanceMethod& method : EnhanceMethods()) text += "; " + method.name + ": " + method.summary;
  return text;
}

void AddTaskFlags(CLI::App& verb, EnhanceFlags& flags) {
  EnhanceOptions& options = flags.options;
  verb.add_option("inputs", flags.inputs, "Splat files")->required()->check(NotEmpty());
  auto* output = verb.add_option("-o,--output", flags.output, "File to write (one input)");
  verb.add_option("--out-dir", flags.out_dir, "Folder to write to, under the inputs' names")->excludes(output);
  verb.add_option("--method", options.method, MethodHelp())->capture_default_str();
  verb.add_option(
          "--quality", options.quality,
          "Instead of a method, by the time there is. fast: the filter and the network, as auto, a second; good: "
          "the network, then a little refinement, several seconds; best: refinement with the pictures of "
          "--images, minutes, and good where there are none")
      ->check(CLI::IsMember({"fast", "good", "best"}));
  verb.add_option("--upscale", options.upscale, "How many times closer it will be seen; at least 1")
      ->capture_default_str();
}

void AddPixelSizeFlags(CLI::App& verb, EnhanceFlags& flags) {
  EnhanceOptions& options = flags.options;
  verb.add_option(
          "--pixel-size", flags.pixel_size,
          "World size of one pixel of the training views (depth / focal length), or auto to estimate it from the "
          "splat; an estimate that its other features contradict is not acted on")
      ->capture_default_str();
  AddModeOption(verb, flags.mode,
                "How the inputs were rasterized in training (default: a file's tag, else as its Gaussians look)");
  auto* cameras = verb.add_option("--cameras", flags.cameras, "Training cameras: exact pixel size for every Gaussian")
                      ->check(NotEmpty());
  verb.add_option("--train-width", options.train_width,
                  "Image width in training where it was less than the cameras say")
      ->check(Positive())
      ->needs(cameras);
  AddChoice(verb, "--camera-rule", options.camera_rule,
            {{"auto", CameraPixelRule::kAuto},
             {"smallest", CameraPixelRule::kSmallest},
             {"median", CameraPixelRule::kMedian}},
            "Which of the views that hold a Gaussian says its pixel size: the smallest never blurs, the median suits "
            "objects seen from all around; auto: by where the cameras stand and look")
      ->needs(cameras);
  verb.add_option("--filter-strength", options.filter_strength,
                  "Share of the absorbed 0.3 px² to give back (default: 1 - (1 - 1/upscale²)/3.6)");
}

void AddModelFlags(CLI::App& verb, EnhanceFlags& flags) {
  const std::string group = "Model";
  PublishedOptions& model = flags.options.model.options;
  verb.add_option("--model", flags.model_file,
                  "Weights of an AnchorSplat network or of a compact one, .pth or .safetensors")
      ->check(NotEmpty())
      ->group(group);
  const auto model_option = [&](CLI::Option* option) { return option->group(group); };
  model_option(verb.add_option("--compat", flags.compat,
                               "upstream: do what the published script does, quirks included (its fp16 attention by "
                               "--attention-rounding fp16)"))
      ->check(CLI::IsMember({"upstream"}));
  model_option(AddChoice(verb, "--normalisation", model.normalisation,
                         {{"auto", NormalisationMode::kAuto},
                          {"centered", NormalisationMode::kCentered},
                          {"bbox", NormalisationMode::kBbox},
                          {"unit", NormalisationMode::kUnit}},
                         "How the splat is brought into the network's cube"));
  model_option(AddChoice(verb, "--precision", flags.options.model.precision,
                         {{"fp32", WeightPrecision::kFloat}, {"bf16", WeightPrecision::kBFloat16}},
                         "Of matrix products, convolutions and attention; bf16 only where the processor has products "
                         "of it (`doctor` says), else fp32"));
  model_option(AddChoice(verb, "--attention-rounding", model.rounding,
                         {{"none", Rounding::kNone}, {"fp16", Rounding::kHalf}, {"bf16", Rounding::kBFloat16}},
                         "Of queries, keys, values and probabilities; the release: fp16"));
  model_option(AddChoice(verb, "--curve-depth", model.depth_rule,
                         {{"v1.5", DepthRule::kLargest}, {"v1.6", DepthRule::kLargestPlusOne}},
                         "Bits of the space-filling curves as Pointcept's release counted them"));
  model_option(
      verb.add_option("--shuffles", flags.shuffles,
                      "Orders of the space-filling curves: identity, a seed of PyTorch's, or five permutations"))
      ->capture_default_str();
  model_option(verb.add_option("--copies", flags.copies,
                               "Gaussians that a compact network makes of each, at most; auto: merged where nobody "
                               "would see the difference"))
      ->capture_default_str();
  model_option(verb.add_option("--merge-cost", flags.options.model.merge_cost,
                               "Of --copies auto: what a merge may cost, in pixels of the closer view times the square "
                               "of the difference; more is fewer Gaussians (default: 0.00002)"))
      ->check(NotNegative());
  model_option(verb.add_option("--max-gaussians", model.max_gaussians,
                               "Budget of the result: copies are merged until it is kept. Of the published "
                               "architecture: anchors at most, the largest by opacity x size. 0 is all"))
      ->check(NotNegative())
      ->capture_default_str();
  verb.add_option("--prune-opacity", model.prune_opacity,
                  "Leave Gaussians of less opacity out of what the model makes; 1/255 = 0.0039 is invisible")
      ->check(Fraction())
      ->group(group)
      ->capture_default_str();
  model_option(verb.add_option("--block-gaussians", model.block_gaussians,
                               "Larger splats are enhanced in overlapping blocks of this many"))
      ->check(CLI::Range(int64_t{1000}, int64_t{100'000'000}))
      ->capture_default_str();
}

}  // namespace

void AddEnhance(CLI::App& app, Program& program) {
  CLI::App& verb = AddVerb(app, program, "enhance", "Make a splat hold up when seen closer",
                           "anchorsplat enhance scan.ply -o scan-4x.ply --cameras transforms.json");
  const auto flags = std::make_shared<EnhanceFlags>();
  AddTaskFlags(verb, *flags);
  AddPixelSizeFlags(verb, *flags);
  verb.add_flag("--view", flags->view, "Also write an HTML page beside the output that shows before and after");
  auto* clean = verb.add_flag(
      "--clean", flags->options.clean,
      "First take out Gaussians of the background's colour that no training view would miss, as black dust "
      "around objects on black; dark parts of the object may go, too");
  verb.add_option("--background", flags->background,
                  "R,G,B from 0 to 1, of the training views (default: what the camera file says, else black)")
      ->needs(clean);
  AddModelFlags(verb, *flags);
  AddRefineFlags(verb, flags->options.refine, flags->options.control);
  verb.callback([flags, &verb, &program] {
    flags->options.given = GivenOptions(verb);
    program.run = [flags, &program] { return RunEnhance(*flags, program); };
  });
}

}  // namespace anchorsplat
