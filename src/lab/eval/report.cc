#include "eval/report.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "core/text.h"
#include "eval/contact_sheet.h"
#include "images/image_io.h"
#include "io/atomic_file.h"
#include "io/json_file.h"

namespace anchorsplat {

namespace {

std::string Signed(double value, int digits) { return (value >= 0 ? "+" : "") + Fixed(value, digits); }

std::string Range(const Interval& interval, int digits) {
  return Cat(Fixed(interval.mean, digits), " (", Fixed(interval.low, digits), "–", Fixed(interval.high, digits), ")");
}

std::string SignedRange(const Interval& interval) {
  return Cat(Signed(interval.mean, 2), " (", Signed(interval.low, 2), " to ", Signed(interval.high, 2), ")");
}

std::string Row(const std::vector<std::string>& cells) {
  std::string row = "|";
  for (const std::string& cell : cells) row += " " + cell + " |";
  return row + "\n";
}

std::string Rule(size_t columns) {
  std::string rule = "|---|";
  for (size_t i = 1; i < columns; ++i) rule += "---:|";
  return rule + "\n";
}

// Escapes a table cell: a bar or line break would end it, and control characters could command the terminal.
std::string Cell(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return c == '|' || c == '\n' || c == '\r'; }, ' ');
  return Printable(text, std::numeric_limits<size_t>::max());
}

std::string ProtocolSentence(const Evaluation& evaluation) {
  size_t fewest = SIZE_MAX, most = 0;
  for (const MethodResult& result : evaluation.results) {
    fewest = std::min(fewest, result.views.size());
    most = std::max(most, result.views.size());
  }
  const std::string views = most == 0        ? "no views"
                            : fewest == most ? Cat(most, " views")
                                             : Cat(fewest, " to ", most, " views");
  std::string text =
      evaluation.protocol == Protocol::kUpstream
          ? "Protocol upstream: views 1 to n − 6 by name, most of which the low-quality fits were trained "
            "on; values cut down to 8 bits; mean over all pictures"
          : "Protocol heldout: views that the low-quality fits never saw; renders clamped, not quantised; "
            "mean over views, then over objects";
  text +=
      Cat(". ", evaluation.objects.size(), evaluation.objects.size() == 1 ? " object, " : " objects, ", views, " each");
  if (evaluation.max_views > 0) text += Cat(" (--max-views ", evaluation.max_views, ": not the whole protocol)");
  return text + ".";
}

void AddSummaryTable(const Evaluation& evaluation, const std::vector<MethodSummary>& summaries, std::string& text) {
  std::vector<std::string> heading = {"method", "objects", "PSNR dB", "SSIM"};
  if (evaluation.lpips) heading.push_back(Cat("LPIPS (", LpipsNetName(*evaluation.lpips), ")"));
  for (const char* name :
       {"gain over raw, dB", "gain over filter, dB", "wins over filter", "Gaussians", "time per object"}) {
    heading.emplace_back(name);
  }
  text += Row(heading) + Rule(heading.size());
  for (const MethodSummary& s : summaries) {
    std::vector<std::string> row = {Cell(s.method), std::to_string(s.objects), Range(s.psnr, 2), Range(s.ssim, 4)};
    if (evaluation.lpips) row.push_back(s.lpips ? Range(*s.lpips, 4) : "");
    row.push_back(s.gain_over_raw ? SignedRange(*s.gain_over_raw) : "");
    row.push_back(s.gain_over_filter ? SignedRange(*s.gain_over_filter) : "");
    row.push_back(s.compared_with_filter > 0 ? Cat(s.wins_over_filter, " of ", s.compared_with_filter) : "");
    row.push_back(s.gaussians > 0 ? WithThousands(std::llround(s.gaussians)) : "");
    row.push_back(s.seconds > 0 ? HumanSeconds(s.seconds) : "");
    text += Row(row);
  }
}

// An object's name without its kind, for tables with a column of kinds.
std::string WithoutKind(const std::string& object, const std::string& kind) {
  const std::string ending = "--" + kind;
  return object.ends_with(ending) ? object.substr(0, object.size() - ending.size()) : object;
}

void AddKindTable(const Evaluation& evaluation, const std::vector<KindSummary>& kinds, std::string& text) {
  std::vector<std::string> heading = {"kind", "method", "objects", "PSNR dB", "SSIM"};
  if (evaluation.lpips) heading.push_back(Cat("LPIPS (", LpipsNetName(*evaluation.lpips), ")"));
  for (const char* name :
       {"gain over raw, dB", "gain over filter, dB", "Gaussians", "time per object", "worst object"}) {
    heading.emplace_back(name);
  }
  text += Row(heading) + Rule(heading.size());
  for (const auto& [kind, s, worst] : kinds) {
    std::vector<std::string> row = {kind.empty() ? "?" : Cell(kind), Cell(s.method), std::to_string(s.objects),
                                    Fixed(s.psnr.mean, 2), Fixed(s.ssim.mean, 4)};
    if (evaluation.lpips) row.push_back(s.lpips ? Fixed(s.lpips->mean, 4) : "");
    row.push_back(s.gain_over_raw ? Signed(s.gain_over_raw->mean, 2) : "");
    row.push_back(s.gain_over_filter ? Signed(s.gain_over_filter->mean, 2) : "");
    row.push_back(s.gaussians > 0 ? WithThousands(std::llround(s.gaussians)) : "");
    row.push_back(s.seconds > 0 ? HumanSeconds(s.seconds) : "");
    row.push_back(worst ? Cat(Cell(WithoutKind(worst->object, kind)), " ", Signed(worst->gain, 2),
                              worst->over == "raw" ? "" : Cat(" over ", worst->over))
                        : "");
    text += Row(row);
  }
}

void AddObjectTable(const Evaluation& evaluation, const std::vector<MethodSummary>& summaries, std::string& text) {
  text += Cat("\nPSNR / SSIM", evaluation.lpips ? " / LPIPS" : "", " per object:\n\n");
  const bool sizes = SummarisePixelSizes(evaluation).has_value();
  std::vector<std::string> heading = {"object"};
  for (const MethodSummary& s : summaries) heading.push_back(Cell(s.method));
  if (sizes) heading.emplace_back("pixel size, read / true");
  text += Row(heading) + Rule(heading.size());
  for (const std::string& object : evaluation.objects) {
    std::vector<std::string> row = {Cell(object)};
    std::string ratio;
    for (const MethodSummary& s : summaries) {
      const MethodResult* result = evaluation.Find(object, s.method);
      if (result == nullptr) {
        row.emplace_back("failed");
        continue;
      }
      const auto lpips = result->MeanLpips();
      row.push_back(Cat(Fixed(result->MeanPsnr(), 2), " / ", Fixed(result->MeanSsim(), 4),
                        lpips ? Cat(" / ", Fixed(*lpips, 3)) : ""));
      if (result->facts.contains("pixel_size_ratio")) {
        ratio = Fixed(NumberOf(result->facts.at("pixel_size_ratio")), 2);
      }
    }
    if (sizes) row.push_back(ratio);
    text += Row(row);
  }
}

// Table of seconds for methods that take any.
void AddSecondsTable(const Evaluation& evaluation, std::vector<MethodSummary> summaries, std::string& text) {
  std::erase_if(summaries, [](const MethodSummary& s) { return s.seconds <= 0; });
  if (summaries.empty()) return;
  text += "\nSeconds of a method per object:\n\n";
  std::vector<std::string> heading = {"object"};
  for (const MethodSummary& s : summaries) heading.push_back(Cell(s.method));
  text += Row(heading) + Rule(heading.size());
  for (const std::string& object : evaluation.objects) {
    std::vector<std::string> row = {Cell(object)};
    for (const MethodSummary& s : summaries) {
      const MethodResult* result = evaluation.Find(object, s.method);
      row.push_back(result == nullptr ? "failed" : Fixed(result->seconds, result->seconds < 10 ? 1 : 0));
    }
    text += Row(row);
  }
}

// Quotes a CSV cell if necessary.
std::string CsvCell(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

nlohmann::json ToJson(const Interval& interval) {
  return {{"mean", FiniteOrNull(interval.mean)},
          {"low", FiniteOrNull(interval.low)},
          {"high", FiniteOrNull(interval.high)}};
}

nlohmann::json ToJson(const MethodSummary& s) {
  nlohmann::json json = {{"method", s.method},     {"objects", s.objects}, {"psnr", ToJson(s.psnr)},
                         {"ssim", ToJson(s.ssim)}, {"seconds", s.seconds}, {"gaussians", s.gaussians}};
  if (s.lpips) json["lpips"] = ToJson(*s.lpips);
  if (s.gain_over_raw) json["gain_over_raw"] = ToJson(*s.gain_over_raw);
  if (s.gain_over_filter) {
    json["gain_over_filter"] = ToJson(*s.gain_over_filter);
    json["wins_over_filter"] = {{"wins", s.wins_over_filter}, {"objects", s.compared_with_filter}};
  }
  return json;
}

nlohmann::json ToJson(const WorstObject& worst) {
  return {{"object", worst.object},
          {"method", worst.method},
          {"kind", worst.kind},
          {"over", worst.over},
          {"gain", FiniteOrNull(worst.gain)}};
}

nlohmann::json ToJson(const KindSummary& kind) {
  nlohmann::json json = ToJson(kind.summary);
  json["kind"] = kind.kind;
  if (kind.worst) json["worst"] = ToJson(*kind.worst);
  return json;
}

nlohmann::json ToJson(const MethodResult& result) {
  nlohmann::json json = {
      {"object", result.object},       {"method", result.method},           {"psnr", FiniteOrNull(result.MeanPsnr())},
      {"ssim", result.MeanSsim()},     {"seconds", result.seconds},         {"render_seconds", result.render_seconds},
      {"gaussians", result.gaussians}, {"facts", nlohmann::json::object()}, {"views", nlohmann::json::array()}};
  if (const auto lpips = result.MeanLpips()) json["lpips"] = *lpips;
  for (const auto& [name, value] : result.facts) {
    std::visit([&, &fact = name](auto told) { json["facts"][fact] = told; }, value);
  }
  for (const ViewScore& view : result.views) {
    json["views"].push_back({{"name", view.name}, {"psnr", FiniteOrNull(view.psnr)}, {"ssim", view.ssim}});
    if (view.lpips) json["views"].back()["lpips"] = *view.lpips;
  }
  return json;
}

}  // namespace

std::string WorstSentence(const Evaluation& evaluation) {
  const auto worst = WorstOverRaw(evaluation);
  if (!worst) return {};
  const std::string who = Cat(worst->method, " on ", worst->object);
  return worst->gain < 0
             ? Cat("Worst loss over raw: ", Fixed(-worst->gain, 2), " dB, ", who, ".")
             : Cat("Nothing is worse than raw: the least gain is ", Fixed(worst->gain, 2), " dB, ", who, ".");
}

std::string ToMarkdown(const Evaluation& evaluation, const std::vector<MethodSummary>& summaries,
                       const std::string& title, uint64_t seed) {
  std::string text = Cat("# ", Cell(title), "\n\n", ProtocolSentence(evaluation),
                         " In parentheses: 95 % confidence by bootstrap over the objects.\n\n");
  AddSummaryTable(evaluation, summaries, text);
  if (const auto kinds = SummariseKinds(evaluation, seed); !kinds.empty()) {
    text += "\nBy kind of splat; the worst object is the one with the least gain over raw, in dB:\n\n";
    AddKindTable(evaluation, kinds, text);
  }
  if (const std::string worst = WorstSentence(evaluation); !worst.empty()) text += "\n" + Cell(worst) + "\n";
  if (const auto error = SummarisePixelSizes(evaluation)) {
    text += Cat("\nPixel size read off the splat alone (`filter-auto`): off by ", Fixed(100 * error->median, 1),
                " % in the median, ", Fixed(100 * error->percentile95, 1), " % at the 95th percentile.\n");
  }
  AddObjectTable(evaluation, summaries, text);
  AddSecondsTable(evaluation, summaries, text);
  if (!evaluation.failures.empty()) {
    text += "\nNot measured:\n\n";
    for (const EvaluationFailure& failure : evaluation.failures) {
      text += Cat("* ", Cell(failure.object), failure.method.empty() ? "" : ", ", Cell(failure.method), ": ",
                  Cell(failure.message), "\n");
    }
  }
  return text;
}

std::string ToCsv(const Evaluation& evaluation) {
  std::set<std::string> facts;
  for (const MethodResult& result : evaluation.results) {
    for (const auto& [name, value] : result.facts) facts.insert(name);
  }
  std::string text = "object,method,views,psnr,ssim,lpips,seconds,render_seconds,gaussians,kind";
  for (const std::string& fact : facts) text += "," + CsvCell(fact);
  text += "\n";
  for (const MethodResult& result : evaluation.results) {
    const auto lpips = result.MeanLpips();
    text += Cat(CsvCell(result.object), ",", CsvCell(result.method), ",", result.views.size(), ",",
                Fixed(result.MeanPsnr(), 4), ",", Fixed(result.MeanSsim(), 6), ",", lpips ? Fixed(*lpips, 6) : "", ",",
                Fixed(result.seconds, 3), ",", Fixed(result.render_seconds, 3), ",", result.gaussians, ",",
                CsvCell(KindOf(evaluation, result.object)));
    for (const std::string& fact : facts) {
      const auto found = result.facts.find(fact);
      text += ",";
      if (found != result.facts.end()) text += std::visit([](auto told) { return Cat(told); }, found->second);
    }
    text += "\n";
  }
  return text;
}

nlohmann::json ToJson(const Evaluation& evaluation, const std::vector<MethodSummary>& summaries, uint64_t seed) {
  nlohmann::json json = {{"protocol", ProtocolName(evaluation.protocol)},
                         {"objects", evaluation.objects},
                         {"methods", nlohmann::json::array()},
                         {"results", nlohmann::json::array()},
                         {"failures", nlohmann::json::array()},
                         {"resumed", evaluation.resumed}};
  if (evaluation.max_views > 0) json["max_views"] = evaluation.max_views;
  if (evaluation.lpips) json["lpips"] = LpipsNetName(*evaluation.lpips);
  for (const MethodSummary& summary : summaries) json["methods"].push_back(ToJson(summary));
  for (const KindSummary& kind : SummariseKinds(evaluation, seed)) json["kinds"].push_back(ToJson(kind));
  if (const auto worst = WorstOverRaw(evaluation)) json["worst_over_raw"] = ToJson(*worst);
  for (const MethodResult& result : evaluation.results) {
    json["results"].push_back(ToJson(result));
    if (std::string kind = KindOf(evaluation, result.object); !kind.empty()) {
      json["results"].back()["kind"] = std::move(kind);
    }
  }
  for (const EvaluationFailure& failure : evaluation.failures) {
    json["failures"].push_back({{"object", failure.object}, {"method", failure.method}, {"message", failure.message}});
  }
  if (const auto error = SummarisePixelSizes(evaluation)) {
    json["pixel_size_error"] = {
        {"objects", error->objects}, {"median", error->median}, {"percentile95", error->percentile95}};
  }
  const EvaluationTimes& t = evaluation.times;
  if (t.pictures > 0) {
    json["seconds"] = {
        {"truth", t.truth}, {"render", t.render}, {"metrics", t.metrics}, {"lpips", t.lpips}, {"pictures", t.pictures}};
  }
  return json;
}

Status WriteReports(const std::filesystem::path& out, const Evaluation& evaluation,
                    const std::vector<MethodSummary>& summaries, const std::string& title, uint64_t seed) {
  ANCHORSPLAT_RETURN_IF_ERROR(WriteWholeFile(out / "table.md", ToMarkdown(evaluation, summaries, title, seed), true));
  ANCHORSPLAT_RETURN_IF_ERROR(WriteWholeFile(out / "table.csv", ToCsv(evaluation), true));
  const std::string json =
      ToJson(evaluation, summaries, seed).dump(1, ' ', false, nlohmann::json::error_handler_t::replace);
  ANCHORSPLAT_RETURN_IF_ERROR(WriteWholeFile(out / "results.json", json + "\n", true));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Image sheet, ContactSheet(out, evaluation));
  if (sheet.plane() == 0) return {};
  return WritePng(out / "contact_sheet.png", sheet, {.overwrite = true});
}

}  // namespace anchorsplat
