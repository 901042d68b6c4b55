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
#include "render/projection-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {
namespace {

struct Projection {
  alignas(64) double x[kBatch], y[kBatch], z[kBatch];
  alignas(64) double u_xx[kBatch], u_xy[kBatch], u_yy[kBatch];
  alignas(64) double log2_opacity[kBatch], compensation[kBatch];
  alignas(64) double tile_x0[kBatch], tile_y0[kBatch], tile_x1[kBatch], tile_y1[kBatch];  // tiles, 0 where culled
  alignas(64) double radius_x[kBatch], radius_y[kBatch];                                  // px, 0 where culled
};

// The view, and what only this direction needs of it.
struct Frame {
  View view;
  double width, height;  // px
  double tiles_x, tiles_y;
  double near_plane, far_plane;
  double log2_min_alpha;
};

Frame MakeFrame(const ProjectParams& p) {
  return {.view = MakeView(p),
          .width = static_cast<double>(p.intrinsics.width),
          .height = static_cast<double>(p.intrinsics.height),
          .tiles_x = static_cast<double>(TilesAcross(p.intrinsics.width)),
          .tiles_y = static_cast<double>(TilesAcross(p.intrinsics.height)),
          .near_plane = p.near_plane,
          .far_plane = p.far_plane,
          .log2_min_alpha = std::log2(double{p.min_alpha})};
}

void ReadColumns(const ProjectParams& p, int64_t first, size_t n, StoredColumns& c) {
  for (size_t j = ReadWholeRegisters(p, first, n, c); j < n; ++j) {
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

// One register of Gaussians, columns j … j + lanes − 1.
HWY_INLINE void ProjectLanes(const Frame& frame, RasterProfile profile, RenderMode mode, const StoredColumns& in,
                             size_t j, Projection& out) {
  const D d;
  const View& view = frame.view;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0);
  const V mx = hn::Load(d, in.means[0] + j), my = hn::Load(d, in.means[1] + j), mz = hn::Load(d, in.means[2] + j);
  const V ls0 = hn::Load(d, in.log_scales[0] + j), ls1 = hn::Load(d, in.log_scales[1] + j),
          ls2 = hn::Load(d, in.log_scales[2] + j);
  const V qw = hn::Load(d, in.quats[0] + j), qx = hn::Load(d, in.quats[1] + j), qy = hn::Load(d, in.quats[2] + j),
          qz = hn::Load(d, in.quats[3] + j);
  const V logit = hn::Load(d, in.logits + j);

  V usable = hn::Mul(hn::Mul(Finite(d, mx), Finite(d, my)), Finite(d, mz));
  usable = hn::Mul(usable, hn::Mul(hn::Mul(Finite(d, qw), Finite(d, qx)), hn::Mul(Finite(d, qy), Finite(d, qz))));
  usable = hn::Mul(usable, hn::Mul(NotPositiveInfinity(d, ls0), NotPositiveInfinity(d, ls1)));
  usable = hn::Mul(usable, hn::Mul(NotPositiveInfinity(d, ls2), IsNumber(d, logit)));

  const V x = CameraSpace(d, view, in, j, 0), y = CameraSpace(d, view, in, j, 1), z = CameraSpace(d, view, in, j, 2);
  M keep = hn::And(hn::Gt(usable, zero),
                   hn::And(hn::Ge(z, hn::Set(d, frame.near_plane)), hn::Le(z, hn::Set(d, frame.far_plane))));
  const Shape shape = ShapeOf(d, view, in, j, x, y, hn::IfThenElse(keep, z, one));
  const V px = hn::MulAdd(hn::Set(d, view.fx), shape.ratio_x, hn::Set(d, view.cx));
  const V py = hn::MulAdd(hn::Set(d, view.fy), shape.ratio_y, hn::Set(d, view.cy));
  const Covariance covariance = CovarianceOf(d, view, shape);
  const V xx = covariance.xx, xy = covariance.xy, yy = covariance.yy, det = covariance.det;
  keep = hn::And(keep, hn::And(hn::Gt(det, zero), hn::Lt(det, hn::Set(d, 1e300))));  // false for NaN, too
  const V safe_det = hn::IfThenElse(keep, det, one);

  // Opacity.
  V compensation = one;
  if (IsCompensated(mode)) {
    const V kept_det = hn::Max(zero, covariance.from_det);
    compensation = hn::Sqrt(hn::Div(kept_det, safe_det));
  }
  const V opacity = hn::Div(compensation, hn::Add(one, ExpInDomain(d, hn::Neg(logit))));
  const V log2_opacity =  // the bound keeps log inside its domain; such an opacity is culled
      hn::Mul(hn::Set(d, std::numbers::log2e), hn::Log(d, hn::Max(opacity, hn::Set(d, 1e-300))));
  const V room = hn::Sub(log2_opacity, hn::Set(d, frame.log2_min_alpha));            // log2(opacity / min_alpha)
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
  const V width = hn::Set(d, frame.width), height = hn::Set(d, frame.height);
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
  const V cut_x0 = Clamped(d, x0, 0, frame.tiles_x), cut_x1 = Clamped(d, x1, 0, frame.tiles_x);
  const V cut_y0 = Clamped(d, y0, 0, frame.tiles_y), cut_y1 = Clamped(d, y1, 0, frame.tiles_y);
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
  const Frame frame = MakeFrame(p);
  StoredColumns in;
  Projection out;
  const size_t lanes = hn::Lanes(D());
  int32_t* visible = p.visible + first;
  int32_t found = 0;
  for (int64_t begin = first; begin < last; begin += static_cast<int64_t>(kBatch)) {
    const size_t n = static_cast<size_t>(std::min<int64_t>(kBatch, last - begin));
    ReadColumns(p, begin, n, in);
    for (size_t j = 0; j < n; j += lanes) ProjectLanes(frame, p.profile, p.mode, in, j, out);
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
