#pragma once

#include <array>
#include <optional>

namespace anchorsplat {

// Lens distortion of a point (x, y) = (X/Z, Y/Z) on the plane at depth 1, OpenCV axes. With r² = x² + y², θ = atan r:
//
//   kRadial   s = (1 + k1·r² + k2·r⁴ + k3·r⁶ + k4·r⁸) / (1 + d1·r² + d2·r⁴ + d3·r⁶)
//             x' = s·x + 2·p1·x·y + p2·(r² + 2x²),  y' = s·y + 2·p2·x·y + p1·(r² + 2y²)       (Brown 1971, OpenCV)
//   kFisheye  θ' = θ·(1 + k1·θ² + k2·θ⁴ + k3·θ⁶ + k4·θ⁸),  (x', y') = θ'/r · (x, y)            (OpenCV's fisheye)
//
// Pixel position = (x' + skew·y', y') · focal lengths + principal point.
enum class LensModel { kNone, kRadial, kFisheye };
struct Lens {
  LensModel model = LensModel::kNone;
  std::array<double, 4> radial = {0, 0, 0, 0};    // k1 … k4
  std::array<double, 3> denominator = {0, 0, 0};  // d1 … d3; COLMAP's FULL_OPENCV calls them k4, k5, k6
  std::array<double, 2> tangential = {0, 0};      // p1, p2
  double skew = 0;                                // shear of rows against columns, in units of fx

  // Whether the lens distorts nothing: no model, or a radial one with all zeros. A fisheye of zeros still distorts.
  bool IsIdentity() const;
  friend bool operator==(const Lens&, const Lens&) = default;
};

using PlanePoint = std::array<double, 2>;

PlanePoint Distort(const Lens& lens, const PlanePoint& undistorted);

// Inverse of Distort, for many points of one lens.
class LensInverse {
 public:
  explicit LensInverse(const Lens& lens);

  // The undistorted point. None if the lens maps no point there: a fisheye at 90° or more, or a radius beyond the
  // model's fold-back (largest_radius).
  std::optional<PlanePoint> Undistort(const PlanePoint& distorted) const;

  // Largest r up to which distortion is monotonic. A polynomial fitted to the picture is meaningless beyond it and
  // folds back over the picture.
  double largest_radius() const { return largest_radius_; }

 private:
  Lens lens_;
  double largest_radius_;
  double largest_distorted_;  // distorted largest_radius_
};

}  // namespace anchorsplat
