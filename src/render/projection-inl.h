// What both directions of projecting calculate of a Gaussian: its place before the camera, its rotation and lengths,
// and the factor B of its covariance in the picture, Σ₂ = B·Bᵀ. Compiled once per instruction set, as <hwy/highway.h>.

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
using D = hn::CappedTag<double, 8>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

// Gaussians are turned from rows into columns this many at a time: long enough that a column is read after its stores
// have left the store buffer, short enough for the L1 cache.
constexpr size_t kBatch = 64;

// Stored values, a Gaussian per column.
struct StoredColumns {
  alignas(64) double means[3][kBatch];
  alignas(64) double log_scales[3][kBatch];
  alignas(64) double quats[4][kBatch];
  alignas(64) double logits[kBatch];
};

// Rows of the cloud from `first` on to columns, as many whole registers as there are in `n`. Returns how many rows that
// are; the others go one by one.
template <typename Params>
HWY_INLINE size_t ReadWholeRegisters(const Params& p, int64_t first, size_t n, StoredColumns& c) {
  const D d;
  const hn::Rebind<float, D> df;
  using F = hn::Vec<decltype(df)>;
  const size_t lanes = hn::Lanes(d), whole = n / lanes * lanes;
  for (size_t j = 0; j < whole; j += lanes) {
    const int64_t i = first + static_cast<int64_t>(j);
    F x, y, z, w;
    hn::LoadInterleaved3(df, p.means + 3 * i, x, y, z);
    hn::Store(hn::PromoteTo(d, x), d, c.means[0] + j);
    hn::Store(hn::PromoteTo(d, y), d, c.means[1] + j);
    hn::Store(hn::PromoteTo(d, z), d, c.means[2] + j);
    hn::LoadInterleaved3(df, p.log_scales + 3 * i, x, y, z);
    hn::Store(hn::PromoteTo(d, x), d, c.log_scales[0] + j);
    hn::Store(hn::PromoteTo(d, y), d, c.log_scales[1] + j);
    hn::Store(hn::PromoteTo(d, z), d, c.log_scales[2] + j);
    hn::LoadInterleaved4(df, p.quats + 4 * i, w, x, y, z);
    hn::Store(hn::PromoteTo(d, w), d, c.quats[0] + j);
    hn::Store(hn::PromoteTo(d, x), d, c.quats[1] + j);
    hn::Store(hn::PromoteTo(d, y), d, c.quats[2] + j);
    hn::Store(hn::PromoteTo(d, z), d, c.quats[3] + j);
    hn::Store(hn::PromoteTo(d, hn::LoadU(df, p.opacity_logits + i)), d, c.logits + j);
  }
  return whole;
}

// What does not depend on the Gaussian.
struct View {
  double r[9], t[3];
  double fx, fy, cx, cy;
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
  const double margin_x = double{kFrustumMargin} * 0.5 * k.width / k.fx;
  const double margin_y = double{kFrustumMargin} * 0.5 * k.height / k.fy;
  v.left = -(k.cx / k.fx + margin_x);
  v.right = (k.width - k.cx) / k.fx + margin_x;
  v.up = -(k.cy / k.fy + margin_y);
  v.down = (k.height - k.cy) / k.fy + margin_y;
  v.dilation = p.dilation, v.compensated_from = p.compensated_from;
  return v;
}

HWY_INLINE V Dot3(V a0, V a1, V a2, V b0, V b1, V b2) {
  return hn::MulAdd(a0, b0, hn::MulAdd(a1, b1, hn::Mul(a2, b2)));
}

HWY_INLINE V Clamped(D d, V x, double low, double high) {
  return hn::Min(hn::Max(x, hn::Set(d, low)), hn::Set(d, high));
}

// Row `row` of R·mean + t: x, y or z in camera space.
HWY_INLINE V CameraSpace(D d, const View& view, const StoredColumns& in, size_t j, size_t row) {
  const double* r = view.r + 3 * row;
  return hn::Add(Dot3(hn::Set(d, r[0]), hn::Set(d, r[1]), hn::Set(d, r[2]), hn::Load(d, in.means[0] + j),
                      hn::Load(d, in.means[1] + j), hn::Load(d, in.means[2] + j)),
                 hn::Set(d, view.t[row]));
}

// Above ln(1e300) a covariance is infinite and its Gaussian culled; the bound only keeps exp inside its domain.
HWY_INLINE V ExpInDomain(D d, V x) { return hn::Exp(d, hn::Min(x, hn::Set(d, 690.0))); }

// One register of Gaussians. Names are those of the formulas: q the unit quaternion, R_q its rotation, s the lengths,
// A = J·R (rows for image x and y), B = A·R_q·S.
//
// Constructors are written down because the compiler's own would not be of this target, which ARM's vectors insist on.
struct Shape {
  HWY_INLINE Shape() {}
  V inverse_z, ratio_x, ratio_y;  // 1/z, x/z, y/z
  V focal_x, focal_y;             // f/z
  V u, v;                         // the ratios within the view's limits
  V qw, qx, qy, qz, inverse_norm;
  M zero_quat;  // which counts as (1, 0, 0, 0)
  V r00, r01, r02, r10, r11, r12, r20, r21, r22;
  V s0, s1, s2;
  V a0, a1, a2, a3, a4, a5;
  V b0, b1, b2, b3, b4, b5;
};

// From columns j … j + lanes − 1, which are at (x, y, z) in camera space, z ≠ 0.
HWY_INLINE Shape ShapeOf(D d, const View& view, const StoredColumns& in, size_t j, V x, V y, V z) {
  const V one = hn::Set(d, 1.0), two = hn::Set(d, 2.0);
  const double* r = view.r;
  Shape g;
  g.inverse_z = hn::Div(one, z);
  g.ratio_x = hn::Mul(x, g.inverse_z), g.ratio_y = hn::Mul(y, g.inverse_z);

  V qw = hn::Load(d, in.quats[0] + j), qx = hn::Load(d, in.quats[1] + j), qy = hn::Load(d, in.quats[2] + j),
    qz = hn::Load(d, in.quats[3] + j);
  const V norm2 = hn::Add(Dot3(qw, qx, qy, qw, qx, qy), hn::Mul(qz, qz));
  g.zero_quat = hn::Eq(norm2, hn::Zero(d));
  g.inverse_norm = hn::IfThenElse(g.zero_quat, one, hn::Div(one, hn::Sqrt(norm2)));
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
  g.focal_x = hn::Mul(hn::Set(d, view.fx), g.inverse_z), g.focal_y = hn::Mul(hn::Set(d, view.fy), g.inverse_z);
  g.a0 = hn::Mul(g.focal_x, hn::NegMulAdd(g.u, hn::Set(d, r[6]), hn::Set(d, r[0])));
  g.a1 = hn::Mul(g.focal_x, hn::NegMulAdd(g.u, hn::Set(d, r[7]), hn::Set(d, r[1])));
  g.a2 = hn::Mul(g.focal_x, hn::NegMulAdd(g.u, hn::Set(d, r[8]), hn::Set(d, r[2])));
  g.a3 = hn::Mul(g.focal_y, hn::NegMulAdd(g.v, hn::Set(d, r[6]), hn::Set(d, r[3])));
  g.a4 = hn::Mul(g.focal_y, hn::NegMulAdd(g.v, hn::Set(d, r[7]), hn::Set(d, r[4])));
  g.a5 = hn::Mul(g.focal_y, hn::NegMulAdd(g.v, hn::Set(d, r[8]), hn::Set(d, r[5])));
  g.b0 = hn::Mul(g.s0, Dot3(g.a0, g.a1, g.a2, g.r00, g.r10, g.r20));
  g.b1 = hn::Mul(g.s1, Dot3(g.a0, g.a1, g.a2, g.r01, g.r11, g.r21));
  g.b2 = hn::Mul(g.s2, Dot3(g.a0, g.a1, g.a2, g.r02, g.r12, g.r22));
  g.b3 = hn::Mul(g.s0, Dot3(g.a3, g.a4, g.a5, g.r00, g.r10, g.r20));
  g.b4 = hn::Mul(g.s1, Dot3(g.a3, g.a4, g.a5, g.r01, g.r11, g.r21));
  g.b5 = hn::Mul(g.s2, Dot3(g.a3, g.a4, g.a5, g.r02, g.r12, g.r22));
  return g;
}

// Σ₂ in pixels², as the Gaussian is (sharp), with the dilation (xx, yy) and with the lesser dilation that opacities
// are compensated from.
struct Covariance {
  HWY_INLINE Covariance() {}
  V xx, xy, yy, det;
  V from_xx, from_yy, from_det;
};
HWY_INLINE Covariance CovarianceOf(D d, const View& view, const Shape& g) {
  const V sharp_xx = Dot3(g.b0, g.b1, g.b2, g.b0, g.b1, g.b2), sharp_yy = Dot3(g.b3, g.b4, g.b5, g.b3, g.b4, g.b5);
  const V dilation = hn::Set(d, view.dilation), from = hn::Set(d, view.compensated_from);
  Covariance c;
  c.xy = Dot3(g.b0, g.b1, g.b2, g.b3, g.b4, g.b5);
  const V square = hn::Mul(c.xy, c.xy);
  c.xx = hn::Add(sharp_xx, dilation), c.yy = hn::Add(sharp_yy, dilation);
  c.det = hn::MulSub(c.xx, c.yy, square);
  c.from_xx = hn::Add(sharp_xx, from), c.from_yy = hn::Add(sharp_yy, from);
  c.from_det = hn::MulSub(c.from_xx, c.from_yy, square);
  return c;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#endif  // per target
