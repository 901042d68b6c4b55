#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "core/gaussian_cloud.h"

namespace anchorsplat {

// What the axes x, y and z of a file mean, as three letters: Right or Left, Up or Down, Front or Back. A cloud in
// memory is RDF, as INRIA's PLY is (x right, y down, z forward); SPZ is RUB by its specification, glTF LUF. Going from
// one to another only changes signs.
struct Axes {
  // +1 where the axis points right, down, front; −1 where it points left, up, back.
  std::array<float, 3> sign = {1, 1, 1};
  friend bool operator==(const Axes&, const Axes&) = default;
};
inline constexpr Axes kRdf = {{1, 1, 1}};
inline constexpr Axes kRub = {{1, -1, -1}};
inline constexpr Axes kLuf = {{-1, -1, 1}};

// "rub" in any case; nothing for other words.
std::optional<Axes> AxesFromName(std::string_view name);
std::string NameOfAxes(const Axes& axes);

// The signs that take values along `from` to values along `to`.
struct AxisFlip {
  std::array<float, 3> mean;
  std::array<float, 4> quat;  // wxyz
  std::array<float, 16> sh;   // per coefficient, of any degree up to 3

  bool changes_nothing() const { return mean == std::array<float, 3>{1, 1, 1}; }
};

// With M = diag(signs): means become M·p. Covariances become M R S Sᵀ Rᵀ M; as S is diagonal, M R M is a rotation that
// gives the same, also when M mirrors, and its quaternion is (w, s_y s_z x, s_x s_z y, s_x s_y z). Every SH basis
// function is even or odd in each coordinate (ShBasis in core/spherical_harmonics.h), so its coefficient gets the
// product of the signs of the coordinates it is odd in.
AxisFlip FlipBetween(const Axes& from, const Axes& to);

// In place, all Gaussians.
void FlipAxes(GaussianCloud& cloud, const AxisFlip& flip);

}  // namespace anchorsplat
