#include "edit/moved_rows.h"

#include <algorithm>
#include <cmath>

#include "core/rotation.h"

namespace anchorsplat {

namespace {

constexpr std::array<double, 9> kIdentity = {1, 0, 0, 0, 1, 0, 0, 0, 1};

double Determinant(const std::array<double, 9>& m) {
  return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6]);
}

}  // namespace

RowMover::RowMover(const Similarity& world, const WorldOrigin& from, const WorldOrigin& to, int sh_degree)
    : world_(world),
      linear_(world.rotation),
      log_scale_(std::log(world.scale)),
      sh_degree_(sh_degree),
      turns_(world.rotation != kIdentity),
      scales_(world.scale != 1) {
  for (double& x : linear_) x *= world.scale;
  const std::array<double, 3> origin = world.Apply(from);
  for (size_t k = 0; k < 3; ++k) shift_[k] = origin[k] - to[k];
  shifts_ = shift_ != std::array<double, 3>{};
  std::array<double, 9> proper = world.rotation;
  if (Determinant(proper) < 0) {
    for (double& x : proper) x = -x;
  }
  quat_ = QuaternionFromRotation(proper);
  if (turns_ && sh_degree > 0) harmonics_.emplace(world.rotation);
}

void RowMover::Move(GaussianCloud& rows, int64_t first, int64_t last) const {
  if (changes_nothing()) return;
  const Similarity means = {linear_, shift_, 1};
  const auto added = static_cast<float>(log_scale_);
  for (int64_t i = first; i < last; ++i) {
    float* mean = rows.means.data() + 3 * i;
    if (turns_ || scales_) {
      const std::array<double, 3> moved = means.Apply({mean[0], mean[1], mean[2]});
      for (size_t k = 0; k < 3; ++k) mean[k] = static_cast<float>(moved[k]);
    } else {
      for (size_t k = 0; k < 3; ++k) mean[k] = static_cast<float>(double{mean[k]} + shift_[k]);
    }
    if (scales_) {
      for (int64_t k = 3 * i; k < 3 * i + 3; ++k) rows.log_scales[static_cast<size_t>(k)] += added;
    }
    if (!turns_) continue;
    TurnQuaternion(rows.quats.data() + 4 * i);
    TurnHarmonics(rows.sh.data() + i * rows.sh_stride(), rows.sh_degree);
  }
}

// Replaces b by a ⊗ b (wxyz): rotation b, then a. The zero quaternion counts as no rotation (core/rotation.h).
void RowMover::TurnQuaternion(float* q) const {
  const std::array<double, 4>& a = quat_;
  std::array<double, 4> b = {q[0], q[1], q[2], q[3]};
  if (b == std::array<double, 4>{}) b[0] = 1;
  q[0] = static_cast<float>(a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]);
  q[1] = static_cast<float>(a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]);
  q[2] = static_cast<float>(a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]);
  q[3] = static_cast<float>(a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]);
}

void RowMover::TurnHarmonics(float* sh, int degree) const {
  if (harmonics_) harmonics_->Apply(sh, std::min(degree, sh_degree_));
}

void RowMover::Move(ExtraProperties& extras, int64_t first, int64_t last) const {
  if (changes_nothing()) return;
  const Similarity turn = {world_.rotation, {}, 1};
  for (int64_t i = first; i < last && !extras.normals.empty() && turns_; ++i) {
    float* normal = extras.normals.data() + 3 * i;
    if (normal[0] == 0 && normal[1] == 0 && normal[2] == 0) continue;  // absent; avoids negative zeros
    const std::array<double, 3> turned = turn.Apply({normal[0], normal[1], normal[2]});
    for (size_t k = 0; k < 3; ++k) normal[k] = static_cast<float>(turned[k]);
  }
  for (int64_t i = first; i < last && !extras.world.empty(); ++i) {
    double* at = extras.world.data() + 3 * i;
    const std::array<double, 3> moved = world_.Apply({at[0], at[1], at[2]});
    for (size_t k = 0; k < 3; ++k) at[k] = moved[k];
  }
}

}  // namespace anchorsplat
