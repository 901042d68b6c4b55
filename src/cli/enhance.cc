#include "enhance/enhance.h"

#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/parse.h"
#include "cli/verb.h"
#include "core/log.h"
#include "core/text.h"
#include "formats/camera_io.h"

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
};

// Where each input goes. Nothing may be written twice or over its own input by accident.
Result<std::vector<fs::path>> OutputPaths(const EnhanceFlags& flags, bool overwrite) {
  if (flags.output.empty() == flags.out_dir.empty()) {
    return Error{ErrorCode::kBadArgument, "say where to write: -o FILE for one input, --out-dir DIR for several"};
  }
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
  // Checked for all before the first is computed: a batch should not fail half-way on something known at its start.
  for (const fs::path& output : outputs) {
    if (!overwrite && fs::exists(output)) {
      return Error{ErrorCode::kExists, Cat(output.string(), " exists; -w replaces it")};
    }
  }
  std::error_code code;
  fs::create_directories(flags.out_dir, code);
  if (code) return Error{ErrorCode::kIo, Cat(flags.out_dir, ": cannot make this folder: ", code.message())};
  return outputs;
}

nlohmann::json ToJson(const std::string& input, const fs::path& output, const EnhanceReport& r) {
  return {{"input", input},
          {"output", output.string()},
          {"method", r.method},
          {"upscale", r.upscale},
          {"filter_strength", r.filter_strength},
          {"pixel_size", {{"value", r.pixel_size}, {"source", r.pixel_size_source}}},
          {"gaussians", {{"in", r.gaussians_in}, {"dropped", r.dropped}, {"out", r.gaussians_out}}},
          {"seconds", r.seconds}};
}

Status RunEnhance(const EnhanceFlags& flags, const SharedFlags& shared) {
  EnhanceOptions options = flags.options;
  options.seed = shared.seed;
  ANCHORSPLAT_ASSIGN_OR_RETURN(options.pixel_size, ParsePixelSize("--pixel-size", flags.pixel_size));
  if (!flags.cameras.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(options.cameras, ReadCameras(flags.cameras));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto outputs, OutputPaths(flags, shared.overwrite));

  nlohmann::json results = nlohmann::json::array();
  for (size_t i = 0; i < flags.inputs.size(); ++i) {
    if (!shared.overwrite && fs::exists(outputs[i])) {
      return Error{ErrorCode::kExists, Cat(outputs[i].string(), " exists; -w replaces it")};
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud cloud, ReadCloud(flags.inputs[i]));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Enhanced enhanced, Enhance(std::move(cloud), options));
    ANCHORSPLAT_RETURN_IF_ERROR(WriteCloud(outputs[i], enhanced.cloud, WriteOptionsFrom(shared)));
    const EnhanceReport& r = enhanced.report;
    results.push_back(ToJson(flags.inputs[i], outputs[i], r));
    if (!shared.json && !shared.quiet) {
      std::cout << flags.inputs[i] << " -> " << outputs[i].string() << "\n  " << WithThousands(r.gaussians_in)
                << " Gaussians in, " << WithThousands(r.gaussians_out) << " out; " << r.method << " x" << r.upscale
                << ", strength " << Fixed(r.filter_strength, 3) << ", pixel size " << r.pixel_size << " ("
                << r.pixel_size_source << "), " << HumanSeconds(r.seconds) << '\n';
    }
  }
  if (shared.json) PrintJson(results);
  return {};
}

std::string MethodHelp() {
  std::string text = "auto: the best one available without further input";
  for (const EnhanceMethod& method : EnhanceMethods()) text += "; " + method.name + ": " + method.summary;
  return text;
}

}  // namespace

void AddEnhance(CLI::App& app, Program& program) {
  CLI::App& verb = AddVerb(app, program, "enhance", "Make a splat hold up when seen closer",
                           "anchorsplat enhance scan.ply -o scan-4x.ply --cameras transforms.json");
  const auto flags = std::make_shared<EnhanceFlags>();
  EnhanceOptions& options = flags->options;
  verb.add_option("inputs", flags->inputs, "Splat files")->required();
  auto* output = verb.add_option("-o,--output", flags->output, "File to write (one input)");
  verb.add_option("--out-dir", flags->out_dir, "Folder to write to, under the inputs' names")->excludes(output);
  verb.add_option("--method", options.method, MethodHelp())->capture_default_str();
  verb.add_option("--upscale", options.upscale, "How many times closer it will be seen; at least 1")
      ->capture_default_str();
  auto* pixel_size =
      verb.add_option("--pixel-size", flags->pixel_size,
                      "World size of one pixel of the training views (depth / focal length), or auto to estimate it")
          ->capture_default_str();
  auto* cameras = verb.add_option("--cameras", flags->cameras, "Training cameras: exact pixel size for every Gaussian")
                      ->excludes(pixel_size);
  verb.add_option("--train-width", options.train_width,
                  "Image width in training where it was less than the cameras say")
      ->check(CLI::PositiveNumber)
      ->needs(cameras);
  verb.add_option("--camera-rule", options.camera_rule,
                  "Which of the views that hold a Gaussian says its pixel size: the smallest never blurs, the median "
                  "suits objects seen from all around")
      ->transform(CLI::CheckedTransformer(std::map<std::string, CameraPixelRule>{
          {"smallest", CameraPixelRule::kSmallest}, {"median", CameraPixelRule::kMedian}}))
      ->default_str("smallest")
      ->needs(cameras);
  verb.add_option("--filter-strength", options.filter_strength,
                  "Share of the absorbed 0.3 px² to give back (default: 1 - (1 - 1/upscale²)/3.6)");
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunEnhance(*flags, program.flags); }; });
}

}  // namespace anchorsplat
