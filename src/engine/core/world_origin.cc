#include "core/world_origin.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include "core/number_text.h"

namespace anchorsplat {

namespace {

constexpr std::string_view kOriginKey = "SplatOrigin:";
constexpr double kFarthestOrigin = 1e15;
constexpr double kStepsPerDetail = 256;
constexpr double kDetailsOfCameras = 128;  // to the median distance of a camera from the middle

using Point = std::array<double, 3>;

double Median(std::vector<double>& values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

bool IsFinite(const double* p) { return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]); }

// Zeros where no point is finite.
Point MiddleOf(std::span<const double> points) {
  Point middle{};
  std::vector<double> values;
  for (size_t axis = 0; axis < 3; ++axis) {
    values.clear();
    for (size_t i = 0; i + 2 < points.size(); i += 3) {
      if (IsFinite(points.data() + i)) values.push_back(points[i + axis]);
    }
    if (!values.empty()) middle[axis] = Median(values);
  }
  return middle;
}

WorldOrigin OriginNear(const Point& middle, double detail) {
  // Floats at a distance d lie up to 2⁻²³·d apart.
  const double fine_up_to = std::ldexp(detail, 23) / kStepsPerDetail;
  const auto is_near = [&](double x) { return std::abs(x) <= fine_up_to; };
  if (!(fine_up_to > 0) || !std::isfinite(fine_up_to) || std::ranges::all_of(middle, is_near)) return {};
  const double round = std::pow(10.0, std::floor(std::log10(fine_up_to)));
  WorldOrigin origin{};
  // Adding zero turns −0 into 0.
  for (size_t axis = 0; axis < 3; ++axis) origin[axis] = std::round(middle[axis] / round) * round + 0.0;
  // An origin that TextOf cannot write would make an unreadable file.
  const bool can_be_said = std::ranges::all_of(origin, [](double x) { return std::abs(x) <= kFarthestOrigin; });
  return can_be_said ? origin : WorldOrigin{};
}

}  // namespace

std::array<double, 3> RelativeToOrigin(const Point& point, const WorldOrigin& origin) {
  return {point[0] - origin[0], point[1] - origin[1], point[2] - origin[2]};
}

std::array<double, 3> ToWorld(const float* mean, const WorldOrigin& origin) {
  return {origin[0] + double{mean[0]}, origin[1] + double{mean[1]}, origin[2] + double{mean[2]}};
}

WorldOrigin ChooseOrigin(std::span<const double> points, double detail) { return OriginNear(MiddleOf(points), detail); }

WorldOrigin ChooseOrigin(std::span<const double> points) {
  const Point middle = MiddleOf(points);
  std::vector<double> distances;
  for (size_t i = 0; i + 2 < points.size(); i += 3) {
    if (!IsFinite(points.data() + i)) continue;
    distances.push_back(std::hypot(points[i] - middle[0], points[i + 1] - middle[1], points[i + 2] - middle[2]));
  }
  if (distances.size() < 2) return {};
  return OriginNear(middle, Median(distances) / kDetailsOfCameras);
}

std::string TextOf(const WorldOrigin& origin) {
  std::string text;
  for (const double x : origin) {
    char number[32];
    const bool fixed = std::abs(x) < 1e15 && (x == 0 || std::abs(x) > 1e-6);  // 5000000, not 5e+06
    const auto [end, code] = std::to_chars(number, number + sizeof number, x,
                                           fixed ? std::chars_format::fixed : std::chars_format::scientific);
    text += text.empty() ? "" : " ";
    text.append(number, end);
  }
  return text;
}

std::optional<WorldOrigin> OriginOf(std::string_view text) {
  WorldOrigin origin{};
  for (double& x : origin) {
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
    const auto [end, code] = FromChars(text.data(), text.data() + text.size(), x);
    if (code != std::errc() || !(std::abs(x) <= kFarthestOrigin)) return std::nullopt;
    text.remove_prefix(static_cast<size_t>(end - text.data()));
  }
  return text.find_first_not_of(' ') == text.npos ? std::optional(origin) : std::nullopt;
}

std::string OriginComment(const WorldOrigin& origin) { return std::string(kOriginKey) + " " + TextOf(origin); }

std::optional<WorldOrigin> OriginOfComment(std::string_view comment) {
  return IsOriginComment(comment) ? OriginOf(comment.substr(kOriginKey.size())) : std::nullopt;
}

bool IsOriginComment(std::string_view comment) { return comment.starts_with(kOriginKey); }

WorldOrigin TakeOrigin(std::vector<std::string>& comments) {
  WorldOrigin origin{};
  std::erase_if(comments, [&](const std::string& comment) {
    const std::optional<WorldOrigin> said = OriginOfComment(comment);
    origin = said.value_or(origin);
    return said.has_value();
  });
  return origin;
}

}  // namespace anchorsplat
