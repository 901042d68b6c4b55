#pragma once

#include <array>
#include <optional>

namespace anchorsplat {

// How a lens bends a pinhole's picture, of points of the plane at depth 1: (x/z, y/z), OpenCV axes. With r² = x² + y²
// and θ = atan r:
//
//   kRadial   s = (1 + k1·r² + k2·r⁴ + k3·r⁶ + k4·r⁸) / (1 + d1·r² + d2·r⁴ + d3·r⁶)
//             x' = s·x + 2·p1·x·y + p2·(r² + 2x²),  y' = s·y + 2·p2·x·y + p1·(r² + 2y²)       (Brown 1971, OpenCV)
//   kFisheye  θ' = θ·(1 + k1·θ² + k2·θ⁴ + k3·θ⁶ + k4·θ⁸),  (x', y') = θ'/r · (x, y)            (OpenCV's fisheye)
//
// (x' + skew·y', y') times the focal lengths, plus the principal point, is the place in the picture.
enum class LensModel { kStraight, kRadial, kFisheye };
struct Lens {
  LensModel model = LensModel::kStraight;
  std::array<double, 4> radial = {0, 0, 0, 0};    // k1 … k4
  std::array<double, 3> denominator = {0, 0, 0};  // d1 … d3, which FULL_OPENCV calls k4, k5, k6
  std::array<double, 2> tangential = {0, 0};      // p1, p2
  double skew = 0;                                // of rows against columns, in horizontal focal lengths

  // Draws what a pinhole does: no model, or a radial one of zeros. A fisheye of zeros is not straight.
  bool IsStraight() const;
  friend bool operator==(const Lens&, const Lens&) = default;
};

using PlanePoint = std::array<double, 2>;

PlanePoint Distort(const Lens& lens, const PlanePoint& straight);

// The other way, for many points of one lens.
class LensInverse {
 public:
  explicit LensInverse(const Lens& lens);

  // Nothing where the lens draws no point of the plane: behind 90 degrees of a fisheye, or farther out than the model
  // goes before it folds back.
  std::optional<PlanePoint> Undistort(const PlanePoint& distorted) const;

  // The radius r up to which a point farther out is drawn farther out; beyond it a polynomial that was fitted to what
  // the picture shows says nothing about the world, and folds over it.
  double largest_radius() const { return largest_radius_; }

 private:
  Lens lens_;
  double largest_radius_;
  double largest_drawn_;  // of the radius above
};

}  // namespace anchorsplat
