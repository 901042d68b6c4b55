#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/gaussian_cloud.h"
#include "core/sh_rotation.h"
#include "core/similarity.h"
#include "core/world_origin.h"
#include "formats/extra_properties.h"

namespace anchorsplat {

// What becomes of Gaussians where their world moves: p ↦ s·M·p + t, M orthogonal. Means go along. A covariance
// R S² Rᵀ becomes s²·M R S² Rᵀ Mᵀ, which is that of the rotation det(M)·M·R and the lengths s·S, as −1 cancels out. A
// colour that was seen along d is now seen along M·d: core/sh_rotation.h. Normals become M·n.
//
// Calculated in double and rounded once. Rows of which nothing changes keep their bits, and so does a row's quaternion
// and its harmonics where M is the identity.
class RowMover {
 public:
  // `from`: origin of the rows that come; `to`: of those that they become.
  RowMover(const Similarity& world, const WorldOrigin& from, const WorldOrigin& to, int sh_degree);

  bool changes_nothing() const { return !turns_ && !scales_ && !shifts_; }
  // Rows [first, last) in place. Harmonics above the SH degree of the constructor stay.
  void Move(GaussianCloud& rows, int64_t first, int64_t last) const;
  void Move(ExtraProperties& extras, int64_t first, int64_t last) const;

  bool turns() const { return turns_; }
  // Of one row, where turns(): its quaternion, wxyz, and its harmonics [K,3] of some degree, in place.
  void TurnQuaternion(float* quat) const;
  void TurnHarmonics(float* sh, int degree) const;

 private:
  Similarity world_;
  std::array<double, 9> linear_;  // of means, row-major
  std::array<double, 3> shift_;
  std::array<double, 4> quat_;  // wxyz, of det(M)·M
  double log_scale_;
  int sh_degree_;
  bool turns_, scales_, shifts_;
  std::optional<ShRotation> harmonics_;
};

}  // namespace anchorsplat
