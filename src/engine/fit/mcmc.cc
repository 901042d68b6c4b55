#include "fit/mcmc.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/rotation.h"
#include "fit/random_streams.h"

namespace anchorsplat {

namespace {

constexpr double kGrowth = 1.05;                         // per refinement
constexpr double kGateSteepness = 100, kGateAt = 0.995;  // k and x0 of gsplat's op_sigmoid
constexpr double kClosedGate = 1e-12;                    // below this, noise does not change a float mean
constexpr int64_t kNoiseRows = 4096;                     // rows per random stream

double OpacityOf(const GaussianCloud& cloud, int64_t row) {
  return Sigmoid(double{cloud.opacity_logits[static_cast<size_t>(row)]});
}

// Draws rows in proportion to opacity, with repetition.
std::vector<int64_t> DrawByOpacity(const GaussianCloud& cloud, const std::vector<int64_t>& rows, int64_t count,
                                   Random& random) {
  std::vector<double> up_to(rows.size());
  double total = 0;
  for (size_t i = 0; i < rows.size(); ++i) up_to[i] = total += OpacityOf(cloud, rows[i]);
  std::vector<int64_t> drawn;
  if (!(total > 0)) return drawn;
  drawn.reserve(static_cast<size_t>(count));
  for (int64_t k = 0; k < count; ++k) {
    const auto found = std::upper_bound(up_to.begin(), up_to.end(), total * random.Uniform());
    drawn.push_back(rows[static_cast<size_t>(std::min(found, up_to.end() - 1) - up_to.begin())]);
  }
  return drawn;
}

// Replaces each drawn row by Gaussians that share its look with those relocated to it.
void Share(const std::vector<int64_t>& drawn, double min_opacity, GaussianCloud& cloud) {
  std::vector<int64_t> sorted = drawn;
  std::sort(sorted.begin(), sorted.end());
  for (size_t first = 0; first < sorted.size();) {
    const int64_t row = sorted[first];
    size_t last = first;
    while (last < sorted.size() && sorted[last] == row) ++last;
    const auto [opacity, scale] =
        RelocationOf(OpacityOf(cloud, row), static_cast<int64_t>(last - first) + 1, min_opacity);
    cloud.opacity_logits[static_cast<size_t>(row)] = static_cast<float>(std::log(opacity / (1 - opacity)));
    for (int64_t a = 0; a < 3; ++a) {
      float& log_scale = cloud.log_scales[static_cast<size_t>(3 * row + a)];
      log_scale = static_cast<float>(double{log_scale} + std::log(scale));
    }
    first = last;
  }
}

void CopyRow(int64_t from, int64_t to, GaussianCloud& cloud) {
  const auto copy = [&](Buffer<float>& values, int64_t width) {
    std::copy_n(values.data() + from * width, width, values.data() + to * width);
  };
  copy(cloud.means, 3);
  copy(cloud.log_scales, 3);
  copy(cloud.quats, 4);
  copy(cloud.opacity_logits, 1);
  copy(cloud.sh, cloud.sh_stride());
}

bool IsDead(const GaussianCloud& cloud, int64_t row, double min_opacity) {
  return !IsUsable(cloud, row) || OpacityOf(cloud, row) <= min_opacity;
}

void Relocate(const McmcOptions& options, Random& random, GaussianCloud& cloud, DensificationChange& change) {
  std::vector<int64_t> dead, alive;
  for (int64_t i = 0; i < cloud.size(); ++i) (IsDead(cloud, i, options.min_opacity) ? dead : alive).push_back(i);
  if (dead.empty()) return;
  const std::vector<int64_t> drawn = DrawByOpacity(cloud, alive, std::ssize(dead), random);
  if (drawn.empty()) return;  // there is no live Gaussian to relocate to
  Share(drawn, options.min_opacity, cloud);
  for (size_t k = 0; k < dead.size(); ++k) CopyRow(drawn[k], dead[k], cloud);
  change.relocated = std::ssize(dead);
  change.forgotten.assign(drawn.begin(), drawn.end());
  change.forgotten.insert(change.forgotten.end(), dead.begin(), dead.end());
  std::sort(change.forgotten.begin(), change.forgotten.end());
  change.forgotten.erase(std::unique(change.forgotten.begin(), change.forgotten.end()), change.forgotten.end());
}

void Grow(const McmcOptions& options, Random& random, GaussianCloud& cloud, DensificationChange& change) {
  const int64_t before = cloud.size();
  // At least one: 5 % of fewer than 20 is none.
  const auto grown = std::max(before + 1, static_cast<int64_t>(kGrowth * static_cast<double>(before)));
  const int64_t target = std::min(options.cap_max, grown);
  if (target <= before) return;
  std::vector<int64_t> rows;
  for (int64_t i = 0; i < before; ++i) {
    if (IsUsable(cloud, i)) rows.push_back(i);
  }
  const std::vector<int64_t> drawn = DrawByOpacity(cloud, rows, target - before, random);
  if (drawn.empty()) return;
  Share(drawn, options.min_opacity, cloud);
  change.added = std::ssize(drawn);
  change.rows.any = true;
  change.rows.fresh = change.added;
  change.rows.kept.resize(static_cast<size_t>(before));
  for (int64_t i = 0; i < before; ++i) change.rows.kept[static_cast<size_t>(i)] = i;
  const auto more = [&](Buffer<float>& values, int64_t width) { values = ChangeRows(values, width, change.rows); };
  more(cloud.means, 3);
  more(cloud.log_scales, 3);
  more(cloud.quats, 4);
  more(cloud.sh, cloud.sh_stride());
  more(cloud.opacity_logits, 1);
  for (size_t k = 0; k < drawn.size(); ++k) CopyRow(drawn[k], before + static_cast<int64_t>(k), cloud);
}

// means += Σ·η·gate(o)·scaler with η normal: along the Gaussian's shape, and only if it is nearly transparent.
void AddNoise(double scaler, const McmcStep& step, GaussianCloud& cloud) {
  ParallelFor(0, cloud.size(), kNoiseRows, [&](int64_t begin, int64_t end) {
    Random random = RandomStream(step.seed, RandomPurpose::kNoise, (step.step << 16) + begin / kNoiseRows);
    for (int64_t i = begin; i < end; ++i) {
      const double gate = 1 / (1 + std::exp(-kGateSteepness * ((1 - OpacityOf(cloud, i)) - kGateAt)));
      if (!(gate > kClosedGate) || !IsUsable(cloud, i)) continue;
      const float* q = cloud.quats.data() + 4 * i;
      const auto r = RotationFromQuaternion<double>(q[0], q[1], q[2], q[3]);
      std::array<double, 3> noise, along{};
      const double here = scaler / step.far.FactorAt(cloud.means.data() + 3 * i);
      for (double& x : noise) x = random.Normal() * gate * here;
      for (size_t a = 0; a < 3; ++a) {
        const double variance = std::exp(2 * double{cloud.log_scales[static_cast<size_t>(3 * i) + a]});
        along[a] = variance * (r[a] * noise[0] + r[3 + a] * noise[1] + r[6 + a] * noise[2]);
      }
      for (size_t a = 0; a < 3; ++a) {
        float& mean = cloud.means[static_cast<size_t>(3 * i) + a];
        mean =
            static_cast<float>(double{mean} + r[3 * a] * along[0] + r[3 * a + 1] * along[1] + r[3 * a + 2] * along[2]);
      }
    }
  });
}

}  // namespace

McmcOptions ScaledTo(const McmcOptions& options, int64_t steps) {
  const auto scaled = [&](int64_t count) { return count * steps / kStandardSteps; };
  McmcOptions out = options;
  out.refine_start_iter = scaled(options.refine_start_iter);
  out.refine_stop_iter = scaled(options.refine_stop_iter);
  out.refine_every = std::max<int64_t>(1, scaled(options.refine_every));
  return out;
}

Relocation RelocationOf(double opacity, int64_t ratio, double min_opacity) {
  const auto n = static_cast<double>(std::clamp<int64_t>(ratio, 1, kMostRelocated));
  const double most = 1 - double{std::numeric_limits<float>::epsilon()};
  const double shared = std::clamp(-std::expm1(std::log1p(-std::min(opacity, 1.0)) / n), min_opacity, most);
  // Trapezoidal rule: its error falls faster than any power of the step if all derivatives vanish at the ends. Beyond
  // 6, N·e^(−x²) is below 1e-14.
  constexpr double kDistance = 1.0 / 16;
  constexpr int kPoints = 96;
  double sum = 0;
  for (int j = 0; j <= kPoints; ++j) {
    const double x = kDistance * j;
    const double covered = -std::expm1(n * std::log1p(-shared * std::exp(-x * x)));
    sum += j == 0 ? covered : 2 * covered;  // the integrand is even
  }
  return {shared, opacity / (kDistance * sum * std::numbers::inv_sqrtpi)};
}

DensificationChange McmcAfterStep(const McmcOptions& options, const McmcStep& step, GaussianCloud& cloud) {
  DensificationChange change;
  if (step.step < options.refine_stop_iter && step.step > options.refine_start_iter &&
      step.step % options.refine_every == 0) {
    Random random = RandomStream(step.seed, RandomPurpose::kRelocation, step.step);
    Relocate(options, random, cloud, change);
    Grow(options, random, cloud, change);
  }
  AddNoise(options.noise_lr * step.means_rate / (step.unit * step.unit), step, cloud);
  return change;
}

}  // namespace anchorsplat
