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

// The options of `convert` that say how, not where from and where to.
struct ConvertFlags {
  std::string from;  // name of a format; empty: found out
  std::optional<std::string> axes;
  std::string scales = "logarithms", opacities = "logits", colors = "harmonics";
  int views = 8;
  bool report = false;
  ConvertOptions options;
  EditFlags edits;
  CLI::Option* spz_version = nullptr;  // of the verb
  CLI::Option* double_means = nullptr;
  std::vector<CLI::Option*> of_streamed;  // likewise: those that only a streamed SOG knows

  void AddTo(CLI::App& verb);
};

// Errors: kBadArgument with the option.
Result<ConvertOptions> MakeConvertOptions(const ConvertFlags& flags, bool overwrite);

// kBadArgument: an option was given that changes none of these files.
Status CheckConvertEffects(const ConvertFlags& flags, std::span<const std::filesystem::path> outputs);

// What becomes one file: `inputs` merged, with the edits that stand behind each, before the first one for all of them,
// and behind `output_at` paths for the result. `output_at` is the number of the output among the paths, from 1; 0: no
// path is one, and all edits are done on each input. Errors: kBadArgument with the edit.
Result<EditJob> MakeEditJob(const EditFlags& flags, std::vector<std::filesystem::path> inputs, size_t output_at,
                            const ConvertOptions& options);

// One file, converted and, with ConvertOptions::measure, compared in pictures of so many views.
struct Converted {
  ConvertReport report;
  std::vector<EditStep> steps;
  bool dry_run = false;
  std::optional<ConversionLoss> loss;
};
Result<Converted> ConvertAndMeasure(const EditJob& job, const std::filesystem::path& output, int views);

// What was done, as --json and Python say it, without the names of the files.
nlohmann::json ToJson(const Converted& converted);

}  // namespace anchorsplat
