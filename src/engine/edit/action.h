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

// What may be done to a splat, one after the other. Positions, directions and lengths are those of its world, in the
// axes that a cloud has in memory (RDF).

// p ↦ map(p); the rotation may mirror (determinant −1). Translations, rotations, scalings, mirrorings.
struct MoveWorld {
  Similarity map;
};
// Turns the shortest way so that `up` (a unit vector) becomes the usual up (core/world_up.h), and says so in a comment.
struct TurnToUp {
  std::array<double, 3> up;
};

// Only what lies in the box or on its border stays; with `outside` only the rest does.
struct KeepBox {
  std::array<double, 3> low, high;  // −∞ and +∞: no border
  bool outside = false;
};
// Only what is nearer to the centre than the radius stays.
struct KeepSphere {
  std::array<double, 3> centre;
  double radius;
};
// Drops what has a value that is no number, an infinite one but where that has a meaning (an opacity logit of +∞, a
// log-scale of −∞), or a quaternion of zero.
struct KeepNumbers {};
// Only rows whose property compares so stay. NaN compares with nothing, but is not equal to anything.
enum class ValueComparison { kLess, kLessOrEqual, kGreater, kGreaterOrEqual, kEqual, kNotEqual };
struct KeepByValue {
  std::string property;  // x, f_dc_0, opacity, scale_2, rot_3, f_rest_44 or another one of the file
  ValueComparison comparison;
  double value;  // as stored: a logit, a logarithm, a harmonic
  // Row-major, from the world's axes to those along which x, y, z, rot_* and f_rest_* are meant.
  std::array<double, 9> turn = {1, 0, 0, 0, 1, 0, 0, 0, 1};
};
// What IsUsable (core/gaussian_cloud.h), of at least this opacity.
struct KeepOpaque {
  float least;  // 0–1
};
// Harmonics of higher degrees go.
struct LowerShDegree {
  int most;
};
// FindFloaters.
struct DropFloaters {
  FloaterOptions options;
};

struct EditAction {
  std::string words;  // for reports: "--translate 1,0,0"
  std::variant<MoveWorld, TurnToUp, KeepBox, KeepSphere, KeepNumbers, KeepByValue, KeepOpaque, LowerShDegree,
               DropFloaters>
      what;
  std::string axes = {};  // along which its numbers are, "LUF"; empty: they are along none
};

// Those of the numbers that people type, unless they say others: splat-transform's, for any file.
inline constexpr std::string_view kTypedActionAxes = "LUF";

// An action as the command line knows it; what `convert --help` shows.
struct ActionName {
  std::string_view options;  // "-t,--translate"
  std::string_view name;     // "--translate"
  std::string_view help;
  std::string_view form;  // of its value; empty: it has none, or may do without
};
std::span<const ActionName> ActionNames();

// The action of that name ("--translate") with a value in words; `text` is empty or "true" where none was given. The
// numbers are along `axes`, RDF being those that a cloud has in memory. Errors (kBadArgument) name the action and say
// what is expected.
Result<EditAction> ParseAction(std::string_view name, const std::string& text, const Axes& axes = kRdf);

}  // namespace anchorsplat
