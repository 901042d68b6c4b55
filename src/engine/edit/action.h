#pragma once

#include <array>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/result.h"
#include "core/similarity.h"
#include "edit/floaters.h"
#include "formats/axes.h"

namespace anchorsplat {

// Edits of a splat, applied in order. Positions, directions and lengths are in its world, in memory axes (RDF).

// p ↦ map(p): translation, rotation, scaling, mirroring (determinant −1).
struct MoveWorld {
  Similarity map;
};
// Rotates the shortest way so that unit vector `up` becomes the usual up (core/world_up.h), and notes it in a comment.
struct TurnToUp {
  std::array<double, 3> up;
};

// Keeps only what is in the box or on its border; with `outside`, only the rest.
struct KeepBox {
  std::array<double, 3> low, high;  // −∞ and +∞: no border
  bool outside = false;
};
// Keeps only what is closer to the centre than the radius.
struct KeepSphere {
  std::array<double, 3> centre;
  double radius;
};
// Drops rows with NaN, with an infinity other than the meaningful ones (opacity logit +∞, log-scale −∞), or with a zero
// quaternion.
struct KeepNumbers {};
// Keeps only rows whose property satisfies the comparison. NaN satisfies only kNotEqual.
enum class ValueComparison { kLess, kLessOrEqual, kGreater, kGreaterOrEqual, kEqual, kNotEqual };
struct KeepByValue {
  std::string property;  // x, f_dc_0, opacity, scale_2, rot_3, f_rest_44 or an extra property of the file
  ValueComparison comparison;
  double value;  // as stored: logit, logarithm, SH coefficient
  // Row-major, from world axes to the axes of x, y, z, rot_* and f_rest_*.
  std::array<double, 9> turn = {1, 0, 0, 0, 1, 0, 0, 0, 1};
};
// Keeps only usable rows (IsUsable, core/gaussian_cloud.h) of at least this opacity.
struct KeepOpaque {
  float least;  // 0–1
};
// Drops SH of higher degrees.
struct LowerShDegree {
  int most;
};
// Drops what FindFloaters finds.
struct DropFloaters {
  FloaterOptions options;
};

struct EditAction {
  std::string words;  // for reports: "--translate 1,0,0"
  std::variant<MoveWorld, TurnToUp, KeepBox, KeepSphere, KeepNumbers, KeepByValue, KeepOpaque, LowerShDegree,
               DropFloaters>
      what;
  std::string axes = {};  // axes of its numbers, "LUF"; empty: not applicable
};

// Default axes of numbers that users type: those of splat-transform, for any file.
inline constexpr std::string_view kTypedActionAxes = "LUF";

// An action on the command line, as in `convert --help`.
struct ActionName {
  std::string_view options;  // "-t,--translate"
  std::string_view name;     // "--translate"
  std::string_view help;
  std::string_view form;  // form of its value; empty: none, or optional
};
std::span<const ActionName> ActionNames();

// Parses the action `name` ("--translate") with value `text`, empty or "true" if none was given. `axes`: axes of its
// numbers; kRdf are those in memory. Errors (kBadArgument) name the action and what is expected.
Result<EditAction> ParseAction(std::string_view name, const std::string& text, const Axes& axes = kRdf);

}  // namespace anchorsplat
