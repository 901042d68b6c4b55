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

// Performance of a decider on rows of the table.
struct ReadingScore {
  std::string group;                    // kReadingAll, or a kind of splat, or an edit
  int64_t rows = 0;                     // with gains
  double mean = 0, worst = 0, low = 0;  // gain over the unchanged splat, dB; `low`: the 2 % quantile
  std::string worst_id;
  double losing = 0;  // share of rows that lose more than kReadingLoss
  // For deciders that give intervals or provenances at all; rows without one count as wrong.
  int64_t intervals = 0, held = 0;    // rows with a true pixel, and those whose interval contains it
  double width = 0;                   // upper over lower ends of the intervals, geometric mean
  int64_t named = 0, recognised = 0;  // rows without a tag, and those whose provenance is recognised
  int64_t could_be_accused = 0;       // of these, rows that have lost width
  int64_t accused = 0;                // and are classified as having full width: mip, widened, filtered, enhanced, mesh
  double seconds = 0;                 // median
};
inline constexpr double kReadingLoss = 0.1;  // dB
inline constexpr const char* kReadingAll = "all";

// A decision for each row that has gains, in row order.
using Decisions = std::vector<ReadingDecision>;

Decisions TodaysDecisions(std::span<const ReadingRow> rows);
// The best of all that was measured, including no change: an upper bound.
Decisions BestDecisions(std::span<const ReadingRow> rows);
// Uses the single multiple of the true pixel that is best on average over all rows, with `method` in the true mode: the
// value of knowing the pixel. `multiple`: receives it.
Decisions FixedDecisions(std::span<const ReadingRow> rows, const std::string& method, double& multiple);
// Decisions from `given`; rows not in it are left unchanged.
Decisions GivenDecisions(std::span<const ReadingRow> rows, const std::map<std::string, ReadingDecision>& given);

// Decisions of Read and Treat on the rows' features, each by the model of its fold: models[row.fold] (docs/reading.md).
// `loss_weight`: TreatmentRequest::loss_weight. `picture_scale`: with cameras, of pictures this many times larger than
// those of the training; 0: without.
Decisions ReadDecisions(std::span<const ReadingRow> rows, std::span<const ReadingModel> models,
                        double loss_weight = kLossWeight, double picture_scale = 0);

// Scores `decisions[i]` on rows[i]: first all rows, then unedited splats by kind, then edits, each by name. Rows
// without gains count for seconds and provenance.
std::vector<ReadingScore> ScoreReadings(std::span<const ReadingRow> rows, const Decisions& decisions);

// Confusion matrix of provenances for splats whose file does not state the render mode: by ReadingRow::made, then by
// ReadingDecision::made ("nothing": none given).
std::map<std::string, std::map<std::string, int64_t>> TakenFor(std::span<const ReadingRow> rows,
                                                               const Decisions& decisions);

// Error of gains taken from curves against gains measured for the same decisions: median and 95 % quantile of absolute
// differences over rows that have both, dB. This is the accuracy to which unmeasured decisions are known.
struct CurveError {
  int64_t rows = 0;
  double median = 0, most = 0;
};
CurveError ErrorOfCurves(std::span<const ReadingRow> rows);

}  // namespace anchorsplat
