#include "cli/bench_pixel_size.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/table.h"
#include "core/log.h"
#include "core/statistics.h"
#include "core/text.h"
#include "eval/pixel_size_check.h"
#include "request/findings.h"

namespace anchorsplat {

namespace {

struct PixelSizeFlags {
  std::vector<std::string> folders;
  bool features = false;
};

nlohmann::json ToJson(const PixelSizeCheck& check, const std::string& kind) {
  nlohmann::json json = {{"object", check.object},
                         {"kind", kind},
                         {"mode", NameOf(check.mode)},
                         {"pixel_size", check.truth},
                         {"start", check.start},
                         {"estimate", check.estimate.size},
                         {"low", check.estimate.low},
                         {"high", check.estimate.high},
                         {"seconds", check.seconds},
                         {"unlike_standard", check.estimate.unlike_standard},
                         {"strangeness", check.estimate.strangeness},
                         {"disagreement", check.estimate.disagreement},
                         {"softness", check.estimate.softness},
                         {"showing", check.estimate.showing},
                         {"cut_outlines", check.estimate.cut_outlines},
                         {"coarse_outlines", check.estimate.coarse_outlines},
                         {"unevenness", check.evidence.unevenness},
                         {"dense", check.evidence.dense},
                         {"growth", check.evidence.growth},
                         {"flatness", check.evidence.flatness},
                         {"fill", check.evidence.fill},
                         {"roundness", check.evidence.roundness},
                         {"shared", check.evidence.sides.shared},
                         {"coarser", check.evidence.sides.coarser},
                         {"things", ToJson(check.things)}};
  for (const PixelSizeCheck::Sample& sample : check.samples) {
    json["samples"].push_back({{"size", sample.size}, {"features", sample.features}});
  }
  if (!check.samples.empty()) json["best_strength"] = check.best_strength;
  return json;
}

Status RunPixelSize(const PixelSizeFlags& flags, const SharedFlags& shared) {
  nlohmann::json json = {
      {"bench", "pixel-size"}, {"objects", nlohmann::json::array()}, {"without_estimate", nlohmann::json::array()}};
  std::vector<std::vector<std::string>> table = {{"object", "true", "estimated", "÷ true", "likely", "time"}};
  std::vector<float> errors;
  for (const std::string& folder : flags.folders) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<BenchmarkEntry> entries, ListBenchmark(folder));
    for (const BenchmarkEntry& entry : entries) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const BenchmarkObject object, OpenObject(entry));
      const Result<PixelSizeCheck> checked = CheckPixelSize(object, flags.features);
      if (!checked.ok()) {
        // One splat that shows next to nothing is no reason to lose a list of hundreds.
        const std::string why = Cat(entry.name, ": ", checked.error().message);
        LogWarning(why);
        json["without_estimate"].push_back(
            {{"object", entry.name}, {"kind", entry.kind}, {"why", checked.error().message}});
        continue;
      }
      const PixelSizeCheck& check = checked.value();
      const double ratio = check.estimate.size / check.truth;
      errors.push_back(static_cast<float>(std::abs(ratio - 1)));
      json["objects"].push_back(ToJson(check, entry.kind));
      table.push_back(
          {check.object, Cat(check.truth), Cat(check.estimate.size), Fixed(ratio, 2),
           Cat(Fixed(check.estimate.low / check.truth, 2), "–", Fixed(check.estimate.high / check.truth, 2)),
           HumanSeconds(check.seconds)});
    }
  }
  if (errors.empty()) return Error{ErrorCode::kBadFile, "none of these splats has an estimate"};
  const double median = double{Quantile(errors, 0.5)}, most = double{Quantile(errors, 0.95)};
  if (shared.json) {
    json["error_median"] = median;
    json["error_p95"] = most;
    PrintJson(json);
    return {};
  }
  std::cout << FormatTable(table) << "\noff by " << Fixed(100 * median, 1) << " % in the median, "
            << Fixed(100 * most, 1) << " % at the 95th percentile; likely: the interval, ÷ true\n";
  return {};
}

}  // namespace

void AddPixelSizeBench(CLI::App& bench, Program& program) {
  CLI::App& verb = AddVerb(bench, program, "pixel-size", "The estimated size of a training pixel against the true one",
                           "anchorsplat bench pixel-size examples");
  const auto flags = std::make_shared<PixelSizeFlags>();
  verb.add_option("folders", flags->folders, "Benchmarks, as for eval")->required()->check(CLI::ExistingDirectory);
  verb.add_flag("--features", flags->features, "With --json: what the estimate is made from, around the true size");
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunPixelSize(*flags, program.flags); }; });
}

}  // namespace anchorsplat
