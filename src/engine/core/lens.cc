#include "core/lens.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace anchorsplat {

namespace {

double Power4(const std::array<double, 4>& k, double q) { return 1 + q * (k[0] + q * (k[1] + q * (k[2] + q * k[3]))); }

double Denominator(const Lens& lens, double q) {
  return 1 + q * (lens.denominator[0] + q * (lens.denominator[1] + q * lens.denominator[2]));
}

// Distorted radius of a point at radius r, without tangential terms.
double DistortedRadius(const Lens& lens, double r) {
  if (lens.model == LensModel::kNone) return r;
  if (lens.model == LensModel::kFisheye) {
    const double theta = std::atan(r);
    return theta * Power4(lens.radial, theta * theta);
  }
  return r * Power4(lens.radial, r * r) / Denominator(lens, r * r);
}

// Angles from the axis that are searched; no pinhole picture needs larger ones.
constexpr int kAngles = 8192;
constexpr double kWidest = 0.4999 * std::numbers::pi;

}  // namespace

bool Lens::IsIdentity() const {
  if (model == LensModel::kFisheye) return false;
  const auto zero = [](const auto& list) {
    return std::all_of(list.begin(), list.end(), [](double x) { return x == 0; });
  };
  return model == LensModel::kNone || (zero(radial) && zero(denominator) && zero(tangential) && skew == 0);
}

namespace {

// Distort without skew.
PlanePoint DistortUnskewed(const Lens& lens, const PlanePoint& p) {
  const double x = p[0], y = p[1], q = x * x + y * y;
  switch (lens.model) {
    case LensModel::kNone:
      break;
    case LensModel::kFisheye: {
      const double r = std::sqrt(q);
      if (r < 1e-12) break;
      const double s = DistortedRadius(lens, r) / r;
      return {s * x, s * y};
    }
    case LensModel::kRadial: {
      const double s = Power4(lens.radial, q) / Denominator(lens, q);
      const double p1 = lens.tangential[0], p2 = lens.tangential[1];
      return {s * x + 2 * p1 * x * y + p2 * (q + 2 * x * x), s * y + 2 * p2 * x * y + p1 * (q + 2 * y * y)};
    }
  }
  return p;
}

}  // namespace

PlanePoint Distort(const Lens& lens, const PlanePoint& p) {
  const PlanePoint d = DistortUnskewed(lens, p);
  return {d[0] + lens.skew * d[1], d[1]};
}

LensInverse::LensInverse(const Lens& lens) : lens_(lens), largest_radius_(0), largest_distorted_(0) {
  for (int i = 1; i <= kAngles; ++i) {
    const double r = std::tan(kWidest * i / kAngles);
    const double distorted = DistortedRadius(lens, r);
    if (!(distorted > largest_distorted_)) break;
    if (lens.model == LensModel::kRadial && !(Denominator(lens, r * r) > 0)) break;
    largest_radius_ = r;
    largest_distorted_ = distorted;
  }
}

std::optional<PlanePoint> LensInverse::Undistort(const PlanePoint& distorted) const {
  if (lens_.IsIdentity()) return distorted;
  const PlanePoint unskewed = {distorted[0] - lens_.skew * distorted[1], distorted[1]};
  const double radius = std::hypot(unskewed[0], unskewed[1]);
  if (!(radius < 1e300)) return std::nullopt;
  if (radius < 1e-12) return unskewed;
  // The radial part is monotonic up to the largest radius, so bisection cannot fail. Tangential terms may be needed to
  // get back inside.
  double low = 0, high = largest_radius_;
  for (int i = 0; i < 60 && high - low > 1e-4 * high; ++i) {
    const double middle = 0.5 * (low + high);
    (DistortedRadius(lens_, middle) < radius ? low : high) = middle;
  }
  const double r = 0.5 * (low + high);
  PlanePoint p = {unskewed[0] / radius * r, unskewed[1] / radius * r};
  if (lens_.model == LensModel::kFisheye && radius > largest_distorted_) return std::nullopt;
  // Newton's method with finite differences adds the last digits and the tangential terms.
  constexpr double kStep = 1e-7;
  for (int i = 0; i < 30; ++i) {
    const PlanePoint f = DistortUnskewed(lens_, p);
    const double ex = f[0] - unskewed[0], ey = f[1] - unskewed[1];
    if (std::hypot(ex, ey) < 1e-13 * (1 + radius)) break;
    const double h = kStep * (1 + std::hypot(p[0], p[1]));
    const PlanePoint right = DistortUnskewed(lens_, {p[0] + h, p[1]}), left = DistortUnskewed(lens_, {p[0] - h, p[1]});
    const PlanePoint below = DistortUnskewed(lens_, {p[0], p[1] + h}), above = DistortUnskewed(lens_, {p[0], p[1] - h});
    const double a = (right[0] - left[0]) / (2 * h), b = (below[0] - above[0]) / (2 * h);
    const double c = (right[1] - left[1]) / (2 * h), d = (below[1] - above[1]) / (2 * h);
    const double determinant = a * d - b * c;
    if (!(std::abs(determinant) > 1e-12)) return std::nullopt;
    p[0] -= (d * ex - b * ey) / determinant;
    p[1] -= (a * ey - c * ex) / determinant;
  }
  const PlanePoint found = DistortUnskewed(lens_, p);
  const double off = std::hypot(found[0] - unskewed[0], found[1] - unskewed[1]);
  if (!(off < 1e-8 * (1 + radius)) || !(std::hypot(p[0], p[1]) <= largest_radius_ * (1 + 1e-6))) return std::nullopt;
  return p;
}

}  // namespace anchorsplat
