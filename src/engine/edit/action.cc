#include "edit/action.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "core/gaussian_cloud.h"
#include "core/number_text.h"
#include "core/text.h"
#include "core/vector3.h"

namespace anchorsplat {

namespace {

using Vec3 = std::array<double, 3>;
using Matrix = std::array<double, 9>;                     // row-major
constexpr double kHarmonicOfColor = 0.28209479177387814;  // kSh0 of core/spherical_harmonics.h, as a double
constexpr double kInf = std::numeric_limits<double>::infinity();

constexpr std::array kActionNames = {
    ActionName{"-t,--translate", "--translate", "Move the splat", "X,Y,Z"},
    ActionName{"-r,--rotate", "--rotate", "Rotate about the origin, in degrees: about x, then y, then z", "X,Y,Z"},
    ActionName{"-s,--scale", "--scale", "Scale about the origin", "FACTOR"},
    ActionName{"--mirror", "--mirror", "Mirror along x, y or z, through the origin", "AXIS"},
    ActionName{"--up", "--up",
               "Rotate so that this direction, X,Y,Z or an axis such as -z, becomes up (-y in the file)", "DIRECTION"},
    ActionName{"--origin", "--origin", "Move this point to 0,0,0", "X,Y,Z"},
    ActionName{"-B,--filter-box", "--filter-box", "Keep what lies in a box; an empty number or - is no bound",
               "X0,Y0,Z0,X1,Y1,Z1"},
    ActionName{"--remove-box", "--remove-box", "Drop what lies in a box; an empty number or - is no bound",
               "X0,Y0,Z0,X1,Y1,Z1"},
    ActionName{"-S,--filter-sphere", "--filter-sphere", "Keep what lies in a sphere", "X,Y,Z,RADIUS"},
    ActionName{"-N,--filter-nan", "--filter-nan", "Drop Gaussians with NaN or infinite values or a zero quaternion",
               ""},
    ActionName{"-V,--filter-value", "--filter-value",
               "Keep Gaussians that pass: lt, lte, gt, gte, eq or neq. Opacity is 0-1, scale_* lengths, f_dc_* "
               "colours 0-1; with _raw (opacity_raw) as stored",
               "PROPERTY,COMPARISON,VALUE"},
    ActionName{"-H,--filter-harmonics", "--filter-harmonics", "Drop spherical harmonics above this degree, 0 to 3",
               "DEGREE"},
    ActionName{"-F,--filter-floaters", "--filter-floaters", "Drop floaters; =FACTOR above 1 drops fewer, below 1 more",
               ""},
};

Error Bad(std::string_view name, const std::string& what) { return {ErrorCode::kBadArgument, Cat(name, ": ", what)}; }

std::vector<std::string> Parts(const std::string& text) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == ',') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  for (std::string& part : parts) {
    part.erase(0, std::min(part.find_first_not_of(' '), part.size()));
    while (!part.empty() && part.back() == ' ') part.pop_back();
  }
  return parts;
}

// Parses a finite number and nothing else; accepts "+1" and "1.".
std::optional<double> Number(std::string text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.erase(0, 1);
  double value = 0;
  const auto [end, code] = FromChars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

template <size_t kCount>
std::optional<std::array<double, kCount>> Numbers(const std::string& text) {
  const std::vector<std::string> parts = Parts(text);
  if (parts.size() != kCount) return std::nullopt;
  std::array<double, kCount> numbers{};
  for (size_t k = 0; k < kCount; ++k) {
    const std::optional<double> number = Number(parts[k]);
    if (!number) return std::nullopt;
    numbers[k] = *number;
  }
  return numbers;
}

std::string Found(const std::string& text) { return Cat(", found '", Printable(text), "'"); }

// Applies a matrix that converts vectors from some axes to RDF.
Vec3 Times(const Matrix& m, const Vec3& v) { return Similarity{m, {}, 1}.Apply(v); }
Matrix Times(const Matrix& a, const Matrix& b) { return Compose({a, {}, 1}, {b, {}, 1}).rotation; }

// Exact for multiples of 90°.
std::pair<double, double> SineAndCosine(double degrees) {
  const double turn = std::remainder(degrees, 360);
  if (turn == 0) return {0, 1};
  if (turn == 90) return {1, 0};
  if (turn == -90) return {-1, 0};
  if (std::abs(turn) == 180) return {0, -1};
  const double radians = turn * std::numbers::pi / 180;
  return {std::sin(radians), std::cos(radians)};
}

// Rotates about the fixed axes x, then y, then z: Rz·Ry·Rx.
Matrix FromEuler(const Vec3& degrees) {
  const auto [sx, cx] = SineAndCosine(degrees[0]);
  const auto [sy, cy] = SineAndCosine(degrees[1]);
  const auto [sz, cz] = SineAndCosine(degrees[2]);
  const Matrix x = {1, 0, 0, 0, cx, -sx, 0, sx, cx}, y = {cy, 0, sy, 0, 1, 0, -sy, 0, cy},
               z = {cz, -sz, 0, sz, cz, 0, 0, 0, 1};
  return Times(z, Times(y, x));
}

Result<EditAction> Finished(EditAction action, decltype(EditAction::what) what) {
  action.what = std::move(what);
  return action;
}

// Parses "x", "-z", "+y": an axis with sign.
std::optional<Vec3> Axis(std::string text) {
  double sign = 1;
  if (text.size() == 2 && (text[0] == '-' || text[0] == '+')) {
    sign = text[0] == '-' ? -1 : 1;
    text.erase(0, 1);
  }
  const size_t axis = text.size() == 1 ? std::string_view("xyz").find(text[0]) : std::string_view::npos;
  if (axis > 2) return std::nullopt;
  Vec3 direction{};
  direction[axis] = sign;
  return direction;
}

Result<EditAction> ParseBox(EditAction action, std::string_view name, const std::string& text, const Matrix& to_rdf) {
  const std::vector<std::string> parts = Parts(text);
  if (parts.size() != 6) return Bad(name, Cat("expected a box X0,Y0,Z0,X1,Y1,Z1", Found(text)));
  KeepBox box{{-kInf, -kInf, -kInf}, {kInf, kInf, kInf}, name == "--remove-box"};
  for (size_t k = 0; k < 6; ++k) {
    if (parts[k].empty() || parts[k] == "-") continue;
    const std::optional<double> number = Number(parts[k]);
    if (!number) return Bad(name, Cat("expected a box X0,Y0,Z0,X1,Y1,Z1", Found(text)));
    (k < 3 ? box.low : box.high)[k % 3] = *number;
  }
  for (size_t k = 0; k < 3; ++k) {
    if (box.low[k] > box.high[k]) {
      return Bad(name, Cat("the first corner must be the lower one; along ", "xyz"[k], " ", box.low[k], " is above ",
                           box.high[k]));
    }
  }
  KeepBox turned = box;
  for (size_t row = 0; row < 3; ++row) {
    for (size_t k = 0; k < 3; ++k) {
      const double sign = to_rdf[3 * row + k];
      if (sign > 0) turned.low[row] = box.low[k], turned.high[row] = box.high[k];
      if (sign < 0) turned.low[row] = -box.high[k], turned.high[row] = -box.low[k];
    }
  }
  return Finished(std::move(action), turned);
}

std::optional<ValueComparison> ComparisonOf(const std::string& word) {
  constexpr std::array<std::string_view, 6> kWords = {"lt", "lte", "gt", "gte", "eq", "neq"};
  const auto found = std::ranges::find(kWords, word);
  if (found == kWords.end()) return std::nullopt;
  return static_cast<ValueComparison>(found - kWords.begin());
}

Result<EditAction> ParseValue(EditAction action, std::string_view name, const std::string& text,
                              const Matrix& from_rdf) {
  const std::vector<std::string> parts = Parts(text);
  const std::optional<ValueComparison> comparison = parts.size() == 3 ? ComparisonOf(parts[1]) : std::nullopt;
  const std::optional<double> value = parts.size() == 3 ? Number(parts[2]) : std::nullopt;
  if (!comparison || !value || parts[0].empty()) {
    return Bad(name, Cat("expected PROPERTY,COMPARISON,VALUE, where the comparison is one of lt, lte, gt, gte, eq and "
                         "neq, as in opacity,gt,0.1",
                         Found(text)));
  }
  KeepByValue keep{parts[0], *comparison, *value};
  const bool raw = keep.property.ends_with("_raw");
  const std::string plain = raw ? keep.property.substr(0, keep.property.size() - 4) : keep.property;
  const bool is_scale = plain == "scale_0" || plain == "scale_1" || plain == "scale_2";
  const bool is_color = plain == "f_dc_0" || plain == "f_dc_1" || plain == "f_dc_2";
  if (plain == "opacity" || is_scale || is_color) {
    keep.property = plain;
    if (!raw && plain == "opacity") {
      if (!(*value >= 0 && *value <= 1)) return Bad(name, Cat("opacity must be 0 to 1, not ", *value));
      keep.value = std::log(*value / (1 - *value));
    } else if (!raw && is_scale) {
      if (!(*value >= 0)) return Bad(name, Cat("scale must be a length of 0 or more, not ", *value));
      keep.value = std::log(*value);
    } else if (!raw) {
      keep.value = (*value - 0.5) / kHarmonicOfColor;
    }
  }
  keep.turn = from_rdf;
  const bool is_directed =
      (plain.size() == 1 && Axis(plain)) || plain.starts_with("rot_") || plain.starts_with("f_rest_");
  if (!is_directed) action.axes.clear();
  return Finished(std::move(action), std::move(keep));
}

Result<EditAction> ParseScale(EditAction action, std::string_view name, const std::string& text) {
  const std::optional<double> factor = Number(text);
  if (!factor && Parts(text).size() > 1) {
    return Bad(name,
               Cat("takes one factor for all axes: a Gaussian that is stretched along one of them cannot keep its "
                   "harmonics",
                   Found(text)));
  }
  // Limit of float, and of lengths that can be drawn.
  constexpr double kMost = 1e18;
  if (!factor || !(*factor >= 1 / kMost && *factor <= kMost)) {
    return Bad(name, Cat("expected a factor above 0", factor && *factor < 0 ? "; --mirror mirrors" : "",
                         factor && *factor > 0 ? Cat(", ", 1 / kMost, " to ", kMost) : "", Found(text)));
  }
  return Finished(std::move(action), MoveWorld{{.scale = *factor}});
}

}  // namespace

std::span<const ActionName> ActionNames() { return kActionNames; }

Result<EditAction> ParseAction(std::string_view name, const std::string& text, const Axes& axes) {
  EditAction action{Cat(name, text.empty() || text == "true" ? "" : " ", text == "true" ? "" : text), KeepNumbers{}};
  if (name == "--filter-nan") {
    if (text.empty() || text == "true") return action;
    return Bad(name, Cat("takes no value", Found(text)));
  }
  if (name == "--scale") return ParseScale(std::move(action), name, text);
  if (name == "--filter-harmonics") {
    if (text.size() != 1 || text[0] < '0' || text[0] > '0' + kMaxShDegree) {
      return Bad(name, Cat("expected a degree, 0 to 3", Found(text)));
    }
    return Finished(std::move(action), LowerShDegree{text[0] - '0'});
  }
  if (name == "--filter-floaters") {
    FloaterOptions options;
    if (text.empty() || text == "true") return Finished(std::move(action), DropFloaters{options});
    const std::optional<double> factor = Number(text);
    if (!factor || !(*factor > 0)) {
      return Bad(name, Cat("takes one factor above 0, or none", Found(text)));
    }
    options.factor = *factor;
    return Finished(std::move(action), DropFloaters{options});
  }
  action.axes = NameOfAxes(axes);
  const Matrix to_rdf = TurnBetween(axes, kRdf).matrix(), from_rdf = TurnBetween(kRdf, axes).matrix();
  const auto in_rdf = [&](const Matrix& m) { return Times(to_rdf, Times(m, from_rdf)); };
  if (name == "--filter-box" || name == "--remove-box") return ParseBox(std::move(action), name, text, to_rdf);
  if (name == "--filter-value") return ParseValue(std::move(action), name, text, from_rdf);
  if (name == "--translate" || name == "--origin") {
    const auto by = Numbers<3>(text);
    if (!by) return Bad(name, Cat("expected X,Y,Z", Found(text)));
    const double sign = name == "--origin" ? -1 : 1;
    const Vec3 turned = Times(to_rdf, *by);
    return Finished(std::move(action),
                    MoveWorld{{.translation = {sign * turned[0], sign * turned[1], sign * turned[2]}}});
  }
  if (name == "--rotate") {
    const auto degrees = Numbers<3>(text);
    if (!degrees) return Bad(name, Cat("expected X,Y,Z in degrees", Found(text)));
    return Finished(std::move(action), MoveWorld{{.rotation = in_rdf(FromEuler(*degrees))}});
  }
  if (name == "--mirror") {
    const std::optional<Vec3> axis = Axis(text);
    if (!axis) return Bad(name, Cat("expected an axis, x, y or z", Found(text)));
    Matrix m{};
    for (size_t k = 0; k < 3; ++k) m[4 * k] = (*axis)[k] != 0 ? -1 : 1;
    return Finished(std::move(action), MoveWorld{{.rotation = in_rdf(m)}});
  }
  if (name == "--up") {
    const auto numbers = Numbers<3>(text);
    const std::optional<Vec3> up = numbers ? std::optional<Vec3>(*numbers) : Axis(text);
    const double length = up ? std::hypot((*up)[0], (*up)[1], (*up)[2]) : 0;
    if (!(length > 0) || !std::isfinite(length)) {
      return Bad(name, Cat("expected a direction X,Y,Z, or an axis, as -z", Found(text)));
    }
    return Finished(std::move(action),
                    TurnToUp{Times(to_rdf, Vec3{(*up)[0] / length, (*up)[1] / length, (*up)[2] / length})});
  }
  if (name == "--filter-sphere") {
    const auto numbers = Numbers<4>(text);
    if (!numbers || !((*numbers)[3] > 0)) {
      return Bad(name, Cat("expected a sphere X,Y,Z,RADIUS, the radius above 0", Found(text)));
    }
    const auto& n = *numbers;
    return Finished(std::move(action), KeepSphere{Times(to_rdf, Vec3{n[0], n[1], n[2]}), n[3]});
  }
  return Error{ErrorCode::kBadArgument, Cat("'", Printable(std::string(name)), "' is not an edit")};
}

}  // namespace anchorsplat
