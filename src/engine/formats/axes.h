#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "core/gaussian_cloud.h"

namespace anchorsplat {

// What the axes x, y and z of a file mean, as three letters: Right or Left, Up or Down, Front or Back, each once and in
// any order. A cloud in memory is RDF, as INRIA's PLY is (x right, y down, z forward); SPZ is RUB by its specification,
// glTF LUF; RFU has z up.
struct Axes {
  // The direction that each axis lies along: 0 right, 1 down, 2 front; and whether it points there (+1) or away (−1).
  std::array<size_t, 3> along = {0, 1, 2};
  std::array<float, 3> sign = {1, 1, 1};
  friend bool operator==(const Axes&, const Axes&) = default;
};
inline constexpr Axes kRdf = {};
inline constexpr Axes kRub = {{0, 1, 2}, {1, -1, -1}};
inline constexpr Axes kLuf = {{0, 1, 2}, {-1, -1, 1}};

// "rub" in any case; nothing for other words.
std::optional<Axes> AxesFromName(std::string_view name);
std::string NameOfAxes(const Axes& axes);

// What takes values along some axes to values along others: axis k gets sign[k] times what was along axis from[k].
struct AxisTurn {
  std::array<size_t, 3> from = {0, 1, 2};
  std::array<float, 3> sign = {1, 1, 1};

  bool changes_nothing() const { return *this == AxisTurn{}; }
  bool only_signs() const { return from == AxisTurn{}.from; }
  std::array<double, 9> matrix() const;  // row-major, of determinant ±1
  friend bool operator==(const AxisTurn&, const AxisTurn&) = default;
};
AxisTurn TurnBetween(const Axes& from, const Axes& to);
// `first` and then `second`.
AxisTurn Both(const AxisTurn& first, const AxisTurn& second);

// In place, all Gaussians and the comments that say where up is. With M the matrix: means become M·p. Covariances
// become M R S Sᵀ Rᵀ Mᵀ = (M R Mᵀ) (M S Sᵀ Mᵀ) (M R Mᵀ)ᵀ: M R Mᵀ is a rotation, also where M mirrors, and its
// quaternion has |M|·M·(x, y, z) in the place of x, y, z; the lengths change their places like the axes. So nothing of
// these is rounded. Harmonics are: core/sh_rotation.h, but where only signs change.
void TurnAxes(GaussianCloud& cloud, const AxisTurn& turn);

// The signs that take values along `from` to values along `to`, which lie along the same axes.
struct AxisFlip {
  std::array<float, 3> mean;
  std::array<float, 4> quat;  // wxyz
  std::array<float, 16> sh;   // per coefficient, of any degree up to 3
};

// TurnAxes where only signs change. Every SH basis function is even or odd in each coordinate (ShBasis in
// core/spherical_harmonics.h), so its coefficient gets the product of the signs of the coordinates it is odd in.
AxisFlip FlipBetween(const Axes& from, const Axes& to);

}  // namespace anchorsplat
