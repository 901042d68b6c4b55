#include "eval/reading_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/text.h"
#include "io/inflating_reader.h"
#include "io/input_file.h"

namespace anchorsplat {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr size_t kMostBytes = size_t{1} << 30;  // of a table: ours have 20 MB

Result<std::string> ReadText(const fs::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const InputFile file, InputFile::Open(path));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string head, file.Head(2));
  const std::unique_ptr<InflatingReader> reader = head == "\x1f\x8b" ? OpenGzip(file, 0) : OpenPlain(file, 0);
  std::string text;
  for (std::string block(size_t{1} << 20, '\0');;) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t count, reader->ReadSome(block.data(), block.size()));
    if (count == 0) return text;
    if (text.size() + count > kMostBytes) {
      return Error{ErrorCode::kBadFile, Cat(path.string(), ": larger than ", HumanBytes(kMostBytes))};
    }
    text.append(block, 0, count);
  }
}

// Calls `take` (const json&, line) for every line; its exceptions of JSON become errors.
template <typename Take>
Status ForEachLine(const fs::path& path, Take&& take) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, ReadText(path));
  int64_t line = 0;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    ++line;
    try {
      take(json::parse(text.begin() + static_cast<std::ptrdiff_t>(at), text.begin() + static_cast<std::ptrdiff_t>(end)),
           line);
    } catch (const json::exception& e) {
      return Error{ErrorCode::kBadFile, Cat(path.string(), ": line ", line, ": ", e.what())};
    }
    at = end + 1;
  }
  return {};
}

double NumberAt(const json& object, const char* name) {
  const auto found = object.find(name);
  return found == object.end() || found->is_null() ? 0 : found->get<double>();
}

std::string TextAt(const json& object, const char* name) {
  const auto found = object.find(name);
  return found == object.end() || found->is_null() ? "" : found->get<std::string>();
}

// What `today` says in the words of a decision. The names of looks are those of how splats are made, but for "widened".
ReadingDecision TodaysDecision(const json& today, const ReadingRow& row) {
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
  if (decision.made.empty() && row.tag) decision.made = NameOf(*row.tag);
  if (today.contains("gain")) decision.gain = NumberAt(today, "gain");
  decision.seconds = NumberAt(today, "seconds");
  decision.one_size = today.value("one_size", false);
  return decision;
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
    for (const auto& [mode_name, methods] : object.at("gains").items()) {
      const std::optional<RenderMode> mode = RenderModeNamed(mode_name);
      if (!mode) continue;
      for (const auto& [method, values] : methods.items()) {
        ReadingGains& gains = row.gains[{*mode, method}];
        for (size_t k = 0; k < gains.size(); ++k) {
          const json& value = values.at(k);
          gains[k] = value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
        }
      }
    }
  }
  row.today = TodaysDecision(object.at("today"), row);
  return row;
}

}  // namespace

RenderMode ReadingRow::TrueMode() const {
  if (tag) return *tag;
  return made == "antialiased" ? RenderMode::kAntialiased : RenderMode::kClassic;
}

double ReadingRow::GainOf(const std::string& method, RenderMode mode, double multiple) const {
  if (method == "none" || !(multiple > 0)) return 0;
  const auto found = gains.find({mode, method});
  if (found == gains.end()) return std::numeric_limits<double>::quiet_NaN();
  const ReadingGains& curve = found->second;
  if (multiple < kReadingMultiples.front()) return curve.front() * std::pow(multiple / kReadingMultiples.front(), 2);
  const auto above = std::ranges::upper_bound(kReadingMultiples, multiple);
  const size_t k = std::clamp<size_t>(static_cast<size_t>(above - kReadingMultiples.begin()), 1, curve.size() - 1);
  const double from = std::log(kReadingMultiples[k - 1]), to = std::log(kReadingMultiples[k]);
  return curve[k - 1] + (curve[k] - curve[k - 1]) * (std::log(multiple) - from) / (to - from);
}

Result<std::vector<ReadingRow>> ReadReadingTable(const fs::path& path) {
  std::vector<ReadingRow> rows;
  bool is_table = true;
  ANCHORSPLAT_RETURN_IF_ERROR(ForEachLine(path, [&](const json& object, int64_t line) {
    if (line == 1) {
      is_table = object.is_object() && object.value("table", "") == "readings" &&
                 object.at("multiples").get<std::vector<double>>() ==
                     std::vector<double>(kReadingMultiples.begin(), kReadingMultiples.end());
    } else if (is_table) {
      rows.push_back(RowFrom(object));
    }
  }));
  if (!is_table || rows.empty()) {
    return Error{ErrorCode::kBadFile, Cat(path.string(), ": line 1: not a table of readings of this version")};
  }
  return rows;
}

Result<std::map<std::string, ReadingDecision>> ReadReadingDecisions(const fs::path& path) {
  std::map<std::string, ReadingDecision> decisions;
  std::string wrong;
  ANCHORSPLAT_RETURN_IF_ERROR(ForEachLine(path, [&](const json& object, int64_t line) {
    ReadingDecision decision;
    decision.method = object.at("method").get<std::string>();
    if (decision.method != "none" && decision.method != "filter" && decision.method != "network" && wrong.empty()) {
      wrong = Cat("line ", line, ": method '", Printable(decision.method), "' is none of none, filter, network");
    }
    const std::string mode = TextAt(object, "mode");
    decision.mode = RenderModeNamed(mode);
    if (!mode.empty() && !decision.mode && wrong.empty()) {
      wrong = Cat("line ", line, ": mode '", Printable(mode), "' is none of classic, antialiased, mip");
    }
    decision.pixel = NumberAt(object, "pixel");
    decision.low = NumberAt(object, "low");
    decision.high = NumberAt(object, "high");
    decision.made = TextAt(object, "made");
    decision.seconds = NumberAt(object, "seconds");
    decisions[object.at("id").get<std::string>()] = std::move(decision);
  }));
  if (!wrong.empty()) return Error{ErrorCode::kBadFile, Cat(path.string(), ": ", wrong)};
  return decisions;
}

}  // namespace anchorsplat
