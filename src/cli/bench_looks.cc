#include "cli/bench_looks.h"

#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/table.h"
#include "core/text.h"
#include "enhance/enhanced_look.h"
#include "enhance/showing_gaussians.h"
#include "enhance/trained_kind.h"
#include "formats/cloud_io.h"

namespace anchorsplat {

namespace {

struct LooksFlags {
  std::vector<std::string> files;
  bool features = false;
};

Status RunLooks(const LooksFlags& flags, const SharedFlags& shared) {
  if (flags.features && !shared.json) {
    return Error{ErrorCode::kBadArgument, "--features has no effect without --json"};
  }
  nlohmann::json rows = nlohmann::json::array();
  std::vector<std::vector<std::string>> table = {{"file", "Gaussians that show", "looks", "ln odds of enhanced"}};
  for (const std::string& file : flags.files) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud cloud, ReadCloud(file));
    const ShowingGaussians found = FindShowingGaussians(cloud);
    const GaussianCloud& showing = found.all;
    const std::optional<TrainedKind> looks = TrainedKindOf(cloud, found);
    const SizeTails tails = SizeTailsOf(showing);
    FoundTwins twins;
    const std::optional<EnhancedLook> look = FindEnhancedLook(showing, tails, &twins);
    const std::optional<double> harmonics = LikenessOfHarmonics(cloud, found.rows_of_all, twins);
    const double odds = look ? LogOddsOfEnhanced(*look) : std::nan("");
    nlohmann::json row = {{"file", file},        {"showing", showing.size()},       {"looks", nullptr},
                          {"by_sizes", nullptr}, {"log_odds_of_enhanced", nullptr}, {"likeness_of_harmonics", nullptr}};
    if (looks) row["looks"] = NameOf(*looks);
    if (const auto by_sizes = Judge(tails)) row["by_sizes"] = NameOf(*by_sizes);
    if (std::isfinite(odds)) row["log_odds_of_enhanced"] = odds;
    if (harmonics) row["likeness_of_harmonics"] = *harmonics;
    if (flags.features && look) row["features"] = *look;
    rows.push_back(std::move(row));
    table.push_back({file, WithThousands(showing.size()), looks ? std::string(NameOf(*looks)) : "too few",
                     std::isnan(odds)   ? ""
                     : std::isinf(odds) ? "none"
                                        : Fixed(odds, 1)});
  }
  if (shared.json) {
    PrintJson({{"bench", "looks"}, {"splats", rows}});
    return {};
  }
  std::cout << FormatTable(table);
  return {};
}

}  // namespace

void AddLooksBench(CLI::App& bench, Program& program) {
  CLI::App& verb = AddVerb(bench, program, "looks", "What kind of training splats look like, whatever they say",
                           "anchorsplat bench looks examples/biplane/input.ply");
  const auto flags = std::make_shared<LooksFlags>();
  verb.add_option("files", flags->files, "Splat files")->required();
  verb.add_flag("--features", flags->features, "With --json: what tells enhanced splats");
  verb.callback([flags, &program] { program.run = [flags, &program] { return RunLooks(*flags, program.flags); }; });
}

}  // namespace anchorsplat
