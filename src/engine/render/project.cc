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

// Positions in double: at x = 1000 px floats are too coarse.
struct Places {
  alignas(64) double x[kBatch], y[kBatch], z[kBatch];  // px, px, world units
};

template <typename T>
struct Columns {
  StoredColumns<T> stored;
  alignas(64) T drawable[kBatch];  // 1 if the mean is finite and between the planes, else 0
};

template <typename T>
struct Projection {
  alignas(64) T u_xx[kBatch], u_xy[kBatch], u_yy[kBatch];
  alignas(64) T log2_opacity[kBatch], compensation[kBatch];
  alignas(64) T tile_x0[kBatch], tile_y0[kBatch], tile_x1[kBatch], tile_y1[kBatch];  // tiles, 0 if culled
  alignas(64) T radius_x[kBatch], radius_y[kBatch];                                  // px, 0 if culled
};

// The view, with data that only the forward pass needs.
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

constexpr double kLargest = std::numeric_limits<float>::max();
template <typename T>
constexpr bool kIsFloat = sizeof(T) == sizeof(float);
template <typename T>
constexpr double kLargestDet = kIsFloat<T> ? kLargest : 1e300;
template <typename T>
constexpr double kSmallestOpacity = kIsFloat<T> ? 1e-37 : 1e-300;
template <typename T>
constexpr double kHair = kIsFloat<T> ? 1e-6 : 1e-9;  // margin against rounding: px, plus per pixel from the corner

// Projects a register of means, stored in columns of `places`.
HWY_INLINE void PlaceLanes(const Frame& frame, size_t j, Places& places, Columns<float>& c) {
  const Doubles d;
  const Narrow narrow;
  using V = hn::Vec<Doubles>;
  const View& view = frame.view;
  const V mx = hn::Load(d, places.x + j), my = hn::Load(d, places.y + j), mz = hn::Load(d, places.z + j);
  const auto row = [&](size_t k) HWY_ATTR {
    const double* r = view.r + 3 * k;
    return hn::Add(Dot3(hn::Set(d, r[0]), hn::Set(d, r[1]), hn::Set(d, r[2]), mx, my, mz), hn::Set(d, view.t[k]));
  };
  const V x = row(0), y = row(1), z = row(2), one = hn::Set(d, 1.0);
  const auto finite = [d](V a) HWY_ATTR { return hn::Le(hn::Abs(a), hn::Set(d, kLargest)); };
  const auto between = hn::And(hn::Ge(z, hn::Set(d, frame.near_plane)), hn::Le(z, hn::Set(d, frame.far_plane)));
  const auto drawable = hn::And(hn::And(finite(mx), finite(my)), hn::And(finite(mz), between));
  const V inverse_z = hn::Div(one, hn::IfThenElse(drawable, z, one));
  const V ratio_x = hn::Mul(x, inverse_z), ratio_y = hn::Mul(y, inverse_z);
  hn::Store(hn::MulAdd(hn::Set(d, view.fx), ratio_x, hn::Set(d, view.cx)), d, places.x + j);
  hn::Store(hn::MulAdd(hn::Set(d, view.fy), ratio_y, hn::Set(d, view.cy)), d, places.y + j);
  hn::Store(z, d, places.z + j);
  hn::Store(hn::DemoteTo(narrow, inverse_z), narrow, c.stored.inverse_z + j);
  hn::Store(hn::DemoteTo(narrow, ratio_x), narrow, c.stored.ratio_x + j);
  hn::Store(hn::DemoteTo(narrow, ratio_y), narrow, c.stored.ratio_y + j);
  hn::Store(hn::DemoteTo(narrow, hn::IfThenElseZero(drawable, one)), narrow, c.drawable + j);
}

// Loads Gaussians [first, first + n) into columns. Lanes beyond are finite, and their results unused.
void ReadColumns(const ProjectParams& p, const Frame& frame, int64_t first, size_t n, Places& places,
                 Columns<float>& c) {
  const Doubles d;
  const Narrow narrow;
  const size_t wide = hn::Lanes(d), whole = n / wide * wide, end = std::min(kBatch, (n + 15) / 16 * 16);
  for (size_t j = 0; j < whole; j += wide) {
    hn::Vec<Narrow> x, y, z;
    hn::LoadInterleaved3(narrow, p.means + 3 * (first + static_cast<int64_t>(j)), x, y, z);
    hn::Store(hn::PromoteTo(d, x), d, places.x + j);
    hn::Store(hn::PromoteTo(d, y), d, places.y + j);
    hn::Store(hn::PromoteTo(d, z), d, places.z + j);
  }
  for (size_t j = whole; j < end; ++j) {
    const float* mean = p.means + 3 * (first + static_cast<int64_t>(std::min(j, n - 1)));
    places.x[j] = mean[0], places.y[j] = mean[1], places.z[j] = mean[2];
  }
  for (size_t j = 0; j < end; j += wide) PlaceLanes(frame, j, places, c);
  for (size_t j = ReadWholeRegisters(p, first, n, c.stored); j < end; ++j) {
    ReadRow(p, first + static_cast<int64_t>(std::min(j, n - 1)), j, c.stored);
  }
}

// Projects a register of Gaussians, columns j … j + lanes − 1. `extreme`: unreliable results, see IsExtreme.
template <class D, typename T = hn::TFromD<D>>
HWY_INLINE hn::Mask<D> ProjectLanes(D d, const Frame& frame, RasterProfile profile, RenderMode mode,
                                    const Columns<T>& in, size_t j, Projection<T>& out) {
  using V = hn::Vec<D>;
  using M = hn::Mask<D>;
  const View& view = frame.view;
  const V zero = hn::Zero(d), one = Number(d, 1);
  const V logit = hn::Load(d, in.stored.logits + j);
  const auto stored = [&](const T* column) HWY_ATTR { return hn::Load(d, column + j); };
  const auto finite = [&](const T* column) HWY_ATTR { return hn::Le(hn::Abs(stored(column)), Number(d, kLargest)); };
  const auto fits = [&](const T* column) HWY_ATTR { return hn::Le(stored(column), Number(d, kMaxLogScale)); };
  const auto& quats = in.stored.quats;
  const auto& log_scales = in.stored.log_scales;
  M keep = hn::And(hn::And(finite(quats[0]), finite(quats[1])), hn::And(finite(quats[2]), finite(quats[3])));
  keep = hn::And(hn::And(keep, fits(log_scales[0])), hn::And(fits(log_scales[1]), fits(log_scales[2])));
  keep = hn::And(keep, hn::And(hn::Gt(stored(in.drawable), zero), hn::Eq(logit, logit)));

  const Shape<D> shape = ShapeOf(d, view, in.stored, j);
  const V px = hn::MulAdd(Number(d, view.fx), shape.ratio_x, Number(d, view.cx));
  const V py = hn::MulAdd(Number(d, view.fy), shape.ratio_y, Number(d, view.cy));
  const Covariance<V> covariance = CovarianceOf(d, view, shape);
  const V xx = covariance.xx, xy = covariance.xy, yy = covariance.yy, det = covariance.det;
  const bool compensated = IsCompensated(mode);
  const M extreme = hn::And(keep, IsExtreme(d, shape, compensated ? covariance.from_det : det));
  keep = hn::And(keep, hn::And(hn::Gt(det, zero), hn::Lt(det, Number(d, kLargestDet<T>))));  // also false for NaN
  const V safe_det = hn::IfThenElse(keep, det, one);

  // Opacity.
  V compensation = one;
  if (compensated) compensation = hn::Sqrt(hn::Div(covariance.from_det, safe_det));
  const V opacity = hn::Div(compensation, hn::Add(one, ExpInDomain(d, hn::Neg(logit))));
  // The bound keeps log inside its domain; such opacities are culled.
  const V log2_opacity =
      hn::Mul(Number(d, std::numbers::log2e), hn::Log(d, hn::Max(opacity, Number(d, kSmallestOpacity<T>))));
  const V room = hn::Sub(log2_opacity, Number(d, frame.log2_min_alpha));            // log2(opacity / min_alpha)
  const V reach2 = hn::Mul(Number(d, 2 * std::numbers::ln2), hn::Max(room, zero));  // σ² where α = min_alpha

  // Radius and square of the profile.
  V radius_x, radius_y;
  if (profile == RasterProfile::kGsplat14) {
    const V half = Number(d, 0.5), half_trace = hn::Mul(half, hn::Add(xx, yy)), slant = hn::Mul(half, hn::Sub(xx, yy));
    const V gap = hn::Max(Number(d, kMinEigenGap), hn::MulAdd(slant, slant, hn::Mul(xy, xy)));  // half_trace² − det
    const V largest = hn::Add(half_trace, hn::Sqrt(gap));
    radius_x = radius_y = hn::Ceil(hn::Mul(Number(d, kExtent14), hn::Sqrt(largest)));
  } else {
    keep = hn::And(keep, hn::Ge(room, zero));
    const V extent = hn::Min(Number(d, kExtent15), hn::Sqrt(reach2));
    radius_x = hn::Ceil(hn::Mul(extent, hn::Sqrt(xx)));
    radius_y = hn::Ceil(hn::Mul(extent, hn::Sqrt(yy)));
  }
  const V width = Number(d, frame.width), height = Number(d, frame.height);
  keep = hn::And(keep, hn::And(hn::And(hn::Gt(hn::Add(px, radius_x), zero), hn::Lt(hn::Sub(px, radius_x), width)),
                               hn::And(hn::Gt(hn::Add(py, radius_y), zero), hn::Lt(hn::Sub(py, radius_y), height))));
  hn::Store(hn::IfThenElseZero(keep, radius_x), d, out.radius_x + j);
  hn::Store(hn::IfThenElseZero(keep, radius_y), d, out.radius_y + j);
  keep = hn::And(keep, hn::Ge(room, zero));

  // Tiles of the square, intersected with those of pixel centres in the ellipse's box, with a margin against rounding.
  const V per_tile = Number(d, 1.0 / kTile), centre = Number(d, 0.5), hair = Number(d, kHair<T>);
  const V half_x = hn::Sqrt(hn::Mul(reach2, xx)), half_y = hn::Sqrt(hn::Mul(reach2, yy));
  const V margin_x = hn::MulAdd(hair, hn::Add(hn::Abs(px), half_x), hair),
          margin_y = hn::MulAdd(hair, hn::Add(hn::Abs(py), half_y), hair);
  const V box_x0 = hn::Sub(hn::Sub(hn::Sub(px, half_x), centre), margin_x),
          box_x1 = hn::Add(hn::Sub(hn::Add(px, half_x), centre), margin_x);
  const V box_y0 = hn::Sub(hn::Sub(hn::Sub(py, half_y), centre), margin_y),
          box_y1 = hn::Add(hn::Sub(hn::Add(py, half_y), centre), margin_y);
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
  const V root_yy = hn::Sqrt(yy), root_det = hn::Sqrt(safe_det), scale = Number(d, kScale);
  const V by_yy = hn::Div(scale, root_yy), by_det = hn::Div(one, root_det);
  hn::Store(hn::Mul(hn::Mul(scale, root_yy), by_det), d, out.u_xx + j);
  hn::Store(hn::Neg(hn::Mul(hn::Mul(by_yy, by_det), xy)), d, out.u_xy + j);
  hn::Store(by_yy, d, out.u_yy + j);
  hn::Store(log2_opacity, d, out.log2_opacity + j);
  hn::Store(compensation, d, out.compensation + j);
  return extreme;
}

// Recomputes column j of the batch in double.
void ProjectAgain(const ProjectParams& p, const Frame& frame, const Places& places, int64_t i, size_t j,
                  Projection<float>& out) {
  Columns<double> in;
  Projection<double> exact;
  const double z = places.z[j];
  for (size_t k = 0; k < hn::Lanes(Doubles()); ++k) {
    ReadRow(p, i, k, in.stored);
    in.stored.inverse_z[k] = 1 / z;
    in.stored.ratio_x[k] = (places.x[j] - frame.view.cx) * frame.view.inverse_fx;
    in.stored.ratio_y[k] = (places.y[j] - frame.view.cy) * frame.view.inverse_fy;
    in.drawable[k] = 1;
  }
  ProjectLanes(Doubles(), frame, p.profile, p.mode, in, 0, exact);
  const auto narrow = [j](const double* from, float* to) { to[j] = static_cast<float>(from[0]); };
  narrow(exact.u_xx, out.u_xx), narrow(exact.u_xy, out.u_xy), narrow(exact.u_yy, out.u_yy);
  narrow(exact.log2_opacity, out.log2_opacity), narrow(exact.compensation, out.compensation);
  narrow(exact.tile_x0, out.tile_x0), narrow(exact.tile_x1, out.tile_x1);
  narrow(exact.tile_y0, out.tile_y0), narrow(exact.tile_y1, out.tile_y1);
  const double widest = kLargest;
  out.radius_x[j] = static_cast<float>(std::min(exact.radius_x[0], widest));
  out.radius_y[j] = static_cast<float>(std::min(exact.radius_y[0], widest));
}

// Gaussians [first, last), at most one chunk.
void ProjectChunk(const ProjectParams& p, int64_t first, int64_t last) {
  const Frame frame = MakeFrame(p);
  Places places;
  Columns<float> in;
  Projection<float> out;
  const Floats d;
  const size_t lanes = hn::Lanes(d);
  int32_t* visible = p.visible + first;
  int32_t found = 0;
  int64_t slots = 0;
  for (int64_t begin = first; begin < last; begin += static_cast<int64_t>(kBatch)) {
    const size_t n = static_cast<size_t>(std::min<int64_t>(kBatch, last - begin));
    ReadColumns(p, frame, begin, n, places, in);
    for (size_t j = 0; j < n; j += lanes) {
      const auto extreme = ProjectLanes(d, frame, p.profile, p.mode, in, j, out);
      if (hn::AllFalse(d, extreme)) continue;
      alignas(64) float again[kLanesAtMost];
      hn::Store(hn::IfThenElseZero(extreme, hn::Set(d, 1.0f)), d, again);
      for (size_t k = 0; k < lanes && j + k < n; ++k) {
        if (again[k] != 0) ProjectAgain(p, frame, places, begin + static_cast<int64_t>(j + k), j + k, out);
      }
    }
    for (size_t j = 0; j < n; ++j) {
      const int64_t i = begin + static_cast<int64_t>(j);
      if (p.radii != nullptr) {
        constexpr float kLargestRadius = 2147483520.0f;  // largest float that fits an int32
        p.radii[2 * i] = static_cast<int32_t>(std::min(out.radius_x[j], kLargestRadius));
        p.radii[2 * i + 1] = static_cast<int32_t>(std::min(out.radius_y[j], kLargestRadius));
      }
      const auto tile = [](float t) { return static_cast<uint16_t>(static_cast<int32_t>(t)); };
      const TileRect rect = {tile(out.tile_x0[j]), tile(out.tile_y0[j]), tile(out.tile_x1[j]), tile(out.tile_y1[j])};
      p.tiles[i] = rect;
      if (rect.x1 == 0) continue;
      ProjectedGaussian& g = p.projected[i];
      g.x = places.x[j];
      g.y = places.y[j];
      g.u_xx = out.u_xx[j];
      g.u_xy = out.u_xy[j];
      g.u_yy = out.u_yy[j];
      g.log2_opacity = out.log2_opacity[j];
      g.depth = static_cast<float>(places.z[j]);
      g.compensation = out.compensation[j];
      g.slot = static_cast<int32_t>(slots);
      g.tile_x0 = rect.x0;
      g.tile_y0 = rect.y0;
      g.tiles_across = static_cast<uint16_t>(rect.x1 - rect.x0);
      slots += int64_t{g.tiles_across} * (rect.y1 - rect.y0);
      visible[found++] = static_cast<int32_t>(i);
    }
  }
  p.visible_counts[first / kProjectChunk] = found;
  if (p.slot_counts != nullptr) p.slot_counts[first / kProjectChunk] = slots;
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
