#include "eval/reading_score.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/buffer.h"
#include "core/statistics.h"
#include "reading/reading.h"

namespace anchorsplat {

namespace {

bool HasGains(const ReadingRow& row) { return row.pixel > 0 && !row.gains.empty(); }

bool WasMeasured(const ReadingRow& row, const std::string& method) {
  return HasGains(row) && row.gains.contains({row.TrueMode(), method});
}

// Class of a provenance: those with full width count as one, whatever the reason.
std::string_view Word(std::string_view made) {
  return made == "mip" || made == "filtered" || made == "mesh" ? "widened" : made;
}

bool HasFullWidth(std::string_view made) {
  const std::string_view word = Word(made);
  return word == "widened" || word == "enhanced";
}

double GainOf(const ReadingRow& row, const ReadingDecision& decision) {
  if (decision.gain) return *decision.gain;
  return row.GainOf(decision.method, decision.mode.value_or(row.DrawnMode()), decision.pixel / row.pixel);
}

std::string GroupOf(const ReadingRow& row) { return row.edit.empty() ? row.kind : "edit: " + row.edit; }

// What a decider provides at all: if for some rows only, it counts as wrong for the others.
struct Says {
  bool made = false, intervals = false;
};

ReadingScore ScoreGroup(std::span<const ReadingRow> rows, const Decisions& decisions, const std::vector<size_t>& of,
                        const Says& says) {
  ReadingScore score;
  Buffer<float> gains, seconds;
  double log_widths = 0;
  int64_t widths = 0;
  double sum = 0;
  score.worst = std::numeric_limits<double>::infinity();
  for (const size_t i : of) {
    const ReadingRow& row = rows[i];
    const ReadingDecision& decision = decisions[i];
    seconds.push_back(static_cast<float>(decision.seconds));
    // Tagged files need no recognition.
    if (says.made && !row.made.empty() && !row.tag) {
      const std::string_view said = Word(decision.made);
      ++score.named;
      if (said == Word(row.made)) ++score.recognised;
      if (!HasFullWidth(row.made)) {
        ++score.could_be_accused;
        if (HasFullWidth(said)) ++score.accused;
      }
    }
    if (!HasGains(row)) continue;
    const double gain = GainOf(row, decision);
    ++score.rows;
    sum += gain;
    gains.push_back(static_cast<float>(gain));
    if (gain < -kReadingLoss) score.losing += 1;
    if (gain < score.worst) {
      score.worst = gain;
      score.worst_id = row.id;
    }
    if (says.intervals) ++score.intervals;
    if (decision.high > 0) {
      if (decision.low <= row.pixel && row.pixel <= decision.high) ++score.held;
      log_widths += std::log(decision.high) - std::log(decision.low);
      ++widths;
    }
  }
  if (score.rows > 0) {
    score.mean = sum / static_cast<double>(score.rows);
    score.low = double{Quantile(gains, 0.02)};
    score.losing /= static_cast<double>(score.rows);
  } else {
    score.worst = 0;
  }
  score.seconds = double{Quantile(seconds, 0.5)};
  if (widths > 0) score.width = std::exp(log_widths / static_cast<double>(widths));
  return score;
}

}  // namespace

Decisions TodaysDecisions(std::span<const ReadingRow> rows) {
  Decisions decisions;
  for (const ReadingRow& row : rows) decisions.push_back(row.today);
  return decisions;
}

Decisions BestDecisions(std::span<const ReadingRow> rows) {
  Decisions decisions;
  for (const ReadingRow& row : rows) {
    ReadingDecision best;
    best.gain = 0;
    for (const auto& [key, gains] : row.gains) {
      for (size_t k = 0; k < gains.size(); ++k) {
        if (!(gains[k] > *best.gain)) continue;
        best.mode = key.first;
        best.method = key.second;
        best.pixel = kGainMultiples[k] * row.pixel;
        best.gain = gains[k];
      }
    }
    decisions.push_back(std::move(best));
  }
  return decisions;
}

Decisions FixedDecisions(std::span<const ReadingRow> rows, const std::string& method, double& multiple) {
  double most = -std::numeric_limits<double>::infinity();
  for (const double tried : kGainMultiples) {
    double sum = 0;
    for (const ReadingRow& row : rows) {
      if (WasMeasured(row, method)) sum += row.GainOf(method, row.TrueMode(), tried);
    }
    if (sum <= most) continue;
    most = sum;
    multiple = tried;
  }
  Decisions decisions;
  for (const ReadingRow& row : rows) {
    ReadingDecision& decision = decisions.emplace_back();
    if (!WasMeasured(row, method)) continue;
    decision.method = method;
    decision.mode = row.TrueMode();
    decision.pixel = multiple * row.pixel;
  }
  return decisions;
}

Decisions GivenDecisions(std::span<const ReadingRow> rows, const std::map<std::string, ReadingDecision>& given) {
  Decisions decisions;
  for (const ReadingRow& row : rows) {
    const auto found = given.find(row.id);
    decisions.push_back(found == given.end() ? ReadingDecision{} : found->second);
  }
  return decisions;
}

Decisions ReadDecisions(std::span<const ReadingRow> rows, std::span<const ReadingModel> models, double loss_weight,
                        double picture_scale) {
  Decisions decisions;
  for (const ReadingRow& row : rows) {
    ReadingDecision& decision = decisions.emplace_back();
    if (row.features.values.empty()) continue;
    const Reading reading = ReadFrom(row.features, models[static_cast<size_t>(row.fold) % models.size()]);
    TreatmentRequest request{.mode = row.tag, .loss_weight = loss_weight};
    if (picture_scale > 0) {
      if (!(row.pixel > 0)) continue;
      const double pixel = row.pixel / picture_scale;
      request.pixel = pixel / LikeliestShrink(reading, pixel);
    }
    const Treatment treatment = Treat(reading, request);
    decision.low = reading.low;
    decision.high = reading.high;
    decision.made = NameOf(reading.likeliest());
    if (treatment.method == TreatmentMethod::kNone) continue;
    decision.method = treatment.method == TreatmentMethod::kNetwork ? "network" : "filter";
    decision.mode = treatment.mode;
    decision.pixel = treatment.pixel;
  }
  return decisions;
}

std::vector<ReadingScore> ScoreReadings(std::span<const ReadingRow> rows, const Decisions& decisions) {
  std::vector<size_t> all;
  std::map<std::pair<bool, std::string>, std::vector<size_t>> groups;  // kinds, then edits
  for (size_t i = 0; i < rows.size(); ++i) {
    all.push_back(i);
    groups[{!rows[i].edit.empty(), GroupOf(rows[i])}].push_back(i);
  }
  Says says;
  for (const ReadingDecision& decision : decisions) {
    says.made = says.made || !decision.made.empty();
    says.intervals = says.intervals || decision.high > 0;
  }
  std::vector<ReadingScore> scores = {ScoreGroup(rows, decisions, all, says)};
  scores[0].group = kReadingAll;
  for (const auto& [key, of] : groups) {
    scores.push_back(ScoreGroup(rows, decisions, of, says));
    scores.back().group = key.second;
  }
  return scores;
}

std::map<std::string, std::map<std::string, int64_t>> TakenFor(std::span<const ReadingRow> rows,
                                                               const Decisions& decisions) {
  std::map<std::string, std::map<std::string, int64_t>> counts;
  for (size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].tag || rows[i].made.empty()) continue;
    ++counts[rows[i].made][decisions[i].made.empty() ? "nothing" : decisions[i].made];
  }
  return counts;
}

CurveError ErrorOfCurves(std::span<const ReadingRow> rows) {
  Buffer<float> errors;
  for (const ReadingRow& row : rows) {
    // Only decisions with a single pixel at the mode's default strength: those were measured at multiples of the true
    // one.
    if (!HasGains(row) || !row.today.gain || row.today.method == "none" || !row.today.one_size) continue;
    ReadingDecision by_curve = row.today;
    by_curve.gain.reset();
    const double gain = GainOf(row, by_curve);
    if (std::isfinite(gain)) errors.push_back(static_cast<float>(std::abs(gain - *row.today.gain)));
  }
  CurveError error;
  error.rows = std::ssize(errors);
  if (errors.empty()) return error;
  error.median = double{Quantile(errors, 0.5)};
  error.most = double{Quantile(errors, 0.95)};
  return error;
}

}  // namespace anchorsplat
