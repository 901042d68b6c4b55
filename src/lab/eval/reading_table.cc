#include "eval/reading_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <utility>

#include "core/text.h"
#include "eval/json_lines.h"

namespace anchorsplat {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr double kMostSeconds = 1e6;
constexpr double kMostMultiple = 16;  // beyond, everything is lost

double NumberAt(const json& object, const char* name) {
  const auto found = object.find(name);
  return found == object.end() || found->is_null() ? 0 : found->get<double>();
}

std::string TextAt(const json& object, const char* name) {
  const auto found = object.find(name);
  return found == object.end() || found->is_null() ? "" : found->get<std::string>();
}

// Converts `today` to a decision. Its "looks" are provenances, except "widened".
ReadingDecision TodaysDecision(const json& today) {
  ReadingDecision decision;
  if (today.contains("error")) {
    decision.gain = 0;
    return decision;
  }
  const std::string method = today.at("method").get<std::string>();
  decision.method = method == "none" || NumberAt(today, "strength") == 0 ? "none"
                    : method == "model"                                  ? "network"
                                                                         : method;
  decision.mode = RenderModeNamed(TextAt(today, "mode"));
  decision.pixel = NumberAt(today, "pixel");
  decision.low = NumberAt(today, "low");
  decision.high = NumberAt(today, "high");
  decision.made = TextAt(today, "looks");
  if (today.contains("gain")) decision.gain = NumberAt(today, "gain");
  decision.seconds = NumberAt(today, "seconds");
  decision.one_size = today.value("one_size", false);
  return decision;
}

SplatFeatures FeaturesIn(const json& object) {
  SplatFeatures features{NumberAt(object, "unit"), {}, {}};
  for (const json& value : object.at("features")) {
    features.values.push_back(value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>());
  }
  return features;
}

ReadingRow RowFrom(const json& object) {
  ReadingRow row;
  row.id = object.at("id").get<std::string>();
  for (const auto& [name, text] :
       {std::pair("original", &row.original), std::pair("mesh", &row.mesh), std::pair("maker", &row.maker),
        std::pair("kind", &row.kind), std::pair("edit", &row.edit), std::pair("made", &row.made)}) {
    *text = TextAt(object, name);
  }
  row.tag = RenderModeNamed(TextAt(object, "tag"));
  row.pixel = NumberAt(object, "pixel");
  if (object.contains("gains")) {
    // Wrong types throw.
    for (const auto& [mode_name, methods] : object.at("gains").get_ref<const json::object_t&>()) {
      const std::optional<RenderMode> mode = RenderModeNamed(mode_name);
      if (!mode) continue;
      for (const auto& [method, values] : methods.get_ref<const json::object_t&>()) {
        ReadingGains& gains = row.gains[{*mode, method}];
        for (size_t k = 0; k < gains.size(); ++k) {
          gains[k] = values.at(k).get<double>();  // throws for other types and null
        }
      }
    }
  }
  if (object.contains("list")) row.today = TodaysDecision(object.at("list"));
  row.fold = static_cast<int>(NumberAt(object, "fold"));
  if (object.contains("features")) {
    row.features = FeaturesIn(object);
    for (const json& place : object.value("places", json::array())) row.features.places.push_back(FeaturesIn(place));
  }
  return row;
}

}  // namespace

RenderMode ReadingRow::DrawnMode() const { return tag.value_or(RenderMode::kClassic); }

RenderMode ReadingRow::TrueMode() const {
  if (tag) return *tag;
  return made == "antialiased" ? RenderMode::kAntialiased : RenderMode::kClassic;
}

double ReadingRow::GainOf(const std::string& method, RenderMode mode, double multiple) const {
  if (method == "none") return 0;
  const auto found = gains.find({mode, method});
  if (found == gains.end()) return std::numeric_limits<double>::quiet_NaN();
  const ReadingGains& curve = found->second;
  multiple = std::min(multiple, kMostMultiple);
  if (multiple < kGainMultiples.front()) return curve.front() * std::pow(multiple / kGainMultiples.front(), 2);
  const auto above = std::ranges::upper_bound(kGainMultiples, multiple);
  const size_t k = std::clamp<size_t>(static_cast<size_t>(above - kGainMultiples.begin()), 1, curve.size() - 1);
  if (multiple > kGainMultiples.back() && curve.back() >= curve[curve.size() - 2]) return curve.back();
  const double from = std::log(kGainMultiples[k - 1]), to = std::log(kGainMultiples[k]);
  return curve[k - 1] + (curve[k] - curve[k - 1]) * (std::log(multiple) - from) / (to - from);
}

Result<std::vector<ReadingRow>> ReadReadingTable(const fs::path& path) {
  std::vector<ReadingRow> rows;
  ANCHORSPLAT_RETURN_IF_ERROR(ForEachJsonLine(path, [&](const json& object, int64_t line) -> std::string {
    if (line > 1) {
      const ReadingRow& row = rows.emplace_back(RowFrom(object));
      const size_t values = row.features.values.size(), named = FeatureNames().size();
      const bool agree = std::ranges::all_of(row.features.places, [&](const SplatFeatures& place) {
        return place.unit > 0 && place.values.size() == named;
      });
      return agree && (values == 0 || values == named) ? ""
                                                       : "has another number of features than the first line names";
    }
    const std::vector<double> multiples(kGainMultiples.begin(), kGainMultiples.end());
    const bool known = object.at("table") == "readings" && object.at("multiples") == json(multiples) &&
                       object.at("features") == json(FeatureNames());
    return known ? "" : "not a table of readings of this version";
  }));
  if (rows.empty()) return Error{ErrorCode::kBadFile, Cat(path.string(), ": no rows")};
  return rows;
}

namespace {

// Why no row can judge a decision; empty if one can.
std::string WrongWith(const ReadingDecision& decision, const ReadingRow& row) {
  if (decision.method == "none") return "";
  if (!(decision.pixel > 0) || !std::isfinite(decision.pixel)) return "a treatment needs a pixel above 0";
  const RenderMode mode = decision.mode.value_or(row.DrawnMode());
  if (!row.gains.empty() && !row.gains.contains({mode, decision.method})) {
    return Cat("'", decision.method, "' as ", NameOf(mode), " was not measured for this row",
               row.tag ? Cat(", whose file says ", NameOf(*row.tag)) : "");
  }
  return "";
}

}  // namespace

Result<std::map<std::string, ReadingDecision>> ReadReadingDecisions(const fs::path& path,
                                                                    std::span<const ReadingRow> rows) {
  std::map<std::string, const ReadingRow*> by_id;
  std::set<std::string> words = {"", "widened", "unclear"};
  for (const ReadingRow& row : rows) {
    by_id[row.id] = &row;
    words.insert(row.made);
  }
  const std::set<std::string> properties = {"id", "method", "mode", "pixel", "low", "high", "made", "seconds", "gain"};
  std::map<std::string, ReadingDecision> decisions;
  ANCHORSPLAT_RETURN_IF_ERROR(ForEachJsonLine(path, [&](const json& object, int64_t) -> std::string {
    for (const auto& [name, value] : object.items()) {
      if (!properties.contains(name)) return Cat("unknown property ", Printable(name));
    }
    const auto id = object.at("id").get<std::string>();
    const auto row = by_id.find(id);
    if (row == by_id.end()) return Cat("unknown row ", Printable(id));
    ReadingDecision decision;
    decision.method = object.at("method").get<std::string>();
    if (decision.method != "none" && decision.method != "filter" && decision.method != "network") {
      return Cat("method '", Printable(decision.method), "' is not none, filter or network");
    }
    const std::string mode = TextAt(object, "mode");
    decision.mode = RenderModeNamed(mode);
    if (!mode.empty() && !decision.mode) {
      return Cat("mode '", Printable(mode), "' is not classic, antialiased or mip");
    }
    decision.pixel = NumberAt(object, "pixel");
    decision.low = NumberAt(object, "low");
    decision.high = NumberAt(object, "high");
    const bool interval = decision.low > 0 && decision.high >= decision.low && std::isfinite(decision.high);
    if (!interval && (decision.low != 0 || decision.high != 0)) return "low and high must be positive, in this order";
    decision.made = TextAt(object, "made");
    if (!words.contains(decision.made)) return Cat("made: unknown value ", Printable(decision.made));
    if (object.contains("gain")) decision.gain = object.at("gain").get<double>();
    decision.seconds = NumberAt(object, "seconds");
    if (!(decision.seconds >= 0 && decision.seconds < kMostSeconds)) return "seconds are out of range";
    if (std::string wrong = WrongWith(decision, *row->second); !wrong.empty()) return wrong;
    if (!decisions.emplace(id, std::move(decision)).second) return Cat(Printable(id), " has two decisions");
    return "";
  }));
  return decisions;
}

}  // namespace anchorsplat
