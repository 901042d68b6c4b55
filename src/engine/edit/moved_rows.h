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

// Applies p ↦ s·M·p + t (M orthogonal) to Gaussians. Means follow it. Covariance R S² Rᵀ becomes s²·M R S² Rᵀ Mᵀ, that
// of rotation det(M)·M·R and lengths s·S, as −1 cancels. A colour seen along d is now seen along M·d
// (core/sh_rotation.h). Normals become M·n.
//
// Computes in double and rounds once. Unchanged rows keep their bits; if M is the identity, so do quaternions and SH.
class RowMover {
 public:
  // `from`: origin of the input rows; `to`: of the output rows.
  RowMover(const Similarity& world, const WorldOrigin& from, const WorldOrigin& to, int sh_degree);

  bool changes_nothing() const { return !turns_ && !scales_ && !shifts_; }
  // Moves rows [first, last) in place. SH above the constructor's degree stay.
  void Move(GaussianCloud& rows, int64_t first, int64_t last) const;
  void Move(ExtraProperties& extras, int64_t first, int64_t last) const;

  bool turns() const { return turns_; }
  // Rotates a quaternion (wxyz) or SH [K,3] of any degree in place. Require turns().
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
