// Shared by forward and backward projection: a Gaussian's position in camera space, rotation and scales, and the factor
// B of its 2-D covariance, Σ₂ = B·Bᵀ. Compiled once per instruction set, as <hwy/highway.h>.

#if defined(ANCHORSPLAT_RENDER_PROJECTION_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef ANCHORSPLAT_RENDER_PROJECTION_INL_H_
#undef ANCHORSPLAT_RENDER_PROJECTION_INL_H_
#else
#define ANCHORSPLAT_RENDER_PROJECTION_INL_H_
#endif

#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>

#include "core/camera.h"
#include "render/constants.h"

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
// Shapes are computed in float, two registers of doubles at a time; for exceptions see IsExtreme.
using Floats = hn::CappedTag<float, 16>;
using Doubles = hn::CappedTag<double, 8>;
using Narrow = hn::Rebind<float, Doubles>;  // as many floats as doubles in a register

// Gaussians are transposed from rows to columns in batches of this size: long enough that a column's stores have left
// the store buffer when it is read, short enough for the L1 cache.
constexpr size_t kBatch = 64;
constexpr size_t kLanesAtMost = 16;

// Stored values and positions of Gaussians, one per column.
template <typename T>
struct StoredColumns {
  alignas(64) T log_scales[3][kBatch];
  alignas(64) T quats[4][kBatch];
  alignas(64) T logits[kBatch];
  alignas(64) T inverse_z[kBatch], ratio_x[kBatch], ratio_y[kBatch];  // 1/z, x/z, y/z in camera space, z ≠ 0
};

// Loads stored values of rows from `first` into columns, in whole registers; returns the number of rows. The rest is
// loaded row by row.
template <typename Params>
HWY_INLINE size_t ReadWholeRegisters(const Params& p, int64_t first, size_t n, StoredColumns<float>& c) {
  const Floats d;
  using F = hn::Vec<Floats>;
  const size_t lanes = hn::Lanes(d), whole = n / lanes * lanes;
  for (size_t j = 0; j < whole; j += lanes) {
    const int64_t i = first + static_cast<int64_t>(j);
    F x, y, z, w;
    hn::LoadInterleaved3(d, p.log_scales + 3 * i, x, y, z);
    hn::Store(x, d, c.log_scales[0] + j);
    hn::Store(y, d, c.log_scales[1] + j);
    hn::Store(z, d, c.log_scales[2] + j);
    hn::LoadInterleaved4(d, p.quats + 4 * i, w, x, y, z);
    hn::Store(w, d, c.quats[0] + j);
    hn::Store(x, d, c.quats[1] + j);
    hn::Store(y, d, c.quats[2] + j);
    hn::Store(z, d, c.quats[3] + j);
    hn::Store(hn::LoadU(d, p.opacity_logits + i), d, c.logits + j);
  }
  return whole;
}

// Loads one row.
template <typename Params, typename T>
HWY_INLINE void ReadRow(const Params& p, int64_t i, size_t j, StoredColumns<T>& c) {
  for (int a = 0; a < 3; ++a) c.log_scales[a][j] = p.log_scales[3 * i + a];
  for (int a = 0; a < 4; ++a) c.quats[a][j] = p.quats[4 * i + a];
  c.logits[j] = p.opacity_logits[i];
}

// Data independent of the Gaussian.
struct View {
  double r[9], t[3];
  double fx, fy, cx, cy, inverse_fx, inverse_fy;
  double left, right, up, down;  // limits of x/z and y/z in the Jacobian
  double dilation, compensated_from;
};

template <typename Params>
View MakeView(const Params& p) {
  View v;
  std::copy(p.world_to_camera.rotation.begin(), p.world_to_camera.rotation.end(), v.r);
  std::copy(p.world_to_camera.translation.begin(), p.world_to_camera.translation.end(), v.t);
  const Pinhole& k = p.intrinsics;
  v.fx = k.fx, v.fy = k.fy, v.cx = k.cx, v.cy = k.cy;
  v.inverse_fx = 1 / k.fx, v.inverse_fy = 1 / k.fy;
  const double margin_x = double{kFrustumMargin} * 0.5 * k.width / k.fx;
  const double margin_y = double{kFrustumMargin} * 0.5 * k.height / k.fy;
  v.left = -(k.cx / k.fx + margin_x);
  v.right = (k.width - k.cx) / k.fx + margin_x;
  v.up = -(k.cy / k.fy + margin_y);
  v.down = (k.height - k.cy) / k.fy + margin_y;
  v.dilation = p.dilation, v.compensated_from = p.compensated_from;
  return v;
}

template <class D>
HWY_INLINE hn::Vec<D> Number(D d, double x) {
  return hn::Set(d, static_cast<hn::TFromD<D>>(x));
}

template <class V>
HWY_INLINE V Dot3(V a0, V a1, V a2, V b0, V b1, V b2) {
  return hn::MulAdd(a0, b0, hn::MulAdd(a1, b1, hn::Mul(a2, b2)));
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE V Clamped(D d, V x, double low, double high) {
  return hn::Min(hn::Max(x, Number(d, low)), Number(d, high));
}

// Above the bound, the covariance is infinite and the Gaussian culled (float: recomputed in double); the bound only
// keeps exp inside its domain.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V ExpInDomain(D d, V x) {
  return hn::Exp(d, hn::Min(x, Number(d, sizeof(hn::TFromD<D>) == sizeof(float) ? 87.0 : 690.0)));
}

// A register of Gaussians, named as in the formulas: q the unit quaternion, R_q its rotation, s the scales, A = J·R
// (rows for image x and y), B = A·R_q·S.
//
// The explicit constructor is compiled for this target, as ARM's vector types require; the implicit one would not be.
template <class D>
struct Shape {
  using V = hn::Vec<D>;
  HWY_INLINE Shape() {}
  V inverse_z, ratio_x, ratio_y;  // 1/z, x/z, y/z
  V focal_x, focal_y;             // f/z
  V u, v;                         // ratios clamped to the view's limits
  V qw, qx, qy, qz, norm2, inverse_norm;
  hn::Mask<D> zero_quat;  // treated as (1, 0, 0, 0)
  V r00, r01, r02, r10, r11, r12, r20, r21, r22;
  V s0, s1, s2;
  V a0, a1, a2, a3, a4, a5;
  V b0, b1, b2, b3, b4, b5;
};

// Shape of columns j … j + lanes − 1.
template <class D>
HWY_INLINE Shape<D> ShapeOf(D d, const View& view, const StoredColumns<hn::TFromD<D>>& in, size_t j) {
  using V = hn::Vec<D>;
  const V one = Number(d, 1), two = Number(d, 2);
  const auto r = [&view, d](size_t k) HWY_ATTR { return Number(d, view.r[k]); };
  Shape<D> g;
  g.inverse_z = hn::Load(d, in.inverse_z + j);
  g.ratio_x = hn::Load(d, in.ratio_x + j), g.ratio_y = hn::Load(d, in.ratio_y + j);

  V qw = hn::Load(d, in.quats[0] + j), qx = hn::Load(d, in.quats[1] + j), qy = hn::Load(d, in.quats[2] + j),
    qz = hn::Load(d, in.quats[3] + j);
  g.norm2 = hn::Add(Dot3(qw, qx, qy, qw, qx, qy), hn::Mul(qz, qz));
  // Not by the squared norm, which underflows to 0 for short quaternions.
  g.zero_quat = hn::Eq(hn::Max(hn::Max(hn::Abs(qw), hn::Abs(qx)), hn::Max(hn::Abs(qy), hn::Abs(qz))), hn::Zero(d));
  g.inverse_norm = hn::IfThenElse(g.zero_quat, one, hn::Div(one, hn::Sqrt(g.norm2)));
  qw = g.qw = hn::IfThenElse(g.zero_quat, one, hn::Mul(qw, g.inverse_norm));
  qx = g.qx = hn::Mul(qx, g.inverse_norm);
  qy = g.qy = hn::Mul(qy, g.inverse_norm);
  qz = g.qz = hn::Mul(qz, g.inverse_norm);
  const V x2 = hn::Mul(two, qx), y2 = hn::Mul(two, qy), z2 = hn::Mul(two, qz);
  g.r00 = hn::NegMulAdd(y2, qy, hn::NegMulAdd(z2, qz, one)), g.r01 = hn::MulSub(x2, qy, hn::Mul(z2, qw)),
  g.r02 = hn::MulAdd(x2, qz, hn::Mul(y2, qw));
  g.r10 = hn::MulAdd(x2, qy, hn::Mul(z2, qw)), g.r11 = hn::NegMulAdd(x2, qx, hn::NegMulAdd(z2, qz, one)),
  g.r12 = hn::MulSub(y2, qz, hn::Mul(x2, qw));
  g.r20 = hn::MulSub(x2, qz, hn::Mul(y2, qw)), g.r21 = hn::MulAdd(y2, qz, hn::Mul(x2, qw)),
  g.r22 = hn::NegMulAdd(x2, qx, hn::NegMulAdd(y2, qy, one));
  g.s0 = ExpInDomain(d, hn::Load(d, in.log_scales[0] + j));
  g.s1 = ExpInDomain(d, hn::Load(d, in.log_scales[1] + j));
  g.s2 = ExpInDomain(d, hn::Load(d, in.log_scales[2] + j));

  g.u = Clamped(d, g.ratio_x, view.left, view.right), g.v = Clamped(d, g.ratio_y, view.up, view.down);
  g.focal_x = hn::Mul(Number(d, view.fx), g.inverse_z), g.focal_y = hn::Mul(Number(d, view.fy), g.inverse_z);
  g.a0 = hn::Mul(g.focal_x, hn::NegMulAdd(g.u, r(6), r(0)));
  g.a1 = hn::Mul(g.focal_x, hn::NegMulAdd(g.u, r(7), r(1)));
  g.a2 = hn::Mul(g.focal_x, hn::NegMulAdd(g.u, r(8), r(2)));
  g.a3 = hn::Mul(g.focal_y, hn::NegMulAdd(g.v, r(6), r(3)));
  g.a4 = hn::Mul(g.focal_y, hn::NegMulAdd(g.v, r(7), r(4)));
  g.a5 = hn::Mul(g.focal_y, hn::NegMulAdd(g.v, r(8), r(5)));
  g.b0 = hn::Mul(g.s0, Dot3(g.a0, g.a1, g.a2, g.r00, g.r10, g.r20));
  g.b1 = hn::Mul(g.s1, Dot3(g.a0, g.a1, g.a2, g.r01, g.r11, g.r21));
  g.b2 = hn::Mul(g.s2, Dot3(g.a0, g.a1, g.a2, g.r02, g.r12, g.r22));
  g.b3 = hn::Mul(g.s0, Dot3(g.a3, g.a4, g.a5, g.r00, g.r10, g.r20));
  g.b4 = hn::Mul(g.s1, Dot3(g.a3, g.a4, g.a5, g.r01, g.r11, g.r21));
  g.b5 = hn::Mul(g.s2, Dot3(g.a3, g.a4, g.a5, g.r02, g.r12, g.r22));
  return g;
}

// a·b − c·d without cancellation of rounding errors (Kahan), given fused multiply-add.
template <class V>
HWY_INLINE V DifferenceOfProducts(V a, V b, V c, V d) {
  const V second = hn::Mul(c, d);
  const V error = hn::NegMulAdd(c, d, second);
  return hn::Add(hn::MulSub(a, b, second), error);
}

// Σ₂ in pixels² with the dilation (xx, yy), and with the smaller dilation that opacities are compensated from.
template <class V>
struct Covariance {
  HWY_INLINE Covariance() {}
  V xx, xy, yy, det;
  V from_xx, from_yy, from_det;
};
template <class D, class V = hn::Vec<D>>
HWY_INLINE Covariance<V> CovarianceOf(D d, const View& view, const Shape<D>& g) {
  const V sharp_xx = Dot3(g.b0, g.b1, g.b2, g.b0, g.b1, g.b2), sharp_yy = Dot3(g.b3, g.b4, g.b5, g.b3, g.b4, g.b5);
  const V dilation = Number(d, view.dilation), from = Number(d, view.compensated_from);
  // det(B·Bᵀ) as the sum of the squares of B's minors (Cauchy-Binet), plus δ·trace + δ² for a dilation δ: all terms are
  // non-negative, so a needle keeps the precision that xx·yy − xy² would lose.
  const V minor0 = DifferenceOfProducts(g.b1, g.b5, g.b2, g.b4), minor1 = DifferenceOfProducts(g.b2, g.b3, g.b0, g.b5),
          minor2 = DifferenceOfProducts(g.b0, g.b4, g.b1, g.b3);
  const V sharp_det = Dot3(minor0, minor1, minor2, minor0, minor1, minor2), trace = hn::Add(sharp_xx, sharp_yy);
  Covariance<V> c;
  c.xy = Dot3(g.b0, g.b1, g.b2, g.b3, g.b4, g.b5);
  c.xx = hn::Add(sharp_xx, dilation), c.yy = hn::Add(sharp_yy, dilation);
  c.det = hn::MulAdd(dilation, hn::Add(trace, dilation), sharp_det);
  c.from_xx = hn::Add(sharp_xx, from), c.from_yy = hn::Add(sharp_yy, from);
  c.from_det = hn::MulAdd(from, hn::Add(trace, from), sharp_det);
  return c;
}

// Gaussians whose values exceed the range in which floats can be squared. They are computed in double, separately, so
// that results do not depend on neighbours. `lowest` is the smallest determinant divided by. NaN counts as extreme.
template <class D, class V = hn::Vec<D>>
HWY_INLINE hn::Mask<D> IsExtreme(D d, const Shape<D>& g, V lowest) {
  const V longest = hn::Max(hn::Max(hn::Max(hn::Abs(g.b0), hn::Abs(g.b1)), hn::Max(hn::Abs(g.b2), hn::Abs(g.b3))),
                            hn::Max(hn::Abs(g.b4), hn::Abs(g.b5)));
  const V sum = hn::Add(Dot3(g.b0, g.b1, g.b2, g.b3, g.b4, g.b5), g.norm2);  // NaN if one is; Max may lose it
  const V scale = hn::Max(hn::Max(g.s0, g.s1), hn::Max(g.s2, hn::Max(g.focal_x, g.focal_y)));
  const auto longest_fits = hn::And(hn::Le(longest, Number(d, 1e8)), hn::Le(scale, Number(d, 1e20)));
  const auto det_fits = hn::Ge(lowest, Number(d, 1e-30));
  const auto norm_fits =
      hn::Or(g.zero_quat, hn::And(hn::Ge(g.norm2, Number(d, 1e-24)), hn::Le(g.norm2, Number(d, 1e24))));
  return hn::Not(hn::And(hn::And(longest_fits, det_fits), hn::And(norm_fits, hn::Eq(sum, sum))));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#endif  // per target
