#include "train/train_log.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/text.h"
#include "io/atomic_file.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;
using Curve = std::vector<std::pair<double, double>>;

constexpr double kWidth = 860, kHeight = 260, kLeft = 60, kBottom = 30;

// Value range of a chart, slightly enlarged.
std::pair<double, double> RangeOf(const Curve& curve, std::vector<double> levels) {
  for (const auto& [x, y] : curve) levels.push_back(y);
  std::erase_if(levels, [](double v) { return !std::isfinite(v); });
  if (levels.empty()) return {0, 1};
  const auto [low, high] = std::minmax_element(levels.begin(), levels.end());
  const double margin = std::max(0.05 * (*high - *low), 1e-6);
  return {*low - margin, *high + margin};
}

struct Level {
  const char* name;
  const char* color;
  double value;
};

// A line chart as SVG; `levels`: horizontal lines.
std::string Chart(const std::string& title, const Curve& curve, const std::vector<Level>& levels, int digits) {
  std::vector<double> values;
  for (const Level& level : levels) values.push_back(level.value);
  const auto [low, high] = RangeOf(curve, values);
  const double last = curve.empty() ? 1 : std::max(1.0, curve.back().first);
  const auto x = [&](double step) { return kLeft + (kWidth - kLeft - 10) * step / last; };
  const auto y = [&, low = low, high = high](double v) {
    return 10 + (kHeight - kBottom - 10) * (1 - (v - low) / (high - low));
  };
  std::ostringstream out;
  out << "<h2>" << title << "</h2><svg viewBox='0 0 " << kWidth << ' ' << kHeight << "'>";
  for (int i = 0; i <= 4; ++i) {
    const double v = low + (high - low) * i / 4;
    out << "<line x1='" << kLeft << "' x2='" << kWidth << "' y1='" << y(v) << "' y2='" << y(v)
        << "' stroke='#ddd'/><text x='4' y='" << y(v) + 4 << "'>" << Fixed(v, digits) << "</text>";
    out << "<text x='" << x(last * i / 4) << "' y='" << kHeight - 8 << "' text-anchor='middle'>"
        << static_cast<int64_t>(last * i / 4) << "</text>";
  }
  for (const Level& level : levels) {
    out << "<line x1='" << kLeft << "' x2='" << kWidth << "' y1='" << y(level.value) << "' y2='" << y(level.value)
        << "' stroke='" << level.color << "' stroke-dasharray='6 4'/><text fill='" << level.color << "' x='"
        << kLeft + 6 << "' y='" << y(level.value) - 4 << "'>" << level.name << ' ' << Fixed(level.value, digits)
        << "</text>";
  }
  out << "<polyline fill='none' stroke='#1565c0' stroke-width='1.6' points='";
  for (const auto& [step, value] : curve) {
    if (std::isfinite(value)) out << Fixed(x(step), 1) << ',' << Fixed(y(value), 1) << ' ';
  }
  out << "'/></svg>\n";
  return std::move(out).str();
}

// Averages neighbours, so that pages of long trainings stay small and curves readable.
Curve Smoothed(const Curve& curve, size_t most) {
  const size_t part = (curve.size() + most - 1) / most;
  if (part <= 1) return curve;
  Curve smooth;
  for (size_t i = 0; i + part <= curve.size(); i += part) {
    double x = 0, y = 0;
    for (size_t k = i; k < i + part; ++k) {
      x += curve[k].first / static_cast<double>(part);
      y += curve[k].second / static_cast<double>(part);
    }
    smooth.emplace_back(x, y);
  }
  return smooth;
}

}  // namespace

Result<TrainLog> TrainLog::Open(const fs::path& folder, int64_t resume_at) {
  TrainLog log;
  log.folder_ = folder;
  std::string kept;
  if (resume_at > 0) {
    std::ifstream file(folder / "log.jsonl");
    for (std::string line; std::getline(file, line);) {
      const auto json = nlohmann::json::parse(line, nullptr, false);  // the last line may be truncated
      if (!json.is_object() || !json.contains("step") || !json["step"].is_number()) continue;
      if (json["step"].get<double>() > static_cast<double>(resume_at)) continue;
      kept += line + "\n";
      log.Remember(json);
    }
  }
  ANCHORSPLAT_RETURN_IF_ERROR(WriteWholeFile(folder / "log.jsonl", kept, /*overwrite=*/true));
  return log;
}

void TrainLog::Remember(const nlohmann::json& line) {
  const auto number = [](const nlohmann::json& json, const char* key) {
    return json.is_object() && json.contains(key) && json[key].is_number() ? json[key].get<double>() : 0.0;
  };
  const double step = number(line, "step");
  if (line.contains("loss")) loss_.emplace_back(step, number(line, "loss"));
  if (line.contains("validation")) {
    const nlohmann::json& v = line["validation"];
    if (v.contains("model")) model_.emplace_back(step, number(v["model"], "psnr"));
    if (v.contains("raw")) raw_ = number(v["raw"], "psnr");
    if (v.contains("filter")) filter_ = number(v["filter"], "psnr");
  }
}

Status TrainLog::Add(const nlohmann::json& line) {
  std::ofstream file(folder_ / "log.jsonl", std::ios::app);
  file << line.dump() << '\n';
  file.flush();
  if (!file) return Error{ErrorCode::kIo, Cat((folder_ / "log.jsonl").string(), ": could not be written")};
  Remember(line);
  return {};
}

Status TrainLog::WriteCurve() const {
  constexpr size_t kMostPoints = 600;
  std::string page =
      "<!doctype html><meta charset='utf-8'><title>Training</title><style>body{font:14px sans-serif;max-width:900px;"
      "margin:2em auto}svg text{font-size:11px}</style>\n<h1>Training</h1>\n";
  if (!model_.empty()) {
    std::vector<Level> levels;
    if (raw_ > 0) levels.push_back({"raw", "#888", raw_});
    if (filter_ > 0) levels.push_back({"filter", "#c62828", filter_});
    page += Chart("PSNR of the validation's held-out views, dB", model_, levels, 2);
  }
  page += Chart("Loss", Smoothed(loss_, kMostPoints), {}, 4);
  return WriteWholeFile(folder_ / "curve.html", page, /*overwrite=*/true);
}

}  // namespace anchorsplat
