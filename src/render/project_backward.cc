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

constexpr size_t kAhead = 24;  // Gaussians that are fetched ahead: rows are large and not all of them are needed

struct Columns {
  StoredColumns stored;
  alignas(64) float u_xx[kBatch], u_xy[kBatch], u_yy[kBatch];
  alignas(64) float q[kBatch], qu[kBatch], qv[kBatch], quu[kBatch], quv[kBatch], qvv[kBatch];
};

struct Gradients {
  alignas(64) float means[3][kBatch];
  alignas(64) float log_scales[3][kBatch];
  alignas(64) float quats[4][kBatch];
  alignas(64) float logits[kBatch];
  alignas(64) float means2d[2][kBatch];
};

using FloatTag = hn::Rebind<float, D>;  // as many floats as there are doubles in a register

HWY_INLINE V LoadWidened(const float* from) { return hn::PromoteTo(D(), hn::Load(FloatTag(), from)); }
HWY_INLINE void StoreNarrowed(V value, float* to) { hn::Store(hn::DemoteTo(FloatTag(), value), FloatTag(), to); }

// `contiguous`: each row is the one behind the row before it.
void ReadColumns(const ProjectBackwardParams& p, const int32_t* rows, size_t n, bool contiguous, Columns& c) {
  const size_t end = std::min(kBatch, (n + 7) / 8 * 8);
  for (size_t j = contiguous ? ReadWholeRegisters(p, rows[0], n, c.stored) : 0; j < end; ++j) {
    const int64_t i = rows[std::min(j, n - 1)];  // the last register is filled up with one that is not written
    for (int a = 0; a < 3; ++a) c.stored.means[a][j] = p.means[3 * i + a];
    for (int a = 0; a < 3; ++a) c.stored.log_scales[a][j] = p.log_scales[3 * i + a];
    for (int a = 0; a < 4; ++a) c.stored.quats[a][j] = p.quats[4 * i + a];
    c.stored.logits[j] = p.opacity_logits[i];
  }
  for (size_t j = 0; j < end; ++j) {
    const int64_t i = rows[std::min(j, n - 1)];
    const ProjectedGaussian& g = p.projected[i];
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
}

// One register of Gaussians, columns j … j + lanes − 1: the gradients of what ProjectCpu calculates, in the opposite
// order; g_x is ∂L/∂x.
HWY_INLINE void BackwardLanes(const View& view, bool compensated, const Columns& in, size_t j, Gradients& out) {
  const D d;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0), two = hn::Set(d, 2.0);
  const double* r = view.r;
  const Shape shape = ShapeOf(d, view, in.stored, j, CameraSpace(d, view, in.stored, j, 0),
                              CameraSpace(d, view, in.stored, j, 1), CameraSpace(d, view, in.stored, j, 2));
  const auto& [inverse_z, ratio_x, ratio_y, focal_x, focal_y, u, v, qw, qx, qy, qz, inverse_norm, zero_quat, r00, r01,
               r02, r10, r11, r12, r20, r21, r22, s0, s1, s2, a0, a1, a2, a3, a4, a5, b0, b1, b2, b3, b4, b5] = shape;

  // ln α = ln o − ½ dᵀΣ₂⁻¹d, and with W the factor that gives (u, v) = W·d, Σ₂⁻¹ = 2 ln 2·WᵀW. So
  //   ∂L/∂mean2d = Σ q·Σ₂⁻¹d = 2 ln 2·Wᵀ Σ q·(u, v),   ∂L/∂Σ₂ = ½ Σ q·Σ₂⁻¹d dᵀΣ₂⁻¹ = 2 ln²2·Wᵀ(Σ q·(u, v)(u, v)ᵀ)W.
  constexpr double kTwoLn2 = 2 * std::numbers::ln2, kTwoLn2Squared = 2 * std::numbers::ln2 * std::numbers::ln2;
  const V w_xx = LoadWidened(in.u_xx + j), w_xy = LoadWidened(in.u_xy + j), w_yy = LoadWidened(in.u_yy + j);
  const V q = LoadWidened(in.q + j), qu = LoadWidened(in.qu + j), qv = LoadWidened(in.qv + j);
  const V g_px = hn::Mul(hn::Set(d, kTwoLn2), hn::Mul(w_xx, qu));
  const V g_py = hn::Mul(hn::Set(d, kTwoLn2), hn::MulAdd(w_xy, qu, hn::Mul(w_yy, qv)));
  StoreNarrowed(g_px, out.means2d[0] + j);
  StoreNarrowed(g_py, out.means2d[1] + j);
  const V quu = LoadWidened(in.quu + j), quv = LoadWidened(in.quv + j), qvv = LoadWidened(in.qvv + j);
  const V left_x = hn::MulAdd(w_xy, quu, hn::Mul(w_yy, quv)), left_y = hn::MulAdd(w_xy, quv, hn::Mul(w_yy, qvv));
  const V scale = hn::Set(d, kTwoLn2Squared);
  V g_xx = hn::Mul(scale, hn::Mul(w_xx, hn::Mul(w_xx, quu)));
  V g_xy = hn::Mul(scale, hn::Mul(w_xx, left_x));  // of each of the two equal entries
  V g_yy = hn::Mul(scale, hn::MulAdd(w_xy, left_x, hn::Mul(w_yy, left_y)));
  if (compensated) {
    // o = sigmoid·sqrt(det Σ_from / det Σ₂), Σ_from with the lesser dilation:  ∂ln o/∂Σ = ½ (Σ_from⁻¹ − Σ₂⁻¹).
    const auto& [xx, xy, yy, det, from_xx, from_yy, from_det] = CovarianceOf(d, view, shape);
    // Where the determinant is 0, so was the opacity, and the Gaussian is not here.
    const V half_q = hn::Mul(hn::Set(d, 0.5), q);
    const V by_from = hn::IfThenElseZero(hn::Gt(from_det, zero), hn::Div(half_q, from_det));
    const V by_det = hn::Div(half_q, det);
    g_xx = hn::Add(g_xx, hn::MulSub(by_from, from_yy, hn::Mul(by_det, yy)));
    g_yy = hn::Add(g_yy, hn::MulSub(by_from, from_xx, hn::Mul(by_det, xx)));
    g_xy = hn::NegMulAdd(hn::Sub(by_from, by_det), xy, g_xy);
  }

  // ∂L/∂B = 2·G·B; scales; ∂L/∂E.
  V g_b0 = hn::Mul(two, hn::MulAdd(g_xx, b0, hn::Mul(g_xy, b3))),
    g_b3 = hn::Mul(two, hn::MulAdd(g_xy, b0, hn::Mul(g_yy, b3)));
  V g_b1 = hn::Mul(two, hn::MulAdd(g_xx, b1, hn::Mul(g_xy, b4))),
    g_b4 = hn::Mul(two, hn::MulAdd(g_xy, b1, hn::Mul(g_yy, b4)));
  V g_b2 = hn::Mul(two, hn::MulAdd(g_xx, b2, hn::Mul(g_xy, b5))),
    g_b5 = hn::Mul(two, hn::MulAdd(g_xy, b2, hn::Mul(g_yy, b5)));
  StoreNarrowed(hn::MulAdd(g_b0, b0, hn::Mul(g_b3, b3)), out.log_scales[0] + j);
  StoreNarrowed(hn::MulAdd(g_b1, b1, hn::Mul(g_b4, b4)), out.log_scales[1] + j);
  StoreNarrowed(hn::MulAdd(g_b2, b2, hn::Mul(g_b5, b5)), out.log_scales[2] + j);
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
  StoreNarrowed(hn::Mul(along, hn::NegMulAdd(radial, qw, g_w)), out.quats[0] + j);
  StoreNarrowed(hn::Mul(along, hn::NegMulAdd(radial, qx, g_x)), out.quats[1] + j);
  StoreNarrowed(hn::Mul(along, hn::NegMulAdd(radial, qy, g_y)), out.quats[2] + j);
  StoreNarrowed(hn::Mul(along, hn::NegMulAdd(radial, qz, g_z)), out.quats[3] + j);

  // ∂L/∂A = ∂L/∂E·R_qᵀ. A is f/z·(R_x − u·R_z): through z, and through u where it is not clamped.
  const V g_a0 = Dot3(e0, e1, e2, r00, r01, r02), g_a1 = Dot3(e0, e1, e2, r10, r11, r12),
          g_a2 = Dot3(e0, e1, e2, r20, r21, r22);
  const V g_a3 = Dot3(e3, e4, e5, r00, r01, r02), g_a4 = Dot3(e3, e4, e5, r10, r11, r12),
          g_a5 = Dot3(e3, e4, e5, r20, r21, r22);
  const V r6 = hn::Set(d, r[6]), r7 = hn::Set(d, r[7]), r8 = hn::Set(d, r[8]);
  const V g_u = hn::IfThenElseZero(hn::Eq(u, ratio_x), hn::Neg(Dot3(g_a0, g_a1, g_a2, r6, r7, r8)));
  const V g_v = hn::IfThenElseZero(hn::Eq(v, ratio_y), hn::Neg(Dot3(g_a3, g_a4, g_a5, r6, r7, r8)));
  // mean2d = f·(x/z, y/z) + c.
  const V g_cx = hn::Mul(focal_x, hn::MulAdd(g_u, inverse_z, g_px)),
          g_cy = hn::Mul(focal_y, hn::MulAdd(g_v, inverse_z, g_py));
  const V through_a = hn::Add(Dot3(g_a0, g_a1, g_a2, a0, a1, a2), Dot3(g_a3, g_a4, g_a5, a3, a4, a5));
  const V g_cz = hn::Neg(hn::MulAdd(through_a, inverse_z, hn::MulAdd(g_cx, ratio_x, hn::Mul(g_cy, ratio_y))));
  for (size_t a = 0; a < 3; ++a) {
    StoreNarrowed(Dot3(hn::Set(d, r[a]), hn::Set(d, r[3 + a]), hn::Set(d, r[6 + a]), g_cx, g_cy, g_cz),
                  out.means[a] + j);
  }
  // ∂ln sigmoid(x)/∂x = 1/(1 + e^x).
  StoreNarrowed(hn::Div(q, hn::Add(one, ExpInDomain(d, hn::Load(d, in.stored.logits + j)))), out.logits + j);
}

// Columns [begin, n).
void WriteRows(const Gradients& g, const int32_t* rows, size_t begin, size_t n, const ProjectBackwardParams& p) {
  for (size_t j = begin; j < n; ++j) {
    const int64_t i = rows[j];
    for (int a = 0; a < 3; ++a) p.mean_gradients[3 * i + a] = g.means[a][j];
    for (int a = 0; a < 3; ++a) p.log_scale_gradients[3 * i + a] = g.log_scales[a][j];
    for (int a = 0; a < 4; ++a) p.quat_gradients[4 * i + a] = g.quats[a][j];
    p.opacity_logit_gradients[i] = g.logits[j];
    for (int a = 0; a < 2; ++a) p.means2d[2 * i + a] = g.means2d[a][j];
  }
}

// Rows one behind the other, by whole registers.
void WriteContiguous(const Gradients& g, const int32_t* rows, size_t n, const ProjectBackwardParams& p) {
  const FloatTag d;
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

// Gaussians of one chunk.
void BackwardChunk(const ProjectBackwardParams& p, int64_t chunk) {
  const int64_t first = chunk * kProjectChunk, n_all = std::min(kProjectChunk, p.count - first);
  std::fill_n(p.mean_gradients + 3 * first, 3 * n_all, 0.0f);
  std::fill_n(p.log_scale_gradients + 3 * first, 3 * n_all, 0.0f);
  std::fill_n(p.quat_gradients + 4 * first, 4 * n_all, 0.0f);
  std::fill_n(p.opacity_logit_gradients + first, n_all, 0.0f);
  std::fill_n(p.means2d + 2 * first, 2 * n_all, 0.0f);

  const View view = MakeView(p);
  const bool compensated = IsCompensated(p.mode);
  const size_t lanes = hn::Lanes(D());
  Columns in;
  Gradients out;
  int32_t rows[kBatch];
  const int32_t* visible = p.visible + first;
  const int32_t* end = visible + p.visible_counts[chunk];
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
      // Hidden ones have no gradient, and in pictures of objects they are many.
      n += !(b.q == 0 && b.qu == 0 && b.qv == 0 && b.quu == 0 && b.quv == 0 && b.qvv == 0);
    }
    // Where they are few, it is quicker to take them along than to leave them out.
    const bool contiguous = visible[most - 1] - visible[0] == static_cast<int32_t>(most) - 1 && 4 * n >= 3 * most;
    if (contiguous) {
      n = most;
      std::copy_n(visible, n, rows);
    }
    visible += most;
    if (n == 0) continue;
    ReadColumns(p, rows, n, contiguous, in);
    for (size_t j = 0; j < n; j += lanes) BackwardLanes(view, compensated, in, j, out);
    contiguous ? WriteContiguous(out, rows, n, p) : WriteRows(out, rows, 0, n, p);
  }
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
