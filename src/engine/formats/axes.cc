#include "formats/axes.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include "core/parallel.h"
#include "core/sh_rotation.h"
#include "core/splat_comments.h"

namespace anchorsplat {

namespace {

constexpr std::string_view kPositive = "rdf";
constexpr std::string_view kNegative = "lub";

// Coordinates in which each SH basis function is odd: 1 = x, 2 = y, 4 = z.
constexpr std::array<int, 16> kOddIn = {0, 2, 4, 1, 3, 6, 0, 5, 0, 2, 7, 2, 4, 1, 4, 1};

AxisFlip FlipOf(const std::array<float, 3>& s) {
  AxisFlip flip{s, {1, s[1] * s[2], s[0] * s[2], s[0] * s[1]}, {}};
  for (size_t k = 0; k < 16; ++k) {
    flip.sh[k] = 1;
    for (size_t a = 0; a < 3; ++a) {
      if ((kOddIn[k] >> a & 1) != 0) flip.sh[k] *= s[a];
    }
  }
  return flip;
}

void FlipRows(GaussianCloud& cloud, const AxisFlip& flip, int64_t first, int64_t last) {
  for (int64_t i = first; i < last; ++i) {
    float* mean = cloud.means.data() + 3 * i;
    for (size_t k = 0; k < 3; ++k) mean[k] *= flip.mean[k];
    float* quat = cloud.quats.data() + 4 * i;
    for (size_t k = 0; k < 4; ++k) quat[k] *= flip.quat[k];
    float* sh = cloud.sh.data() + i * cloud.sh_stride();
    for (int64_t k = 0; k < cloud.sh_stride(); ++k) sh[k] *= flip.sh[static_cast<size_t>(k / 3)];
  }
}

void TurnRows(GaussianCloud& cloud, const AxisTurn& turn, const std::optional<ShRotation>& harmonics, int64_t first,
              int64_t last) {
  const std::array<double, 9> m = turn.matrix();
  const auto determinant = static_cast<float>(m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
                                              m[2] * (m[3] * m[7] - m[4] * m[6]));
  const auto turn_three = [&turn](float* values, float factor, bool signs) {
    const std::array<float, 3> old = {values[0], values[1], values[2]};
    for (size_t k = 0; k < 3; ++k) values[k] = factor * (signs ? turn.sign[k] : 1) * old[turn.from[k]];
  };
  for (int64_t i = first; i < last; ++i) {
    turn_three(cloud.means.data() + 3 * i, 1, true);
    turn_three(cloud.quats.data() + 4 * i + 1, determinant, true);
    turn_three(cloud.log_scales.data() + 3 * i, 1, false);
    if (harmonics) harmonics->Apply(cloud.sh.data() + i * cloud.sh_stride(), cloud.sh_degree);
  }
}

}  // namespace

std::optional<Axes> AxesFromName(std::string_view name) {
  if (name.size() != 3) return std::nullopt;
  Axes axes;
  std::array<bool, 3> seen{};
  for (size_t k = 0; k < 3; ++k) {
    const char letter = static_cast<char>(std::tolower(static_cast<unsigned char>(name[k])));
    const size_t positive = kPositive.find(letter), negative = kNegative.find(letter);
    axes.along[k] = std::min(positive, negative);
    axes.sign[k] = positive < negative ? 1.0f : -1.0f;
    if (axes.along[k] > 2 || std::exchange(seen[axes.along[k]], true)) return std::nullopt;
  }
  return axes;
}

std::string NameOfAxes(const Axes& axes) {
  std::string name;
  for (size_t k = 0; k < 3; ++k) {
    const char letter = (axes.sign[k] > 0 ? kPositive : kNegative)[axes.along[k]];
    name += static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
  }
  return name;
}

std::array<double, 9> AxisTurn::matrix() const {
  std::array<double, 9> m{};
  for (size_t k = 0; k < 3; ++k) m[3 * k + from[k]] = sign[k];
  return m;
}

AxisTurn TurnBetween(const Axes& from, const Axes& to) {
  AxisTurn turn;
  for (size_t k = 0; k < 3; ++k) {
    const auto same = std::ranges::find(from.along, to.along[k]);
    turn.from[k] = static_cast<size_t>(same - from.along.begin());
    turn.sign[k] = to.sign[k] * from.sign[turn.from[k]];
  }
  return turn;
}

AxisTurn Concatenate(const AxisTurn& first, const AxisTurn& second) {
  AxisTurn both;
  for (size_t k = 0; k < 3; ++k) {
    both.from[k] = first.from[second.from[k]];
    both.sign[k] = second.sign[k] * first.sign[second.from[k]];
  }
  return both;
}

AxisFlip FlipBetween(const Axes& from, const Axes& to) { return FlipOf(TurnBetween(from, to).sign); }

void TurnAxes(GaussianCloud& cloud, const AxisTurn& turn) {
  if (turn.changes_nothing()) return;
  TurnUpComments(turn.matrix(), cloud.comments);
  const WorldOrigin origin = cloud.origin;
  for (size_t k = 0; k < 3; ++k) cloud.origin[k] = double{turn.sign[k]} * origin[turn.from[k]];
  const AxisFlip flip = FlipOf(turn.sign);
  std::optional<ShRotation> harmonics;
  if (!turn.only_signs() && cloud.sh_degree > 0) harmonics.emplace(turn.matrix());
  ParallelFor(0, cloud.size(), 1 << 14, [&](int64_t first, int64_t last) {
    turn.only_signs() ? FlipRows(cloud, flip, first, last) : TurnRows(cloud, turn, harmonics, first, last);
  });
}

}  // namespace anchorsplat
