#include "metrics/compare.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>

#include "cli/clean_output.h"
#include "cli/help.h"
#include "cli/lab.h"
#include "cli/table.h"
#include "cli/verb.h"
#include "compare/view_source.h"
#include "core/log.h"
#include "core/text.h"
#include "images/image_io.h"
#include "io/atomic_file.h"
#include "io/input_record.h"
#include "io/json_file.h"
#include "metrics/side_by_side.h"
#include "request/choice.h"
#include "request/compare_flags.h"
#include "request/parse.h"
#include "request/words.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

struct CompareWords {
  std::string a;
  std::string b;
  std::string truth;
  std::string side_by_side;
  std::string lpips;
  std::string lpips_weights;
  bool summary = false;
  CompareFlags how;
};

std::string Signed(double gain) { return (gain >= 0 ? "+" : "") + Fixed(gain, 2); }

void PrintTable(const CompareWords& flags, const std::vector<Comparison>& results) {
  const bool lpips = results[0].mean_lpips.has_value(), corrected = results[0].mean_corrected.has_value();
  std::vector<std::vector<std::string>> rows = {{"view"}};
  for (size_t k = 0; k < results.size(); ++k) {
    const std::string side = results.size() == 1 ? "" : k == 0 ? "A " : "B ";
    for (const char* kind : {"", "cc "}) {
      if (*kind != 0 && !corrected) continue;
      for (const char* metric : {"PSNR", "SSIM", "LPIPS"}) {
        if (lpips || metric != std::string("LPIPS")) rows[0].push_back(Cat(side, kind, metric));
      }
    }
  }
  if (results.size() == 2) {
    rows[0].push_back("gain dB");
    if (corrected) rows[0].push_back("cc gain dB");
    std::cout << "A  " << OneLine(flags.a) << "\nB  " << OneLine(flags.b) << "\nboth against  " << OneLine(flags.truth)
              << "\n\n";
  }
  const auto add = [&](const std::string& name, const auto& score_of) {
    std::vector<std::string> row = {name};
    std::vector<double> psnr, cc_psnr;
    const auto add_score = [&](const auto& score, std::vector<double>& of_kind) {
      of_kind.push_back(score.psnr);
      row.push_back(Fixed(score.psnr, 2));
      row.push_back(Fixed(score.ssim, 4));
      if (lpips) row.push_back(Fixed(score.lpips.value_or(0), 4));
    };
    for (const Comparison& result : results) {
      const ViewScore score = score_of(result);
      add_score(score, psnr);
      if (corrected) add_score(*score.corrected, cc_psnr);
    }
    if (results.size() == 2) row.push_back(Signed(psnr[1] - psnr[0]));
    if (results.size() == 2 && corrected) row.push_back(Signed(cc_psnr[1] - cc_psnr[0]));
    rows.push_back(row);
  };
  for (size_t v = 0; v < results[0].views.size() && !flags.summary; ++v) {
    add(results[0].views[v].name, [v](const Comparison& c) { return c.views[v]; });
  }
  add("mean", MeanOf);
  std::cout << FormatTable(rows);
}

// The view with the median score, as an example that is neither the best nor the worst.
size_t MedianView(const Comparison& comparison) {
  std::vector<size_t> order(comparison.views.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t x, size_t y) { return comparison.views[x].psnr < comparison.views[y].psnr; });
  return order[order.size() / 2];
}

// The last two parts of a path, such as "biplane/input.ply".
std::string ShortName(const fs::path& path) {
  const fs::path parent =
      path.has_filename() ? path.parent_path().filename() : path.parent_path().parent_path().filename();
  return (parent / (path.has_filename() ? path.filename() : path.parent_path().filename())).string();
}

Status WriteSideBySide(const CompareWords& flags, Sides& sides, const std::vector<Comparison>& results,
                       const SharedFlags& shared) {
  std::vector<ViewSource*> sources = {sides.a.get()};
  ViewSource& reference = sides.truth ? *sides.truth : *sides.b;
  if (sides.truth) sources.push_back(sides.b.get());
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto partners, MatchSources(sources, reference));
  const size_t row = MedianView(results.back()), view = results.back().views[row].reference_view;

  std::vector<Image> pictures;
  for (size_t s = 0; s < sources.size(); ++s) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(pictures.emplace_back(), sources[s]->Load(partners[s][view]));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(pictures.emplace_back(), reference.Load(view));
  const std::array<std::string, 2> names = {flags.a, flags.b};
  std::vector<LabelledImage> images;
  for (size_t s = 0; s < sources.size(); ++s) {
    const ViewScore& score = results[s].views[row];
    images.push_back(
        {ShortName(names[s]), Cat(Fixed(score.psnr, 2), " dB  SSIM ", Fixed(score.ssim, 4)), &pictures[s]});
  }
  images.push_back(
      {sides.truth ? "ground truth" : ShortName(flags.b), "view " + results[0].views[row].name, &pictures.back()});
  sources.push_back(&reference);
  std::vector<std::string> credits;
  for (const ViewSource* source : sources) {
    for (const std::string& credit : source->credits()) {
      if (std::ranges::find(credits, credit) == credits.end()) credits.push_back(credit);
    }
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Image picture, SideBySide(images, {.credits = credits}));
  return WritePng(flags.side_by_side, picture, WriteOptionsFrom(shared));
}

Status RunCompare(const CompareWords& flags, const SharedFlags& shared) {
  const DeviceUse device;
  if (!flags.side_by_side.empty()) {
    if (!IsPngName(flags.side_by_side)) {
      return Error{ErrorCode::kBadArgument,
                   Cat("--side-by-side ", flags.side_by_side, ": pictures are written as .png")};
    }
    ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(flags.side_by_side, shared.overwrite));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(Sides sides, OpenSides(flags.how, {flags.a, nullptr, nullptr},
                                                      {flags.b, nullptr, nullptr}, {flags.truth, nullptr, nullptr}));
  if (!flags.side_by_side.empty()) ANCHORSPLAT_RETURN_IF_ERROR(CheckNotInput(flags.side_by_side));
  std::vector<ViewSource*> sources = {sides.a.get()};
  if (sides.truth) sources.push_back(sides.b.get());
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PictureDistance lpips, OpenLpipsDistance(flags.lpips, flags.lpips_weights));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto results,
                               CompareToReference(sources, sides.truth ? *sides.truth : *sides.b,
                                                  {.lpips = lpips, .color_correct = flags.how.color_correct}));
  if (!flags.side_by_side.empty()) {
    ANCHORSPLAT_RETURN_IF_ERROR(WriteSideBySide(flags, sides, results, shared));
  }
  if (shared.json) {
    nlohmann::json json = ToJson(results);
    json["device"] = device.ToJson();
    PrintJson(json);
  } else {
    PrintTable(flags, results);
    if (flags.truth.empty() && !LooksLikeImages(flags.b)) {
      LogInfo(
          "PSNR and SSIM show here how alike A and B are, not which is better. To measure quality, pass ground "
          "truth with --truth");
    }
  }
  return {};
}

}  // namespace

void AddCompare(CLI::App& app, Program& program) {
  CLI::App& verb =
      AddVerb(app, program, "compare", "PSNR, SSIM and LPIPS of two splats, folders of pictures or pictures",
              "anchorsplat compare before.ply after.ply --truth photos/ --cameras transforms.json");
  const auto flags = std::make_shared<CompareWords>();
  verb.add_option("a", flags->a, "Splat, folder of pictures or picture")->required()->check(NotEmpty());
  verb.add_option("b", flags->b, "The same kinds; the reference for A, unless --truth is given")
      ->required()
      ->check(NotEmpty());
  verb.add_option("--truth", flags->truth,
                  "Ground truth (splat or pictures): measure A and B against it, and the gain of B over A")
      ->type_name("PATH")
      ->check(NotEmpty());
  verb.add_option("--side-by-side", flags->side_by_side,
                  "PNG of the view with the median score: pictures, zoomed crop, difference")
      ->type_name("FILE")
      ->check(NotEmpty());
  verb.add_flag("--summary", flags->summary, "Print only the means, not every view; --json always has both");
  AddLpipsFlags(verb, flags->lpips, flags->lpips_weights);
  flags->how.AddTo(verb);
  program.device.AddTo(verb);
  ShortenHelp(verb, {"--truth", "--cameras", "--orbit", "--view", "--size", "--background", "--side-by-side",
                     "--summary", "--lpips", "--color-correct", "--device", "--overwrite", "--quiet", "--json"});
  verb.callback([flags, &verb, &program] {
    flags->how.given = GivenOptions(verb);
    program.run = [flags, &program] { return RunCompare(*flags, program.flags); };
  });
}

}  // namespace anchorsplat
