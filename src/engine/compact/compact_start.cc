#include "compact/compact_start.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/activations.h"

namespace anchorsplat {

namespace {

// Lower bound of s, reached only for spreads above 0.7.
constexpr double kNarrowest = 0.5;

}  // namespace

CopyStart::CopyStart(int64_t copies, double spread) : offsets_(static_cast<size_t>(copies), {0, 0}) {
  if (copies == 1) return;
  if (copies == 2) {
    offsets_ = {{spread, 0}, {-spread, 0}};
    variance_ = {spread * spread, 0};
    return;
  }
  variance_ = {spread * spread, spread * spread};
  if (copies == 4) {
    offsets_ = {{spread, spread}, {spread, -spread}, {-spread, spread}, {-spread, -spread}};
    return;
  }
  // A sunflower spiral fills the disc evenly for every K; below it is made isotropic to second order.
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  const auto count = static_cast<double>(copies);
  double mean[2] = {0, 0}, square[2] = {0, 0}, product = 0;
  for (size_t k = 0; k < offsets_.size(); ++k) {
    const double at = static_cast<double>(k) + 0.5;
    offsets_[k] = {std::sqrt(at) * std::cos(at * golden), std::sqrt(at) * std::sin(at * golden)};
    for (size_t a = 0; a < 2; ++a) mean[a] += offsets_[k][a] / count;
  }
  for (auto& offset : offsets_) {
    for (size_t a = 0; a < 2; ++a) offset[a] -= mean[a];
    for (size_t a = 0; a < 2; ++a) square[a] += offset[a] * offset[a] / count;
    product += offset[0] * offset[1] / count;
  }
  // The inverse Cholesky factor of the covariance removes the correlation.
  const double first = std::sqrt(square[0]), slope = product / first;
  const double second = std::sqrt(square[1] - slope * slope);
  for (auto& offset : offsets_) {
    offset[0] /= first;
    offset[1] = (offset[1] - slope * offset[0]) / second;
    for (double& x : offset) x *= spread;
  }
}

CopyStart::Shape CopyStart::ShapeOf(double opacity_logit) const {
  const auto copies = static_cast<double>(offsets_.size());
  if (offsets_.size() == 1) return {opacity_logit, {0, 0, 0}};
  const double o = Sigmoid(opacity_logit);
  const double centre = o - 0.13 * (1 - std::pow(copies, -4.0 / 3)) * o * o * o;
  const double together = 1 - 0.23 * (1 - 1 / copies) * o - 0.05 * o * o;  // s₀²
  double opacity = -std::expm1(std::log1p(-centre) / copies);
  Shape shape{};
  for (size_t a = 0; a < 3; ++a) {
    const double apart = std::max(kNarrowest * kNarrowest, together - (a < 2 ? variance_[a] : 0));
    shape.log_shorter[a] = 0.5 * std::log(apart);
    opacity *= std::sqrt(together / apart);
  }
  opacity = std::min(opacity, 0.99);
  shape.opacity_logit = std::log(opacity) - std::log1p(-opacity);
  return shape;
}

}  // namespace anchorsplat
