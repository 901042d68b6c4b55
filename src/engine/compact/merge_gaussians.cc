#include "compact/merge_gaussians.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/constants.h"

namespace anchorsplat {

namespace {

using Vector = std::array<double, 3>;
using Symmetric = std::array<double, 6>;  // xx xy xz yy yz zz

// A view along an axis of the frame: the other two axes, and the indices of their covariance.
struct View {
  size_t u, v, uu, uv, vv;
};
constexpr std::array<View, 3> kViews = {{{1, 2, 3, 4, 5}, {0, 2, 0, 2, 5}, {0, 1, 0, 1, 3}}};

double Determinant(const Symmetric& s, const View& view) { return s[view.uu] * s[view.vv] - s[view.uv] * s[view.uv]; }

Symmetric Sum(const Symmetric& a, const Symmetric& b) {
  Symmetric sum;
  for (size_t k = 0; k < 6; ++k) sum[k] = a[k] + b[k];
  return sum;
}

Vector Times(const Symmetric& s, const Vector& x) {
  return {s[0] * x[0] + s[1] * x[1] + s[2] * x[2], s[1] * x[0] + s[3] * x[1] + s[4] * x[2],
          s[2] * x[0] + s[4] * x[1] + s[5] * x[2]};
}

Symmetric Inverse(const Symmetric& s) {
  const double xx = s[3] * s[5] - s[4] * s[4], xy = s[2] * s[4] - s[1] * s[5], xz = s[1] * s[4] - s[2] * s[3];
  const double inverse = 1 / (s[0] * xx + s[1] * xy + s[2] * xz);
  return {xx * inverse,
          xy * inverse,
          xz * inverse,
          (s[0] * s[5] - s[2] * s[2]) * inverse,
          (s[1] * s[2] - s[0] * s[4]) * inverse,
          (s[0] * s[3] - s[1] * s[1]) * inverse};
}

// Two Gaussians' product as a Gaussian, up to a factor.
struct Product {
  Vector mean;
  Symmetric covariance;
};
Product ProductOf(const MergeGaussian& a, const MergeGaussian& b) {
  const Symmetric inverse = Inverse(Sum(a.covariance, b.covariance));
  Vector apart;
  for (size_t c = 0; c < 3; ++c) apart[c] = b.mean[c] - a.mean[c];
  const Vector shift = Times(a.covariance, Times(inverse, apart));
  Product product;
  for (size_t c = 0; c < 3; ++c) product.mean[c] = a.mean[c] + shift[c];
  // A − A (A + B)⁻¹ A
  constexpr size_t kRow[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
  for (size_t c = 0; c < 3; ++c) {
    const Vector column = {a.covariance[kRow[c][0]], a.covariance[kRow[c][1]], a.covariance[kRow[c][2]]};
    const Vector taken = Times(a.covariance, Times(inverse, column));
    for (size_t r = 0; r <= c; ++r) product.covariance[kRow[r][c]] = a.covariance[kRow[r][c]] - taken[r];
  }
  return product;
}

// Adds weight · (covariance + (mean − centre)(mean − centre)ᵀ).
void AddMoment(double weight, const Vector& mean, const Symmetric& covariance, const Vector& centre, Symmetric& sum) {
  const Vector d = {mean[0] - centre[0], mean[1] - centre[1], mean[2] - centre[2]};
  const Symmetric square = {d[0] * d[0], d[0] * d[1], d[0] * d[2], d[1] * d[1], d[1] * d[2], d[2] * d[2]};
  for (size_t k = 0; k < 6; ++k) sum[k] += weight * (covariance[k] + square[k]);
}

bool IsPositive(const Symmetric& s) {
  const double determinant =
      s[0] * (s[3] * s[5] - s[4] * s[4]) - s[1] * (s[1] * s[5] - s[2] * s[4]) + s[2] * (s[1] * s[4] - s[2] * s[3]);
  return s[0] > 0 && s[0] * s[3] - s[1] * s[1] > 0 && determinant > 0 && std::isfinite(s[0] + s[3] + s[5]);
}

}  // namespace

double VisibleVarianceShare(double opacity) {
  const double rest = std::min(kMinAlpha / opacity, 0.95);
  return (1 - rest + rest * std::log(rest)) / (1 - rest);
}

void Measure(MergeGaussian& gaussian) {
  // From direction n it is 2π·√(nᵀ adj(Σ) n). The radicand's mean is tr(adj(Σ))/3; the root's mean is up to an eighth
  // less than the root of that: factor 0.866 for discs, 0.962 for needles, 1 for balls. A line over tr(adj²)/tr(adj)²
  // fits these three.
  const Symmetric& s = gaussian.covariance;
  std::array<double, 3> squares;
  double trace = 0;
  for (size_t w = 0; w < 3; ++w) {
    squares[w] = std::max(0.0, Determinant(s, kViews[w]));
    gaussian.area[w] = 2 * std::numbers::pi * std::sqrt(squares[w]);
    trace += squares[w];
  }
  const double xy = s[2] * s[4] - s[1] * s[5], xz = s[1] * s[4] - s[2] * s[3], yz = s[1] * s[2] - s[0] * s[4];
  const double square =
      squares[0] * squares[0] + squares[1] * squares[1] + squares[2] * squares[2] + 2 * (xy * xy + xz * xz + yz * yz);
  const double flat = trace > 0 ? square / (trace * trace) - 1.0 / 3 : 0;
  gaussian.mean_area = 2 * std::numbers::pi * std::sqrt(trace / 3) * (1 - 0.2 * flat);
  gaussian.mass = gaussian.opacity * gaussian.mean_area;
}

std::array<double, 3> Overlaps(const MergeGaussian& a, const MergeGaussian& b) {
  const Symmetric sum = Sum(a.covariance, b.covariance);
  const Vector d = {b.mean[0] - a.mean[0], b.mean[1] - a.mean[1], b.mean[2] - a.mean[2]};
  std::array<double, 3> overlaps;
  for (size_t w = 0; w < 3; ++w) {
    const View& view = kViews[w];
    const double inverse = 1 / Determinant(sum, view);
    const double square = sum[view.vv] * d[view.u] * d[view.u] - 2 * sum[view.uv] * d[view.u] * d[view.v] +
                          sum[view.uu] * d[view.v] * d[view.v];
    overlaps[w] =
        a.area[w] * b.area[w] / (2 * std::numbers::pi) * std::sqrt(inverse) * std::exp(-0.5 * square * inverse);
  }
  return overlaps;
}

MergedPair MergePair(const MergeGaussian& a, const MergeGaussian& b, const std::array<double, 3>& overlaps,
                     bool for_cost) {
  MergedPair merged;
  const double of_views = a.area[0] + a.area[1] + a.area[2] + b.area[0] + b.area[1] + b.area[2];
  const double twice =
      a.opacity * b.opacity * (overlaps[0] + overlaps[1] + overlaps[2]) * ((a.mean_area + b.mean_area) / of_views);
  const double mass = a.mass + b.mass - twice;
  if (!(mass > 0) || !std::isfinite(mass)) return merged;
  merged.share = (a.mass - twice / 2) / mass;
  const Product product = for_cost ? Product() : ProductOf(a, b);
  MergeGaussian &out = merged.gaussian, &sum = merged.sum;
  const auto moments = [&](double both, MergeGaussian& of) {
    const double all = a.mass + b.mass - both;
    for (size_t c = 0; c < 3; ++c) {
      of.mean[c] = (a.mass * a.mean[c] + b.mass * b.mean[c] - (both > 0 ? both * product.mean[c] : 0)) / all;
    }
    of.covariance = {};
    AddMoment(a.mass / all, a.mean, a.covariance, of.mean, of.covariance);
    AddMoment(b.mass / all, b.mean, b.covariance, of.mean, of.covariance);
    if (both > 0) AddMoment(-both / all, product.mean, product.covariance, of.mean, of.covariance);
  };
  moments(0, sum);
  sum.opacity = 1;
  Measure(sum);
  sum.opacity = mass / sum.mean_area;
  Measure(sum);
  merged.valid = std::isfinite(sum.mass) && std::isfinite(sum.mean[0] + sum.mean[1] + sum.mean[2]);
  if (for_cost || !merged.valid) return merged;
  moments(twice, out);
  if (!IsPositive(out.covariance)) moments(0, out);  // for Gaussians that cross at an angle
  merged.valid = IsPositive(out.covariance);
  if (!merged.valid) return merged;
  out.thinnest = std::min(a.thinnest, b.thinnest);
  Measure(out);
  out.opacity = mass / out.mean_area;
  if (out.opacity > kMostMergedOpacity) {
    for (double& x : out.covariance) x *= out.opacity / kMostMergedOpacity;
    out.opacity = kMostMergedOpacity;
  }
  Measure(out);
  merged.valid = std::isfinite(out.mass) && std::isfinite(out.mean[0] + out.mean[1] + out.mean[2]);
  return merged;
}

double MergeCost(const MergeGaussian& a, const MergeGaussian& b, const std::array<double, 3>& overlaps,
                 const MergedPair& merged, const MergeColors& colors) {
  const MergeGaussian& m = merged.sum;
  const std::array<double, 3> with_a = Overlaps(a, m), with_b = Overlaps(b, m);
  // Colours relative to their common mean.
  const double s = merged.share, t = 1 - s;
  const double ma = s * colors.aa + t * colors.ab, mb = s * colors.ab + t * colors.bb, mm = s * ma + t * mb;
  constexpr double kAlpha = 3 * kBehind * kBehind;
  const double aa = colors.aa - 2 * ma + mm + kAlpha, bb = colors.bb - 2 * mb + mm + kAlpha;
  const double ab = colors.ab - ma - mb + mm + kAlpha;
  // The merged one has the mean colour, so only its alpha term remains.
  // Where both have alpha, each contributes less, as if both were less opaque.
  const double less = m.mass / (a.mass + b.mass), oa = less * a.opacity, ob = less * b.opacity, om = m.opacity;
  double cost = 0;
  for (size_t w = 0; w < 3; ++w) {
    cost += 0.5 * (oa * oa * a.area[w] * aa + ob * ob * b.area[w] * bb + om * om * m.area[w] * kAlpha) +
            2 * oa * ob * overlaps[w] * ab - 2 * kAlpha * om * (oa * with_a[w] + ob * with_b[w]);
  }
  return std::max(0.0, cost / 9);
}

}  // namespace anchorsplat
