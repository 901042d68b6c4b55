#include "render/project.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/parallel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/project.cc"
// foreach_target compiles this file once per instruction set, so it must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>
// clang-format on

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

struct Columns {
  alignas(64) double means[3][kBatch];
  alignas(64) double log_scales[3][kBatch];
  alignas(64) double quats[4][kBatch];
  alignas(64) double logits[kBatch];
};

struct Projection {
  alignas(64) double x[kBatch], y[kBatch], z[kBatch];
  alignas(64) double u_xx[kBatch], u_xy[kBatch], u_yy[kBatch];
  alignas(64) double log2_opacity[kBatch], compensation[kBatch];
  alignas(64) double tile_x0[kBatch], tile_y0[kBatch], tile_x1[kBatch], tile_y1[kBatch];  // tiles, 0 where culled
  alignas(64) double radius_x[kBatch], radius_y[kBatch];                                  // px, 0 where culled
};

// What does not depend on the Gaussian.
struct View {
  double r[9], t[3];
  double fx, fy, cx, cy;
  double left, right, up, down;  // limits of x/z and y/z in the Jacobian
  double width, height;          // px
  double tiles_x, tiles_y;
  double near_plane, far_plane, dilation, compensated_from;
  double log2_min_alpha;
};

View MakeView(const ProjectParams& p) {
  View v;
  std::copy(p.world_to_camera.rotation.begin(), p.world_to_camera.rotation.end(), v.r);
  std::copy(p.world_to_camera.translation.begin(), p.world_to_camera.translation.end(), v.t);
  const Pinhole& k = p.intrinsics;
  v.fx = k.fx, v.fy = k.fy, v.cx = k.cx, v.cy = k.cy;
  v.width = k.width, v.height = k.height;
  const double margin_x = double{kFrustumMargin} * 0.5 * k.width / k.fx;
  const double margin_y = double{kFrustumMargin} * 0.5 * k.height / k.fy;
  v.left = -(k.cx / k.fx + margin_x);
  v.right = (k.width - k.cx) / k.fx + margin_x;
  v.up = -(k.cy / k.fy + margin_y);
  v.down = (k.height - k.cy) / k.fy + margin_y;
  v.tiles_x = TilesAcross(k.width);
  v.tiles_y = TilesAcross(k.height);
  v.near_plane = p.near_plane, v.far_plane = p.far_plane, v.dilation = p.dilation;
  v.compensated_from = p.compensated_from;
  v.log2_min_alpha = std::log2(double{p.min_alpha});
  return v;
}

void ReadColumns(const ProjectParams& p, int64_t first, size_t n, Columns& c) {
  for (size_t j = 0; j < n; ++j) {
    const int64_t i = first + static_cast<int64_t>(j);
    for (int a = 0; a < 3; ++a) c.means[a][j] = p.means[3 * i + a];
    for (int a = 0; a < 3; ++a) c.log_scales[a][j] = p.log_scales[3 * i + a];
    for (int a = 0; a < 4; ++a) c.quats[a][j] = p.quats[4 * i + a];
    c.logits[j] = p.opacity_logits[i];
  }
  // Lanes after the last Gaussian: any finite value will do, their results are not read.
  const size_t end = std::min(kBatch, (n + 7) / 8 * 8);
  for (size_t j = n; j < end; ++j) {
    for (int a = 0; a < 3; ++a) c.means[a][j] = c.log_scales[a][j] = 0;
    for (int a = 0; a < 4; ++a) c.quats[a][j] = 0;
    c.logits[j] = 0;
  }
}

HWY_INLINE V Finite(D d, V x) {  // 1 or 0 per lane; as a vector so that conditions multiply
  return hn::IfThenElseZero(hn::Le(hn::Abs(x), hn::Set(d, double{std::numeric_limits<float>::max()})), hn::Set(d, 1.0));
}
HWY_INLINE V NotPositiveInfinity(D d, V x) {
  return hn::IfThenElseZero(hn::Le(x, hn::Set(d, double{std::numeric_limits<float>::max()})), hn::Set(d, 1.0));
}

HWY_INLINE V IsNumber(D d, V x) { return hn::IfThenElseZero(hn::Eq(x, x), hn::Set(d, 1.0)); }

HWY_INLINE V Dot3(V a0, V a1, V a2, V b0, V b1, V b2) {
  return hn::MulAdd(a0, b0, hn::MulAdd(a1, b1, hn::Mul(a2, b2)));
}

HWY_INLINE V Clamped(D d, V x, double low, double high) {
  return hn::Min(hn::Max(x, hn::Set(d, low)), hn::Set(d, high));
}

// One register of Gaussians, columns j … j + lanes − 1.
HWY_INLINE void ProjectLanes(const View& view, RasterProfile profile, RenderMode mode, const Columns& in, size_t j,
                             Projection& out) {
  const D d;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0);
  const V mx = hn::Load(d, in.means[0] + j), my = hn::Load(d, in.means[1] + j), mz = hn::Load(d, in.means[2] + j);
  const V ls0 = hn::Load(d, in.log_scales[0] + j), ls1 = hn::Load(d, in.log_scales[1] + j),
          ls2 = hn::Load(d, in.log_scales[2] + j);
  V qw = hn::Load(d, in.quats[0] + j), qx = hn::Load(d, in.quats[1] + j), qy = hn::Load(d, in.quats[2] + j),
    qz = hn::Load(d, in.quats[3] + j);
  const V logit = hn::Load(d, in.logits + j);

  V usable = hn::Mul(hn::Mul(Finite(d, mx), Finite(d, my)), Finite(d, mz));
  usable = hn::Mul(usable, hn::Mul(hn::Mul(Finite(d, qw), Finite(d, qx)), hn::Mul(Finite(d, qy), Finite(d, qz))));
  usable = hn::Mul(usable, hn::Mul(NotPositiveInfinity(d, ls0), NotPositiveInfinity(d, ls1)));
  usable = hn::Mul(usable, hn::Mul(NotPositiveInfinity(d, ls2), IsNumber(d, logit)));

  // Camera space.
  const double* r = view.r;
  const V z = hn::Add(Dot3(hn::Set(d, r[6]), hn::Set(d, r[7]), hn::Set(d, r[8]), mx, my, mz), hn::Set(d, view.t[2]));
  const V x = hn::Add(Dot3(hn::Set(d, r[0]), hn::Set(d, r[1]), hn::Set(d, r[2]), mx, my, mz), hn::Set(d, view.t[0]));
  const V y = hn::Add(Dot3(hn::Set(d, r[3]), hn::Set(d, r[4]), hn::Set(d, r[5]), mx, my, mz), hn::Set(d, view.t[1]));
  M keep = hn::And(hn::Gt(usable, zero),
                   hn::And(hn::Ge(z, hn::Set(d, view.near_plane)), hn::Le(z, hn::Set(d, view.far_plane))));
  const V safe_z = hn::IfThenElse(keep, z, one);
  const V inverse_z = hn::Div(one, safe_z);
  const V ratio_x = hn::Mul(x, inverse_z), ratio_y = hn::Mul(y, inverse_z);
  const V px = hn::MulAdd(hn::Set(d, view.fx), ratio_x, hn::Set(d, view.cx));
  const V py = hn::MulAdd(hn::Set(d, view.fy), ratio_y, hn::Set(d, view.cy));

  // Rotation and scale.
  const V norm2 = hn::Add(Dot3(qw, qx, qy, qw, qx, qy), hn::Mul(qz, qz));
  const M zero_quat = hn::Eq(norm2, zero);
  const V inverse_norm = hn::IfThenElse(zero_quat, one, hn::Div(one, hn::Sqrt(norm2)));
  qw = hn::IfThenElse(zero_quat, one, hn::Mul(qw, inverse_norm));
  qx = hn::Mul(qx, inverse_norm), qy = hn::Mul(qy, inverse_norm), qz = hn::Mul(qz, inverse_norm);
  const V two = hn::Set(d, 2.0);
  const V x2 = hn::Mul(two, qx), y2 = hn::Mul(two, qy), z2 = hn::Mul(two, qz);
  const V r00 = hn::NegMulAdd(y2, qy, hn::NegMulAdd(z2, qz, one)), r01 = hn::MulSub(x2, qy, hn::Mul(z2, qw)),
          r02 = hn::MulAdd(x2, qz, hn::Mul(y2, qw));
  const V r10 = hn::MulAdd(x2, qy, hn::Mul(z2, qw)), r11 = hn::NegMulAdd(x2, qx, hn::NegMulAdd(z2, qz, one)),
          r12 = hn::MulSub(y2, qz, hn::Mul(x2, qw));
  const V r20 = hn::MulSub(x2, qz, hn::Mul(y2, qw)), r21 = hn::MulAdd(y2, qz, hn::Mul(x2, qw)),
          r22 = hn::NegMulAdd(x2, qx, hn::NegMulAdd(y2, qy, one));
  // Above ln(1e300) the covariance is infinite and culled below; the bound only keeps exp inside its domain.
  const V top = hn::Set(d, 690.0);
  const V s0 = hn::Exp(d, hn::Min(ls0, top)), s1 = hn::Exp(d, hn::Min(ls1, top)), s2 = hn::Exp(d, hn::Min(ls2, top));

  // A = J·R (rows for image x and y), B = A·R_q·S, Σ₂ = B·Bᵀ.
  const V u = Clamped(d, ratio_x, view.left, view.right), v = Clamped(d, ratio_y, view.up, view.down);
  const V focal_x = hn::Mul(hn::Set(d, view.fx), inverse_z), focal_y = hn::Mul(hn::Set(d, view.fy), inverse_z);
  const V a0 = hn::Mul(focal_x, hn::NegMulAdd(u, hn::Set(d, r[6]), hn::Set(d, r[0]))),
          a1 = hn::Mul(focal_x, hn::NegMulAdd(u, hn::Set(d, r[7]), hn::Set(d, r[1]))),
          a2 = hn::Mul(focal_x, hn::NegMulAdd(u, hn::Set(d, r[8]), hn::Set(d, r[2])));
  const V a3 = hn::Mul(focal_y, hn::NegMulAdd(v, hn::Set(d, r[6]), hn::Set(d, r[3]))),
          a4 = hn::Mul(focal_y, hn::NegMulAdd(v, hn::Set(d, r[7]), hn::Set(d, r[4]))),
          a5 = hn::Mul(focal_y, hn::NegMulAdd(v, hn::Set(d, r[8]), hn::Set(d, r[5])));
  const V b0 = hn::Mul(s0, Dot3(a0, a1, a2, r00, r10, r20)), b1 = hn::Mul(s1, Dot3(a0, a1, a2, r01, r11, r21)),
          b2 = hn::Mul(s2, Dot3(a0, a1, a2, r02, r12, r22));
  const V b3 = hn::Mul(s0, Dot3(a3, a4, a5, r00, r10, r20)), b4 = hn::Mul(s1, Dot3(a3, a4, a5, r01, r11, r21)),
          b5 = hn::Mul(s2, Dot3(a3, a4, a5, r02, r12, r22));
  const V sharp_xx = Dot3(b0, b1, b2, b0, b1, b2), xy = Dot3(b0, b1, b2, b3, b4, b5),
          sharp_yy = Dot3(b3, b4, b5, b3, b4, b5);
  const V dilation = hn::Set(d, view.dilation);
  const V xx = hn::Add(sharp_xx, dilation), yy = hn::Add(sharp_yy, dilation);
  const V det = hn::MulSub(xx, yy, hn::Mul(xy, xy));
  keep = hn::And(keep, hn::And(hn::Gt(det, zero), hn::Lt(det, hn::Set(d, 1e300))));  // false for NaN, too
  const V safe_det = hn::IfThenElse(keep, det, one);

  // Opacity.
  V compensation = one;
  if (mode == RenderMode::kAntialiased) {
    const V from = hn::Set(d, view.compensated_from);
    const V kept_det = hn::Max(zero, hn::MulSub(hn::Add(sharp_xx, from), hn::Add(sharp_yy, from), hn::Mul(xy, xy)));
    compensation = hn::Sqrt(hn::Div(kept_det, safe_det));
  }
  const V opacity = hn::Div(compensation, hn::Add(one, hn::Exp(d, hn::Min(hn::Neg(logit), top))));
  const V log2_opacity =  // the bound keeps log inside its domain; such an opacity is culled
      hn::Mul(hn::Set(d, std::numbers::log2e), hn::Log(d, hn::Max(opacity, hn::Set(d, 1e-300))));
  const V room = hn::Sub(log2_opacity, hn::Set(d, view.log2_min_alpha));             // log2(opacity / min_alpha)
  const V reach2 = hn::Mul(hn::Set(d, 2 * std::numbers::ln2), hn::Max(room, zero));  // σ² where α = min_alpha

  // Radius and square of the profile.
  V radius_x, radius_y;
  if (profile == RasterProfile::kGsplat14) {
    const V half_trace = hn::Mul(hn::Set(d, 0.5), hn::Add(xx, yy));
    const V gap = hn::Max(hn::Set(d, kMinEigenGap), hn::MulSub(half_trace, half_trace, det));
    const V largest = hn::Add(half_trace, hn::Sqrt(gap));
    radius_x = radius_y = hn::Ceil(hn::Mul(hn::Set(d, kExtent14), hn::Sqrt(largest)));
  } else {
    keep = hn::And(keep, hn::Ge(room, zero));
    const V extent = hn::Min(hn::Set(d, kExtent15), hn::Sqrt(reach2));
    radius_x = hn::Ceil(hn::Mul(extent, hn::Sqrt(xx)));
    radius_y = hn::Ceil(hn::Mul(extent, hn::Sqrt(yy)));
  }
  const V width = hn::Set(d, view.width), height = hn::Set(d, view.height);
  keep = hn::And(keep, hn::And(hn::And(hn::Gt(hn::Add(px, radius_x), zero), hn::Lt(hn::Sub(px, radius_x), width)),
                               hn::And(hn::Gt(hn::Add(py, radius_y), zero), hn::Lt(hn::Sub(py, radius_y), height))));
  hn::Store(hn::IfThenElseZero(keep, radius_x), d, out.radius_x + j);
  hn::Store(hn::IfThenElseZero(keep, radius_y), d, out.radius_y + j);
  keep = hn::And(keep, hn::Ge(room, zero));

  // Tiles of the square, and those of the pixel centres within the ellipse's box; a hair more against rounding.
  const V per_tile = hn::Set(d, 1.0 / kTile), hair = hn::Set(d, 1e-6);
  const V half_x = hn::Sqrt(hn::Mul(reach2, xx)), half_y = hn::Sqrt(hn::Mul(reach2, yy));
  const V centre = hn::Set(d, 0.5);
  const V box_x0 = hn::Sub(hn::Sub(hn::Sub(px, half_x), centre), hair),
          box_x1 = hn::Add(hn::Sub(hn::Add(px, half_x), centre), hair);
  const V box_y0 = hn::Sub(hn::Sub(hn::Sub(py, half_y), centre), hair),
          box_y1 = hn::Add(hn::Sub(hn::Add(py, half_y), centre), hair);
  const V x0 = hn::Max(hn::Floor(hn::Mul(hn::Sub(px, radius_x), per_tile)), hn::Floor(hn::Mul(box_x0, per_tile)));
  const V y0 = hn::Max(hn::Floor(hn::Mul(hn::Sub(py, radius_y), per_tile)), hn::Floor(hn::Mul(box_y0, per_tile)));
  const V x1 =
      hn::Min(hn::Ceil(hn::Mul(hn::Add(px, radius_x), per_tile)), hn::Add(hn::Floor(hn::Mul(box_x1, per_tile)), one));
  const V y1 =
      hn::Min(hn::Ceil(hn::Mul(hn::Add(py, radius_y), per_tile)), hn::Add(hn::Floor(hn::Mul(box_y1, per_tile)), one));
  const V cut_x0 = Clamped(d, x0, 0, view.tiles_x), cut_x1 = Clamped(d, x1, 0, view.tiles_x);
  const V cut_y0 = Clamped(d, y0, 0, view.tiles_y), cut_y1 = Clamped(d, y1, 0, view.tiles_y);
  keep = hn::And(keep, hn::And(hn::Lt(cut_x0, cut_x1), hn::Lt(cut_y0, cut_y1)));
  hn::Store(hn::IfThenElseZero(keep, cut_x0), d, out.tile_x0 + j);
  hn::Store(hn::IfThenElseZero(keep, cut_x1), d, out.tile_x1 + j);
  hn::Store(hn::IfThenElseZero(keep, cut_y0), d, out.tile_y0 + j);
  hn::Store(hn::IfThenElseZero(keep, cut_y1), d, out.tile_y1 + j);

  // The conic's Cholesky factor; see ProjectedGaussian.
  constexpr double kScale = 0.84932180028801904;  // sqrt(½·log2 e)
  const V root_yy = hn::Sqrt(yy), root_det = hn::Sqrt(safe_det);
  hn::Store(hn::Div(hn::Mul(hn::Set(d, kScale), root_yy), root_det), d, out.u_xx + j);
  hn::Store(hn::Div(hn::Mul(hn::Set(d, -kScale), xy), hn::Mul(root_yy, root_det)), d, out.u_xy + j);
  hn::Store(hn::Div(hn::Set(d, kScale), root_yy), d, out.u_yy + j);
  hn::Store(px, d, out.x + j);
  hn::Store(py, d, out.y + j);
  hn::Store(z, d, out.z + j);
  hn::Store(log2_opacity, d, out.log2_opacity + j);
  hn::Store(compensation, d, out.compensation + j);
}

// Gaussians [first, last): at most one chunk.
void ProjectChunk(const ProjectParams& p, int64_t first, int64_t last) {
  const View view = MakeView(p);
  Columns in;
  Projection out;
  const size_t lanes = hn::Lanes(D());
  int32_t* visible = p.visible + first;
  int32_t found = 0;
  for (int64_t begin = first; begin < last; begin += static_cast<int64_t>(kBatch)) {
    const size_t n = static_cast<size_t>(std::min<int64_t>(kBatch, last - begin));
    ReadColumns(p, begin, n, in);
    for (size_t j = 0; j < n; j += lanes) ProjectLanes(view, p.profile, p.mode, in, j, out);
    for (size_t j = 0; j < n; ++j) {
      const int64_t i = begin + static_cast<int64_t>(j);
      if (p.radii != nullptr) {
        constexpr double kLargest = std::numeric_limits<int32_t>::max();
        p.radii[2 * i] = static_cast<int32_t>(std::min(out.radius_x[j], kLargest));
        p.radii[2 * i + 1] = static_cast<int32_t>(std::min(out.radius_y[j], kLargest));
      }
      const auto tile = [](double t) { return static_cast<uint16_t>(static_cast<int32_t>(t)); };
      const TileRect rect = {tile(out.tile_x0[j]), tile(out.tile_y0[j]), tile(out.tile_x1[j]), tile(out.tile_y1[j])};
      p.tiles[i] = rect;
      if (rect.x1 == 0) continue;
      ProjectedGaussian& g = p.projected[i];
      g.x = out.x[j];
      g.y = out.y[j];
      g.u_xx = static_cast<float>(out.u_xx[j]);
      g.u_xy = static_cast<float>(out.u_xy[j]);
      g.u_yy = static_cast<float>(out.u_yy[j]);
      g.log2_opacity = static_cast<float>(out.log2_opacity[j]);
      g.depth = static_cast<float>(out.z[j]);
      g.compensation = static_cast<float>(out.compensation[j]);
      visible[found++] = static_cast<int32_t>(i);
    }
  }
  p.visible_counts[first / kProjectChunk] = found;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(ProjectChunk);

void ProjectCpu(const ProjectParams& p) {
  ParallelFor(0, p.count, kProjectChunk, [&p](int64_t first, int64_t last) {
    HWY_DYNAMIC_DISPATCH(ProjectChunk)(p, first, last);
  });
}

}  // namespace anchorsplat
#endif
