#include "request/convert_flags.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/log.h"
#include "core/text.h"
#include "formats/cloud_io.h"
#include "formats/registry.h"
#include "request/choice.h"
#include "request/mode_option.h"
#include "request/parse.h"
#include "request/write_flags.h"

namespace anchorsplat {

namespace {

nlohmann::json ToJson(const Deviation& deviation) { return {{"rms", deviation.rms}, {"max", deviation.max}}; }

}  // namespace

void ConvertFlags::AddTo(CLI::App& verb) {
  verb.add_option("--from", from, kInputFormatHelp)->type_name("FORMAT")->check(NotEmpty());
  AddModeOption(verb, options.render_mode, "Rasterization to note in the output (default: as in the input)");
  verb.add_option("--sh-degree", options.sh_degree, "Highest degree of spherical harmonics to keep, 0 to 3")
      ->check(CLI::Range(0, 3));
  verb.add_option("--min-opacity", options.min_opacity, "Drop Gaussians with less opacity, 0 to 1")
      ->check(Fraction())
      ->capture_default_str();
  verb.add_option("--max-gaussians", options.max_gaussians, "Keep at most so many, the largest by size x opacity")
      ->check(AtLeastOne());
  verb.add_option("--coords", axes,
                  "Axes of files that differ from their format's, as IN:OUT. RUB: reads a PLY with y up, RFU: one with "
                  "z up, :RDF writes an SPZ without turning it")
      ->type_name("AXES")
      ->check(NotEmpty());
  verb.add_option("--scales", scales, "How the input stores scales, if not as its format requires")
      ->check(OneOf({"logarithms", "lengths"}))
      ->capture_default_str();
  verb.add_option("--opacities", opacities, "How the input stores opacities, if not as its format requires")
      ->check(OneOf({"logits", "0-1"}))
      ->capture_default_str();
  verb.add_option("--colors", colors, "How the input stores f_dc: as harmonics, or as colours 0-1 or 0-255")
      ->check(OneOf({"harmonics", "0-1", "0-255"}))
      ->capture_default_str();
  edits.AddTo(verb);
  double_means = verb.add_flag("--double", options.double_means,
                               "PLY: write world coordinates as doubles, not as floats relative to an origin in a "
                               "comment (default: as in the input)");
  spz_version = AddWriteFlags(verb, options.write);
  LodOptions& lod = options.write.lod;
  const std::string group = "Levels of detail";
  of_streamed = {
      verb.add_option("--lod-levels", lod.levels, "Levels in a lod-meta.json including the full splat, 1 to 16")
          ->check(CLI::Range(1, 16)),
      verb.add_option("--lod-ratio", lod.ratio, "Gaussians in each level as a fraction of the finer one, 0.01 to 0.99")
          ->check(CLI::Range(0.01, 0.99)),
      verb.add_option("--lod-chunk-count", lod.chunk_count, "Most Gaussians in a chunk, in units of 1,024")
          ->check(CLI::Range(1, 1 << 17)),
      verb.add_option("--lod-chunk-extent", lod.chunk_extent, "Longest side of a chunk, in world units")
          ->check(Positive())};
  for (CLI::Option* option : of_streamed) option->capture_default_str()->group(group);
  verb.add_option("--lod-level", options.lod_level, "Level to read from a lod-meta.json; 0 is the finest")
      ->check(NotNegative())
      ->capture_default_str()
      ->group(group);
  auto* report_option =
      verb.add_flag("--report", report, "Read the output back and report errors per attribute and PSNR of renders");
  verb.add_option("--report-views", views, "With --report: views around the splat for the PSNR")
      ->check(CLI::Range(1, 1000))
      ->needs(report_option)
      ->capture_default_str();
}

Result<ConvertOptions> MakeConvertOptions(const ConvertFlags& flags, bool overwrite) {
  ConvertOptions options = flags.options;
  options.write.overwrite = overwrite;
  options.measure = flags.report;
  options.stored = {.lengths = flags.scales == "lengths",
                    .opacities = flags.opacities == "0-1",
                    .max_color = flags.colors == "0-1"     ? 1.0f
                                 : flags.colors == "0-255" ? 255.0f
                                                           : 0.0f};
  ANCHORSPLAT_ASSIGN_OR_RETURN(options.input_format, ParseInputFormat("--from", flags.from));
  if (flags.axes) {
    const Status axes = ParseAxes(*flags.axes, options);
    if (!axes.ok()) return Error{axes.error().code, Cat("--coords: ", axes.error().message)};
  }
  return options;
}

Status CheckConvertEffects(const ConvertFlags& flags, std::span<const std::filesystem::path> outputs) {
  const auto is_spz = [](const std::filesystem::path& output) { return output.extension() == ".spz"; };
  if (flags.spz_version->count() > 0 && std::ranges::none_of(outputs, is_spz)) {
    return Error{ErrorCode::kBadArgument, "--spz-version has no effect here; it works only with a .spz output"};
  }
  const auto is_ply = [](const std::filesystem::path& output) {
    const SplatFormat* const format = FormatOfExtension(output);
    return format != nullptr && format->write_with_extras != nullptr;
  };
  if (flags.double_means->count() > 0 && std::ranges::none_of(outputs, is_ply)) {
    return Error{ErrorCode::kBadArgument, "--double has no effect here; it works only with a .ply output"};
  }
  const auto is_streamed = [](const std::filesystem::path& output) { return output.filename() == "lod-meta.json"; };
  for (const CLI::Option* option : flags.of_streamed) {
    if (option->count() > 0 && std::ranges::none_of(outputs, is_streamed)) {
      return Error{ErrorCode::kBadArgument,
                   Cat(option->get_name(), " has no effect here; it works only with a lod-meta.json output")};
    }
  }
  if (flags.options.write.order != SplatOrder::kFormat && std::ranges::all_of(outputs, is_streamed)) {
    return Error{ErrorCode::kBadArgument, "--sort has no effect here: lod-meta.json has its own order"};
  }
  const auto says_mode = [](const std::filesystem::path& output) {
    const SplatFormat* const format = FormatOfExtension(output);
    return format != nullptr && format->mode_tag != ModeTag::kNone;
  };
  if (flags.options.render_mode && std::ranges::none_of(outputs, says_mode)) {
    return Error{ErrorCode::kBadArgument,
                 "--mode has no effect here; it works only with an output that stores it (.ply, .compressed.ply, .spz, "
                 ".sog)"};
  }
  return {};
}

Result<EditJob> MakeEditJob(const EditFlags& flags, std::vector<std::filesystem::path> inputs, size_t output_at,
                            const ConvertOptions& options) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto actions, ActionsAmongPaths(flags));
  EditJob job{.convert = options, .dry_run = flags.dry_run};
  for (size_t k = 0; k < inputs.size(); ++k) {
    EditInput input{std::move(inputs[k]), actions[0]};
    const auto add = [](const std::vector<EditAction>& more, std::vector<EditAction>& to) {
      to.insert(to.end(), more.begin(), more.end());
    };
    if (output_at == 0) {
      for (size_t at = 1; at < actions.size(); ++at) add(actions[at], input.actions);
    } else if (k + 1 < actions.size()) {
      add(actions[k + 1], input.actions);
    }
    job.inputs.push_back(std::move(input));
  }
  if (output_at > 0 && output_at < actions.size()) job.actions = actions[output_at];
  return job;
}

Result<Converted> ConvertAndMeasure(const EditJob& job, const std::filesystem::path& output, int views) {
  GaussianCloud cloud;
  Converted done;
  const ConvertOptions& options = job.convert;
  GaussianCloud* const kept = options.measure && !job.dry_run ? &cloud : nullptr;
  if (job.edits()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(EditReport edited, EditFiles(job, output, kept));
    done.report = std::move(edited.convert);
    done.steps = std::move(edited.steps);
    done.dry_run = job.dry_run;
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(done.report, ConvertFile(job.inputs[0].path, output, options, kept));
  }
  if (done.report.error) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud back, ReadBack(output, options.write, cloud));
    ANCHORSPLAT_ASSIGN_OR_RETURN(done.loss, MeasureConversionLoss(cloud, back, views));
  } else if (kept != nullptr) {
    LogWarning(Cat(output.string(), ": ", done.report.output_format,
                   " cannot be read back, so --report has nothing to compare"));
  }
  return done;
}

nlohmann::json ToJson(const Converted& converted) {
  const ConvertReport& r = converted.report;
  nlohmann::json json = {{"formats", {r.input_format, r.output_format}},
                         {"gaussians", {{"in", r.gaussians_read}, {"out", r.gaussians_written}}},
                         {"sh_degree", {{"in", r.sh_degree_read}, {"out", r.sh_degree_written}}},
                         {"bytes", {{"in", r.input_bytes}}},
                         {"seconds", {{"read", r.read_seconds}}}};
  if (converted.dry_run) {
    json["dry_run"] = true;
  } else {
    json["bytes"]["out"] = r.output_bytes;
    json["seconds"]["write"] = r.write_seconds;
  }
  if (r.predicted_bytes) {
    json["bytes"]["predicted"] = *r.predicted_bytes;
    json["bytes"]["predicted_roughly"] = r.predicted_roughly;
  }
  if (!converted.steps.empty()) json["actions"] = ToJson(std::span<const EditStep>(converted.steps));
  if (r.error) {
    json["error"] = {{"compared", r.error->compared},           {"left_out", r.error->left_out},
                     {"means", ToJson(r.error->means)},         {"log_scales", ToJson(r.error->log_scales)},
                     {"rotations", ToJson(r.error->rotations)}, {"opacities", ToJson(r.error->opacities)},
                     {"colors", ToJson(r.error->colors)},       {"harmonics", ToJson(r.error->harmonics)}};
  }
  if (const auto& loss = converted.loss)
    json["psnr"] = {{"mean", loss->mean_psnr}, {"min", loss->min_psnr}, {"views", loss->views}};
  return json;
}

}  // namespace anchorsplat
