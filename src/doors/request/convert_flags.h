#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.h"
#include "edit/edit_files.h"
#include "formats/convert.h"
#include "metrics/conversion_loss.h"
#include "request/edit_flags.h"

namespace anchorsplat {

// Options of `convert`, without input and output.
struct ConvertFlags {
  std::string from;  // name of a format; empty: recognised
  std::optional<std::string> axes;
  std::string scales = "logarithms", opacities = "logits", colors = "harmonics";
  int views = 8;
  bool report = false;
  ConvertOptions options;
  EditFlags edits;
  CLI::Option* spz_version = nullptr;  // the verb's option
  CLI::Option* double_means = nullptr;
  std::vector<CLI::Option*> of_streamed;  // options for streamed SOG only

  void AddTo(CLI::App& verb);
};

// Errors: kBadArgument with the option.
Result<ConvertOptions> MakeConvertOptions(const ConvertFlags& flags, bool overwrite);

// kBadArgument: a given option affects none of these files.
Status CheckConvertEffects(const ConvertFlags& flags, std::span<const std::filesystem::path> outputs);

// The job of one output file: `inputs` are merged. An edit after an input applies to that input, before the first input
// to every input, after the output to the result. `output_at`: position of the output among the paths, from 1; 0: no
// path is an output, and all edits apply to each input. Errors: kBadArgument with the edit.
Result<EditJob> MakeEditJob(const EditFlags& flags, std::vector<std::filesystem::path> inputs, size_t output_at,
                            const ConvertOptions& options);

// Converts one file. With ConvertOptions::measure, also compares renders of `views` views.
struct Converted {
  ConvertReport report;
  std::vector<EditStep> steps;
  bool dry_run = false;
  std::optional<ConversionLoss> loss;
};
Result<Converted> ConvertAndMeasure(const EditJob& job, const std::filesystem::path& output, int views);

// Report for --json and Python, without file names.
nlohmann::json ToJson(const Converted& converted);

}  // namespace anchorsplat
