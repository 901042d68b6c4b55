#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "eval/reading_table.h"
#include "reading/reading_model.h"
#include "reading/treatment.h"

namespace anchorsplat {

// What a decider reaches on rows of the table.
struct ReadingScore {
  std::string group;                    // of kReadingAll: all rows; else a kind, or an edit of any kind
  int64_t rows = 0;                     // with gains
  double mean = 0, worst = 0, low = 0;  // gain over the splat as it is, dB; `low`: the 2 % quantile
  std::string worst_id;
  double losing = 0;  // share of the rows that lose more than kReadingLoss
  // Of a decider that says intervals, or how splats were made, at all: rows of which it says nothing are wrong ones.
  int64_t intervals = 0, held = 0;    // rows with a true pixel, and those whose interval holds it
  double width = 0;                   // upper ends of the intervals over their lower ones, geometric mean
  int64_t named = 0, recognised = 0;  // rows without a tag, and those that are taken for what they are
  int64_t could_be_accused = 0;       // of these: that have lost width
  int64_t accused = 0;                // and are said to have all of theirs: mip, widened, filtered, enhanced, mesh
  double seconds = 0;                 // median
};
inline constexpr double kReadingLoss = 0.1;  // dB
inline constexpr const char* kReadingAll = "all";

// A decision for every row that has gains, in the order of the rows.
using Decisions = std::vector<ReadingDecision>;

Decisions TodaysDecisions(std::span<const ReadingRow> rows);
// The best of all that was measured, leaving the splat alone included: a bound, which no decider reaches.
Decisions BestDecisions(std::span<const ReadingRow> rows);
// The one multiple of the true pixel that is best for all rows in the mean, with that method, in the true mode: what
// knowing the pixel alone is worth. `multiple`: which it is.
Decisions FixedDecisions(std::span<const ReadingRow> rows, const std::string& method, double& multiple);
// Rows that `given` does not name are left alone.
Decisions GivenDecisions(std::span<const ReadingRow> rows, const std::map<std::string, ReadingDecision>& given);

// What Read and Treat say of the rows' features, of each by the model of its fold: models[row.fold] (docs/reading.md).
// `losses_count`: TreatmentRequest::losses_count.
Decisions ReadDecisions(std::span<const ReadingRow> rows, std::span<const ReadingModel> models,
                        double losses_count = kLossesCount);

// `decisions[i]` is of rows[i]. All rows first, then kinds of splats that nobody has edited, then edits, each in order
// of their names. Rows without gains count for seconds and for what they are taken for.
std::vector<ReadingScore> ScoreReadings(std::span<const ReadingRow> rows, const Decisions& decisions);

// How often splats that were made so, and whose files do not say how they are to be drawn, are taken for what: by
// ReadingRow::made, then by ReadingDecision::made ("nothing": none is said).
std::map<std::string, std::map<std::string, int64_t>> TakenFor(std::span<const ReadingRow> rows,
                                                               const Decisions& decisions);

// How far the gains that curves say are from those that were measured of the same decisions: median and 95 % quantile
// of the absolute differences over the rows that have both, dB. What a decision that was not measured is worth is known
// to that.
struct CurveError {
  int64_t rows = 0;
  double median = 0, most = 0;
};
CurveError ErrorOfCurves(std::span<const ReadingRow> rows);

}  // namespace anchorsplat
