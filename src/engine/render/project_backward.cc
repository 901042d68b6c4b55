#include "render/project_backward.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "render/project.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/project_backward.cc"
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

constexpr size_t kAhead = 24;  // prefetch distance in Gaussians: rows are large and not all are needed

template <typename T>
struct Columns {
  StoredColumns<T> stored;
  alignas(64) T u_xx[kBatch], u_xy[kBatch], u_yy[kBatch];
  alignas(64) T q[kBatch], qu[kBatch], qv[kBatch], quu[kBatch], quv[kBatch], qvv[kBatch];
};

template <typename T>
struct Gradients {
  alignas(64) T means[3][kBatch];
  alignas(64) T log_scales[3][kBatch];
  alignas(64) T quats[4][kBatch];
  alignas(64) T logits[kBatch];
  alignas(64) T means2d[2][kBatch];
};

// Derived values of Gaussian i.
template <typename T>
HWY_INLINE void ReadRecord(const ProjectBackwardParams& p, const View& view, int64_t i, size_t j, Columns<T>& c) {
  const ProjectedGaussian& g = p.projected[i];
  c.stored.inverse_z[j] = 1 / T{g.depth};
  c.stored.ratio_x[j] = static_cast<T>((g.x - view.cx) * view.inverse_fx);
  c.stored.ratio_y[j] = static_cast<T>((g.y - view.cy) * view.inverse_fy);
  c.u_xx[j] = g.u_xx;
  c.u_xy[j] = g.u_xy;
  c.u_yy[j] = g.u_yy;
  const BlendGradient& b = p.gradients[i];
  c.q[j] = b.q;
  c.qu[j] = b.qu;
  c.qv[j] = b.qv;
  c.quu[j] = b.quu;
  c.quv[j] = b.quv;
  c.qvv[j] = b.qvv;
}

// `contiguous`: rows are consecutive.
void ReadColumns(const ProjectBackwardParams& p, const View& view, const int32_t* rows, size_t n, bool contiguous,
                 Columns<float>& c) {
  // The last register is padded with one that is not written.
  const size_t end = std::min(kBatch, (n + kLanesAtMost - 1) / kLanesAtMost * kLanesAtMost);
  for (size_t j = contiguous ? ReadWholeRegisters(p, rows[0], n, c.stored) : 0; j < end; ++j) {
    ReadRow(p, rows[std::min(j, n - 1)], j, c.stored);
  }
  for (size_t j = 0; j < end; ++j) ReadRecord(p, view, rows[std::min(j, n - 1)], j, c);
}

// Gradients for a register of Gaussians, columns j … j + lanes − 1: ProjectCpu's computation in reverse; g_x is ∂L/∂x.
// Returns the unreliable ones, see IsExtreme.
template <class D, typename T = hn::TFromD<D>>
HWY_INLINE hn::Mask<D> BackwardLanes(D d, const View& view, bool compensated, const Columns<T>& in, size_t j,
                                     Gradients<T>& out) {
  using V = hn::Vec<D>;
  const V zero = hn::Zero(d), one = Number(d, 1), two = Number(d, 2);
  const auto load = [&](const T* column) HWY_ATTR { return hn::Load(d, column + j); };
  const auto store = [&](V value, T* column) HWY_ATTR { hn::Store(value, d, column + j); };
  const Shape<D> shape = ShapeOf(d, view, in.stored, j);
  const auto& [inverse_z, ratio_x, ratio_y, focal_x, focal_y, u, v, qw, qx, qy, qz, norm2, inverse_norm, zero_quat, r00,
               r01, r02, r10, r11, r12, r20, r21, r22, s0, s1, s2, a0, a1, a2, a3, a4, a5, b0, b1, b2, b3, b4, b5] =
      shape;

  // ln α = ln o − ½ dᵀΣ₂⁻¹d, and with W the factor that gives (u, v) = W·d, Σ₂⁻¹ = 2 ln 2·WᵀW. So
  //   ∂L/∂mean2d = Σ q·Σ₂⁻¹d = 2 ln 2·Wᵀ Σ q·(u, v),   ∂L/∂Σ₂ = ½ Σ q·Σ₂⁻¹d dᵀΣ₂⁻¹ = 2 ln²2·Wᵀ(Σ q·(u, v)(u, v)ᵀ)W.
  constexpr double kTwoLn2 = 2 * std::numbers::ln2, kFourLn2Squared = 4 * std::numbers::ln2 * std::numbers::ln2;
  const V w_xx = load(in.u_xx), w_xy = load(in.u_xy), w_yy = load(in.u_yy);
  const V q = load(in.q), qu = load(in.qu), qv = load(in.qv);
  const V g_px = hn::Mul(Number(d, kTwoLn2), hn::Mul(w_xx, qu));
  const V g_py = hn::Mul(Number(d, kTwoLn2), hn::MulAdd(w_xy, qu, hn::Mul(w_yy, qv)));
  store(g_px, out.means2d[0]);
  store(g_py, out.means2d[1]);

  // ∂L/∂B = 2·∂L/∂Σ₂·B = Wᵀ·M with M = 4 ln²2·(Σ q·(u, v)(u, v)ᵀ)·(W·B). Everything except W has the magnitude of its
  // inputs for any shape. The log-scales' gradient, the diagonal of Bᵀ·∂L/∂B = (W·B)ᵀ·M, does not need W again.
  const V scale = Number(d, kFourLn2Squared);
  const V quu = hn::Mul(scale, load(in.quu)), quv = hn::Mul(scale, load(in.quv)), qvv = hn::Mul(scale, load(in.qvv));
  const V x0 = DifferenceOfProducts(w_xx, b0, hn::Neg(w_xy), b3), y0 = hn::Mul(w_yy, b3);
  const V x1 = DifferenceOfProducts(w_xx, b1, hn::Neg(w_xy), b4), y1 = hn::Mul(w_yy, b4);
  const V x2 = DifferenceOfProducts(w_xx, b2, hn::Neg(w_xy), b5), y2 = hn::Mul(w_yy, b5);
  const V m0 = hn::MulAdd(quu, x0, hn::Mul(quv, y0)), m3 = hn::MulAdd(quv, x0, hn::Mul(qvv, y0));
  const V m1 = hn::MulAdd(quu, x1, hn::Mul(quv, y1)), m4 = hn::MulAdd(quv, x1, hn::Mul(qvv, y1));
  const V m2 = hn::MulAdd(quu, x2, hn::Mul(quv, y2)), m5 = hn::MulAdd(quv, x2, hn::Mul(qvv, y2));
  V g_s0 = hn::MulAdd(m0, x0, hn::Mul(m3, y0)), g_s1 = hn::MulAdd(m1, x1, hn::Mul(m4, y1)),
    g_s2 = hn::MulAdd(m2, x2, hn::Mul(m5, y2));
  V g_b0 = hn::Mul(w_xx, m0), g_b3 = hn::MulAdd(w_xy, m0, hn::Mul(w_yy, m3));
  V g_b1 = hn::Mul(w_xx, m1), g_b4 = hn::MulAdd(w_xy, m1, hn::Mul(w_yy, m4));
  V g_b2 = hn::Mul(w_xx, m2), g_b5 = hn::MulAdd(w_xy, m2, hn::Mul(w_yy, m5));
  V lowest = one;  // smallest determinant divided by
  if (compensated) {
    // o = sigmoid·sqrt(det Σ_from / det Σ₂), Σ_from with the lesser dilation:  ∂ln o/∂Σ = ½ (Σ_from⁻¹ − Σ₂⁻¹), and
    // again ∂/∂B is twice that times B.
    const auto covariance = CovarianceOf(d, view, shape);
    const auto& [xx, xy, yy, det, from_xx, from_yy, from_det] = covariance;
    lowest = from_det;
    // If the determinant is 0, so is the opacity, and the Gaussian was culled.
    const V by_from = hn::IfThenElseZero(hn::Gt(from_det, zero), hn::Div(q, from_det)), by_det = hn::Div(q, det);
    const V c_xx = hn::MulSub(by_from, from_yy, hn::Mul(by_det, yy)),
            c_yy = hn::MulSub(by_from, from_xx, hn::Mul(by_det, xx)), c_xy = hn::Mul(hn::Sub(by_det, by_from), xy);
    const auto add = [&](V b_x, V b_y, V& g_x, V& g_y, V& g_s) HWY_ATTR {
      const V more_x = hn::MulAdd(c_xx, b_x, hn::Mul(c_xy, b_y)), more_y = hn::MulAdd(c_xy, b_x, hn::Mul(c_yy, b_y));
      g_x = hn::Add(g_x, more_x), g_y = hn::Add(g_y, more_y);
      g_s = hn::MulAdd(more_x, b_x, hn::MulAdd(more_y, b_y, g_s));
    };
    add(b0, b3, g_b0, g_b3, g_s0);
    add(b1, b4, g_b1, g_b4, g_s1);
    add(b2, b5, g_b2, g_b5, g_s2);
  }

  // Scales; ∂L/∂E.
  store(g_s0, out.log_scales[0]);
  store(g_s1, out.log_scales[1]);
  store(g_s2, out.log_scales[2]);
  const V e0 = hn::Mul(g_b0, s0), e1 = hn::Mul(g_b1, s1), e2 = hn::Mul(g_b2, s2);
  const V e3 = hn::Mul(g_b3, s0), e4 = hn::Mul(g_b4, s1), e5 = hn::Mul(g_b5, s2);

  // ∂L/∂R_q = Aᵀ·∂L/∂E, then the quaternion: first as if its norm were 1, then along the sphere.
  const V g00 = hn::MulAdd(a0, e0, hn::Mul(a3, e3)), g01 = hn::MulAdd(a0, e1, hn::Mul(a3, e4)),
          g02 = hn::MulAdd(a0, e2, hn::Mul(a3, e5));
  const V g10 = hn::MulAdd(a1, e0, hn::Mul(a4, e3)), g11 = hn::MulAdd(a1, e1, hn::Mul(a4, e4)),
          g12 = hn::MulAdd(a1, e2, hn::Mul(a4, e5));
  const V g20 = hn::MulAdd(a2, e0, hn::Mul(a5, e3)), g21 = hn::MulAdd(a2, e1, hn::Mul(a5, e4)),
          g22 = hn::MulAdd(a2, e2, hn::Mul(a5, e5));
  const V turn_x = hn::Sub(g21, g12), turn_y = hn::Sub(g02, g20), turn_z = hn::Sub(g10, g01);
  const V sum_xy = hn::Add(g01, g10), sum_xz = hn::Add(g02, g20), sum_yz = hn::Add(g12, g21);
  const V g_w = hn::Mul(two, Dot3(qx, qy, qz, turn_x, turn_y, turn_z));
  const V g_x = hn::Mul(
      two, hn::MulAdd(qw, turn_x,
                      hn::NegMulAdd(hn::Mul(two, qx), hn::Add(g11, g22), hn::MulAdd(qy, sum_xy, hn::Mul(qz, sum_xz)))));
  const V g_y = hn::Mul(
      two, hn::MulAdd(qw, turn_y,
                      hn::NegMulAdd(hn::Mul(two, qy), hn::Add(g00, g22), hn::MulAdd(qx, sum_xy, hn::Mul(qz, sum_yz)))));
  const V g_z = hn::Mul(
      two, hn::MulAdd(qw, turn_z,
                      hn::NegMulAdd(hn::Mul(two, qz), hn::Add(g00, g11), hn::MulAdd(qx, sum_xz, hn::Mul(qy, sum_yz)))));
  const V radial = hn::MulAdd(qw, g_w, Dot3(qx, qy, qz, g_x, g_y, g_z));
  const V along = hn::IfThenZeroElse(zero_quat, inverse_norm);
  store(hn::Mul(along, hn::NegMulAdd(radial, qw, g_w)), out.quats[0]);
  store(hn::Mul(along, hn::NegMulAdd(radial, qx, g_x)), out.quats[1]);
  store(hn::Mul(along, hn::NegMulAdd(radial, qy, g_y)), out.quats[2]);
  store(hn::Mul(along, hn::NegMulAdd(radial, qz, g_z)), out.quats[3]);

  // ∂L/∂A = ∂L/∂E·R_qᵀ. A is f/z·(R_x − u·R_z): through z, and through u where it is not clamped.
  const V g_a0 = Dot3(e0, e1, e2, r00, r01, r02), g_a1 = Dot3(e0, e1, e2, r10, r11, r12),
          g_a2 = Dot3(e0, e1, e2, r20, r21, r22);
  const V g_a3 = Dot3(e3, e4, e5, r00, r01, r02), g_a4 = Dot3(e3, e4, e5, r10, r11, r12),
          g_a5 = Dot3(e3, e4, e5, r20, r21, r22);
  const double* r = view.r;
  const V r6 = Number(d, r[6]), r7 = Number(d, r[7]), r8 = Number(d, r[8]);
  const V g_u = hn::IfThenElseZero(hn::Eq(u, ratio_x), hn::Neg(Dot3(g_a0, g_a1, g_a2, r6, r7, r8)));
  const V g_v = hn::IfThenElseZero(hn::Eq(v, ratio_y), hn::Neg(Dot3(g_a3, g_a4, g_a5, r6, r7, r8)));
  // mean2d = f·(x/z, y/z) + c.
  const V g_cx = hn::Mul(focal_x, hn::MulAdd(g_u, inverse_z, g_px)),
          g_cy = hn::Mul(focal_y, hn::MulAdd(g_v, inverse_z, g_py));
  const V through_a = hn::Add(Dot3(g_a0, g_a1, g_a2, a0, a1, a2), Dot3(g_a3, g_a4, g_a5, a3, a4, a5));
  const V g_cz = hn::Neg(hn::MulAdd(through_a, inverse_z, hn::MulAdd(g_cx, ratio_x, hn::Mul(g_cy, ratio_y))));
  for (size_t a = 0; a < 3; ++a) {
    store(Dot3(Number(d, r[a]), Number(d, r[3 + a]), Number(d, r[6 + a]), g_cx, g_cy, g_cz), out.means[a]);
  }
  // ∂ln sigmoid(x)/∂x = 1/(1 + e^x).
  store(hn::Div(q, hn::Add(one, ExpInDomain(d, load(in.stored.logits)))), out.logits);
  return IsExtreme(d, shape, lowest);
}

// Recomputes column j of the batch in double.
void BackwardAgain(const ProjectBackwardParams& p, const View& view, int64_t i, size_t j, Gradients<float>& out) {
  const Doubles d;
  Columns<double> in;
  Gradients<double> exact;
  for (size_t k = 0; k < hn::Lanes(d); ++k) {
    ReadRow(p, i, k, in.stored);
    ReadRecord(p, view, i, k, in);
  }
  BackwardLanes(d, view, IsCompensated(p.mode), in, 0, exact);
  for (size_t a = 0; a < 3; ++a) out.means[a][j] = static_cast<float>(exact.means[a][0]);
  for (size_t a = 0; a < 3; ++a) out.log_scales[a][j] = static_cast<float>(exact.log_scales[a][0]);
  for (size_t a = 0; a < 4; ++a) out.quats[a][j] = static_cast<float>(exact.quats[a][0]);
  out.logits[j] = static_cast<float>(exact.logits[0]);
  for (size_t a = 0; a < 2; ++a) out.means2d[a][j] = static_cast<float>(exact.means2d[a][0]);
}

// Stores columns [begin, n).
void WriteRows(const Gradients<float>& g, const int32_t* rows, size_t begin, size_t n, const ProjectBackwardParams& p) {
  for (size_t j = begin; j < n; ++j) {
    const int64_t i = rows[j];
    for (int a = 0; a < 3; ++a) p.mean_gradients[3 * i + a] = g.means[a][j];
    for (int a = 0; a < 3; ++a) p.log_scale_gradients[3 * i + a] = g.log_scales[a][j];
    for (int a = 0; a < 4; ++a) p.quat_gradients[4 * i + a] = g.quats[a][j];
    p.opacity_logit_gradients[i] = g.logits[j];
    for (int a = 0; a < 2; ++a) p.means2d[2 * i + a] = g.means2d[a][j];
  }
}

// Stores consecutive rows in whole registers.
void WriteContiguous(const Gradients<float>& g, const int32_t* rows, size_t n, const ProjectBackwardParams& p) {
  const Floats d;
  const size_t lanes = hn::Lanes(d), whole = n / lanes * lanes;
  for (size_t j = 0; j < whole; j += lanes) {
    const int64_t i = rows[0] + static_cast<int64_t>(j);
    hn::StoreInterleaved3(hn::Load(d, g.means[0] + j), hn::Load(d, g.means[1] + j), hn::Load(d, g.means[2] + j), d,
                          p.mean_gradients + 3 * i);
    hn::StoreInterleaved3(hn::Load(d, g.log_scales[0] + j), hn::Load(d, g.log_scales[1] + j),
                          hn::Load(d, g.log_scales[2] + j), d, p.log_scale_gradients + 3 * i);
    hn::StoreInterleaved4(hn::Load(d, g.quats[0] + j), hn::Load(d, g.quats[1] + j), hn::Load(d, g.quats[2] + j),
                          hn::Load(d, g.quats[3] + j), d, p.quat_gradients + 4 * i);
    hn::StoreU(hn::Load(d, g.logits + j), d, p.opacity_logit_gradients + i);
    hn::StoreInterleaved2(hn::Load(d, g.means2d[0] + j), hn::Load(d, g.means2d[1] + j), d, p.means2d + 2 * i);
  }
  WriteRows(g, rows, whole, n, p);
}

// Zeroes the gradient of rows [first, last).
void ClearRows(const ProjectBackwardParams& p, int64_t first, int64_t last) {
  const int64_t n = last - first;
  if (n <= 0) return;
  std::fill_n(p.mean_gradients + 3 * first, 3 * n, 0.0f);
  std::fill_n(p.log_scale_gradients + 3 * first, 3 * n, 0.0f);
  std::fill_n(p.quat_gradients + 4 * first, 4 * n, 0.0f);
  std::fill_n(p.opacity_logit_gradients + first, n, 0.0f);
  std::fill_n(p.means2d + 2 * first, 2 * n, 0.0f);
}

// Processes one chunk.
void BackwardChunk(const ProjectBackwardParams& p, int64_t chunk) {
  const int64_t first = chunk * kProjectChunk, last = std::min(first + kProjectChunk, p.count);
  const View view = MakeView(p);
  const bool compensated = IsCompensated(p.mode);
  const Floats d;
  const size_t lanes = hn::Lanes(d);
  Columns<float> in;
  Gradients<float> out;
  int32_t rows[kBatch];
  const int32_t* visible = p.visible + first;
  const int32_t* end = visible + p.visible_counts[chunk];
  int64_t written = first;  // rows below are final or about to be written
  while (visible != end) {
    const size_t most = std::min(kBatch, static_cast<size_t>(end - visible));
    size_t n = 0;
    for (size_t k = 0; k < most; ++k) {
      if (visible + k + kAhead < end) {
        hwy::Prefetch(p.gradients + visible[k + kAhead]);
        hwy::Prefetch(p.projected + visible[k + kAhead]);
      }
      const BlendGradient& b = p.gradients[visible[k]];
      rows[n] = visible[k];
      // Occluded Gaussians have no gradient; in pictures of objects there are many.
      n += !(b.q == 0 && b.qu == 0 && b.qv == 0 && b.quu == 0 && b.quv == 0 && b.qvv == 0);
    }
    // If there are few, skipping them costs more than processing them.
    const int64_t begin = visible[0], behind = visible[most - 1] + 1;
    const bool contiguous = behind - begin == static_cast<int64_t>(most) && 4 * n >= 3 * most;
    if (contiguous) {
      n = most;
      std::copy_n(visible, n, rows);
    }
    ClearRows(p, written, contiguous ? begin : behind);
    written = behind;
    visible += most;
    if (n == 0) continue;
    ReadColumns(p, view, rows, n, contiguous, in);
    for (size_t j = 0; j < n; j += lanes) {
      const auto extreme = BackwardLanes(d, view, compensated, in, j, out);
      if (hn::AllFalse(d, extreme)) continue;
      alignas(64) float again[kLanesAtMost];
      hn::Store(hn::IfThenElseZero(extreme, hn::Set(d, 1.0f)), d, again);
      for (size_t k = 0; k < lanes && j + k < n; ++k) {
        if (again[k] != 0) BackwardAgain(p, view, rows[j + k], j + k, out);
      }
    }
    contiguous ? WriteContiguous(out, rows, n, p) : WriteRows(out, rows, 0, n, p);
  }
  ClearRows(p, written, last);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(BackwardChunk);

void ProjectBackwardCpu(const ProjectBackwardParams& p, int64_t chunk) {
  HWY_DYNAMIC_DISPATCH(BackwardChunk)(p, chunk);
}

}  // namespace anchorsplat
#endif
