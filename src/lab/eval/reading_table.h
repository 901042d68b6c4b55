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

// Gains in dB over the unchanged splat, at kGainMultiples of its true pixel.
using ReadingGains = std::array<double, kGainMultiples.size()>;

// A decider's verdict on one splat.
struct ReadingDecision {
  std::string method = "none";     // none, filter, network
  std::optional<RenderMode> mode;  // for treatment and rendering; unset: the file's, else classic
  double pixel = 0;                // assumed training pixel, world units
  double low = 0, high = 0;        // interval for the true pixel; 0: none given
  std::string made;                // provenance; empty: none given
  std::optional<double> gain;      // measured; unset: from the row's curve
  bool one_size = true;            // one pixel size for all Gaussians, at the mode's default strength
  double seconds = 0;
};

// A row of the table.
struct ReadingRow {
  std::string id, original, mesh, maker, kind, edit, made;
  std::optional<RenderMode> tag;
  double pixel = 0;                                                  // true one; 0: unknown, so there are no gains
  std::map<std::pair<RenderMode, std::string>, ReadingGains> gains;  // by mode and method, "filter" or "network"
  ReadingDecision today;                                             // of the rules that preceded the model
  int fold = 0;
  SplatFeatures features;  // no values: almost nothing of it shows

  RenderMode DrawnMode() const;  // the file's, else classic
  RenderMode TrueMode() const;   // the file's, else that of training
  // Gain of treating with a `multiple` of the true pixel: interpolated linearly in the logarithm, falling with the
  // square below the measured multiples and never rising above them (unknown there, except that wider is eventually
  // worse). 0 for method "none"; NaN if not measured for this row.
  double GainOf(const std::string& method, RenderMode mode, double multiple) const;
};

// Reads lines of JSON, plain or .gz: first a description of the columns, then ReadingRows' rows.
// Errors: kNotFound, kIo, kBadFile naming the line.
Result<std::vector<ReadingRow>> ReadReadingTable(const std::filesystem::path& path);

// Reads one JSON decision per line: id, method, mode, pixel, low, high, made, seconds. Errors: as ReadReadingTable;
// kBadFile also for decisions that the rows cannot judge: an unknown id, a treatment that was not measured or lacks a
// pixel, an invalid length or interval, a value of `made` that no row has.
Result<std::map<std::string, ReadingDecision>> ReadReadingDecisions(const std::filesystem::path& path,
                                                                    std::span<const ReadingRow> rows);

}  // namespace anchorsplat
