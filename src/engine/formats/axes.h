#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Meaning of a file's axes x, y and z, as three letters: Right or Left, Up or Down, Front or Back, each once in any
// order. Clouds in memory are RDF, as INRIA's PLY (x right, y down, z forward); SPZ is RUB by its specification, glTF
// LUF; RFU has z up.
struct Axes {
  // Direction of each axis: 0 right, 1 down, 2 front; and whether it points that way (+1) or the opposite (−1).
  std::array<size_t, 3> along = {0, 1, 2};
  std::array<float, 3> sign = {1, 1, 1};
  friend bool operator==(const Axes&, const Axes&) = default;
};
inline constexpr Axes kRdf = {};
inline constexpr Axes kRub = {{0, 1, 2}, {1, -1, -1}};
inline constexpr Axes kLuf = {{0, 1, 2}, {-1, -1, 1}};

// Parses "rub" in any case; none for other words.
std::optional<Axes> AxesFromName(std::string_view name);
std::string NameOfAxes(const Axes& axes);

// Conversion between axes: output axis k is sign[k] times input axis from[k].
struct AxisTurn {
  std::array<size_t, 3> from = {0, 1, 2};
  std::array<float, 3> sign = {1, 1, 1};

  bool changes_nothing() const { return *this == AxisTurn{}; }
  bool only_signs() const { return from == AxisTurn{}.from; }
  std::array<double, 9> matrix() const;  // row-major, determinant ±1
  friend bool operator==(const AxisTurn&, const AxisTurn&) = default;
};
AxisTurn TurnBetween(const Axes& from, const Axes& to);
// Applies `first`, then `second`.
AxisTurn Concatenate(const AxisTurn& first, const AxisTurn& second);

// Converts all Gaussians and the comments about the up direction, in place. With matrix M, means become M·p and
// covariances M R S Sᵀ Rᵀ Mᵀ = (M R Mᵀ) (M S Sᵀ Mᵀ) (M R Mᵀ)ᵀ. M R Mᵀ is a rotation even if M mirrors: its quaternion
// has |M|·M·(x, y, z) instead of (x, y, z), and scales are permuted like the axes. So none of these is rounded. SH are
// (core/sh_rotation.h), unless only signs change.
void TurnAxes(GaussianCloud& cloud, const AxisTurn& turn);

// Sign changes between two axis systems that differ only in signs.
struct AxisFlip {
  std::array<float, 3> mean;
  std::array<float, 4> quat;  // wxyz
  std::array<float, 16> sh;   // per coefficient, degree 0 to 3
};

// TurnAxes for sign changes. Each SH basis function is even or odd in each coordinate (ShBasis in
// core/spherical_harmonics.h), so its coefficient is multiplied by the signs of the coordinates it is odd in.
AxisFlip FlipBetween(const Axes& from, const Axes& to);

}  // namespace anchorsplat
