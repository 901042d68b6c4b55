#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/render_mode.h"
#include "core/result.h"
#include "eval/reading_row.h"
#include "reading/features.h"
#include "reading/reading_model.h"

namespace anchorsplat {

// Gain in dB over the splat as it is, at kGainMultiples of its true pixels.
using ReadingGains = std::array<double, kGainMultiples.size()>;

// What a decider says of one splat and does with it.
struct ReadingDecision {
  std::string method = "none";     // none, filter, network
  std::optional<RenderMode> mode;  // as which it is treated and drawn; nothing: as its file says, else classic
  double pixel = 0;                // that is treated, world units
  double low = 0, high = 0;        // of the interval that is said to hold the true pixel; 0: none is
  std::string made;                // what it is taken for; empty: nothing is said
  std::optional<double> gain;      // measured; nothing: that of the row's curve
  bool one_size = true;            // the pixel is that of all Gaussians, at the strength that is usual in that mode
  double seconds = 0;
};

// A row of the table.
struct ReadingRow {
  std::string id, original, mesh, maker, kind, edit, made;
  std::optional<RenderMode> tag;
  double pixel = 0;                                                  // true; 0: not known, and there are no gains
  std::map<std::pair<RenderMode, std::string>, ReadingGains> gains;  // by mode and method, "filter" or "network"
  ReadingDecision today;                                             // of the list of rules before there was a model
  int fold = 0;
  SplatFeatures features;  // no values: almost nothing of it shows

  RenderMode DrawnMode() const;  // as its file says, else classic
  RenderMode TrueMode() const;   // as its file says, else as it was trained
  // Of treating a `multiple` of the true pixel: linear in the logarithm between those that were measured, with the
  // square of it below them, and never rising above them: nothing is known there, but that wider is worse in the end.
  // 0 where the method is "none"; NaN where that was not measured of the row.
  double GainOf(const std::string& method, RenderMode mode, double multiple) const;
};

// Lines of JSON, plain or as .gz: the first says what the columns are, the others are ReadingRows' rows.
// Errors: kNotFound, kIo, kBadFile naming the line.
Result<std::vector<ReadingRow>> ReadReadingTable(const std::filesystem::path& path);

// Lines of JSON, one per row that is decided: id, method, mode, pixel, low, high, made, seconds. Errors: the same, and
// kBadFile where a decision cannot be judged by the rows: an id that none has, a treatment that was not measured of it
// or is without a pixel, what is neither a length nor an interval, a word for `made` that no row has.
Result<std::map<std::string, ReadingDecision>> ReadReadingDecisions(const std::filesystem::path& path,
                                                                    std::span<const ReadingRow> rows);

}  // namespace anchorsplat
