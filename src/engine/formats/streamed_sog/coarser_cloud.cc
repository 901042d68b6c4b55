#include "formats/streamed_sog/coarser_cloud.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/activations.h"
#include "core/ellipsoid.h"
#include "core/kd_tree.h"
#include "core/parallel.h"
#include "core/rotation.h"
#include "core/spherical_harmonics.h"
#include "core/statistics.h"

namespace anchorsplat {

namespace {

constexpr int64_t kMergeGrain = 1 << 10;
constexpr size_t kNeighbours = 8;
// At most this fraction is merged before neighbours are searched again.
constexpr int64_t kMergedAtOnce = 4;  // one in four
// Bounds of scales: the range of SOG, where squares stay finite.
constexpr double kMostLogScale = 20;
// Assumed standard deviation of colour within a Gaussian, 0–1: smaller differences cost almost nothing.
constexpr double kColorDeviation = 0.1;
// Adjacent opaque Gaussians weigh more than one opaque Gaussian of their moments, which would leave gaps: it grows, but
// limited, as overlapping Gaussians need no growth.
constexpr double kMostGrowth = 1.2;

using Symmetric = std::array<double, 6>;  // xx xy xz yy yz zz

// Surface of an ellipsoid by Thomsen's formula (error below 1.1 %).
double SurfaceOf(const std::array<double, 3>& lengths) {
  constexpr double kPower = 1.6075;
  const double a = std::pow(lengths[0], kPower), b = std::pow(lengths[1], kPower), c = std::pow(lengths[2], kPower);
  return 4 * std::numbers::pi * std::pow((a * b + a * c + b * c) / 3, 1 / kPower);
}

struct Merged {
  std::array<double, 3> mean;
  Symmetric covariance;
  double weight;
};

struct Pair {
  double cost;
  int64_t first, second;
  // A total order, so that any sort gives the same pairs.
  bool operator<(const Pair& other) const {
    if (cost != other.cost) return cost < other.cost;
    return first != other.first ? first < other.first : second < other.second;
  }
};

Merged MomentsOf(const CloudView& cloud, int64_t row) {
  const float* q = cloud.quats.data() + 4 * row;
  const std::array<double, 9> axes = RotationFromQuaternion<double>(q[0], q[1], q[2], q[3]);
  std::array<double, 3> lengths{};
  Merged out{{}, {}, 0};
  for (size_t k = 0; k < 3; ++k) {
    out.mean[k] = cloud.means[static_cast<size_t>(3 * row) + k];
    const double log_scale = cloud.log_scales[static_cast<size_t>(3 * row) + k];
    lengths[k] = std::exp(std::clamp(log_scale, -kMostLogScale, kMostLogScale));
  }
  for (size_t i = 0, at = 0; i < 3; ++i) {
    for (size_t j = i; j < 3; ++j, ++at) {
      for (size_t k = 0; k < 3; ++k) out.covariance[at] += axes[3 * i + k] * axes[3 * j + k] * lengths[k] * lengths[k];
    }
  }
  out.weight = Sigmoid(double{cloud.opacity_logits[static_cast<size_t>(row)]}) * SurfaceOf(lengths);
  return out;
}

// ln|Σ + ground·I|: details small compared to the distance of neighbours are invisible from where a merged Gaussian is
// seen.
double LogDeterminant(const Symmetric& s, double ground) {
  const double xx = s[0] + ground, yy = s[3] + ground, zz = s[5] + ground;
  const double det = xx * (yy * zz - s[4] * s[4]) - s[1] * (s[1] * zz - s[4] * s[2]) + s[2] * (s[1] * s[4] - yy * s[2]);
  return std::log(std::max(det, ground * ground * ground));
}

// Share of the first, 0–1; one half if neither is visible.
double ShareOf(const Merged& a, const Merged& b) {
  const double sum = a.weight + b.weight;
  return sum > 0 ? a.weight / sum : 0.5;
}

Merged MergeOf(const Merged& a, const Merged& b) {
  const double p = ShareOf(a, b);
  Merged out{{}, {}, a.weight + b.weight};
  for (size_t k = 0; k < 3; ++k) out.mean[k] = p * a.mean[k] + (1 - p) * b.mean[k];
  for (size_t i = 0, at = 0; i < 3; ++i) {
    for (size_t j = i; j < 3; ++j, ++at) {
      out.covariance[at] = p * a.covariance[at] + (1 - p) * b.covariance[at] +
                           p * (1 - p) * (a.mean[i] - b.mean[i]) * (a.mean[j] - b.mean[j]);
    }
  }
  return out;
}

class Reduction {
 public:
  Reduction(const CloudView& cloud, int64_t target) : cloud_(CopyOf(cloud)), target_(target) {
    const auto n = static_cast<size_t>(cloud.size());
    moments_.resize(n);
    changed_.assign(n, 0);
    ParallelFor(0, cloud.size(), kMergeGrain, [&](int64_t first, int64_t last) {
      for (int64_t i = first; i < last; ++i) moments_[static_cast<size_t>(i)] = MomentsOf(cloud, i);
    });
  }

  GaussianCloud Run() {
    while (size() > target_) {
      Round();
      Compact();
    }
    Store();
    return std::move(cloud_);
  }

 private:
  int64_t size() const { return static_cast<int64_t>(moments_.size()); }
  const float* sh(int64_t i) const { return cloud_.sh.data() + i * cloud_.sh_stride(); }

  double CostOf(int64_t i, int64_t j, double ground) const {
    const Merged &a = moments_[static_cast<size_t>(i)], &b = moments_[static_cast<size_t>(j)];
    const Merged both = MergeOf(a, b);
    const double p = ShareOf(a, b);
    double apart = 0;
    for (int64_t c = 0; c < 3; ++c) {
      const double d = kSh0 * (double{sh(i)[c]} - double{sh(j)[c]}) / kColorDeviation;
      apart += d * d;
    }
    const double spread = LogDeterminant(both.covariance, ground) - p * logs_[static_cast<size_t>(i)] -
                          (1 - p) * logs_[static_cast<size_t>(j)];
    const double cost = 0.5 * both.weight * (spread + std::log1p(p * (1 - p) * apart));
    return std::isfinite(cost) ? cost : std::numeric_limits<double>::max();
  }

  // All pairs of near neighbours with their merge cost.
  std::vector<Pair> Pairs() {
    Buffer<float> means(static_cast<size_t>(3 * size()));
    for (size_t i = 0; i < moments_.size(); ++i) {
      for (size_t k = 0; k < 3; ++k) means[3 * i + k] = static_cast<float>(moments_[i].mean[k]);
    }
    const KdTree tree(means);
    std::vector<std::array<int64_t, kNeighbours>> near(moments_.size());
    std::vector<float> nearest(moments_.size());
    ParallelFor(0, size(), kMergeGrain, [&](int64_t first, int64_t last) {
      for (int64_t place = first; place < last; ++place) {
        std::array<KdTree::Neighbour, kNeighbours> found{};
        const auto count = static_cast<size_t>(tree.Nearest(place, found));
        const auto i = static_cast<size_t>(tree.PointAt(place));
        for (size_t k = 0; k < kNeighbours; ++k) near[i][k] = k < count ? found[k].index : -1;
        nearest[i] = count > 0 ? static_cast<float>(found[0].squared_distance) : 0;
      }
    });
    const double ground = std::max(double{Quantile(nearest, 0.5)}, 1e-24);
    logs_.resize(moments_.size());
    std::vector<std::array<double, kNeighbours>> costs(moments_.size());
    ParallelFor(0, size(), kMergeGrain, [&](int64_t first, int64_t last) {
      for (auto i = static_cast<size_t>(first); i < static_cast<size_t>(last); ++i)
        logs_[i] = LogDeterminant(moments_[i].covariance, ground);
    });
    // A pair of mutual neighbours is listed only by its first member.
    const auto listed_there = [&](int64_t i, int64_t j) {
      return j < i && std::ranges::find(near[static_cast<size_t>(j)], i) != near[static_cast<size_t>(j)].end();
    };
    ParallelFor(0, size(), kMergeGrain, [&](int64_t first, int64_t last) {
      for (int64_t i = first; i < last; ++i) {
        auto& own = near[static_cast<size_t>(i)];
        for (size_t k = 0; k < kNeighbours; ++k) {
          if (own[k] < 0 || listed_there(i, own[k])) continue;
          costs[static_cast<size_t>(i)][k] = CostOf(std::min(i, own[k]), std::max(i, own[k]), ground);
        }
      }
    });
    std::vector<Pair> pairs;
    for (int64_t i = 0; i < size(); ++i) {
      for (size_t k = 0; k < kNeighbours; ++k) {
        const int64_t j = near[static_cast<size_t>(i)][k];
        if (j < 0 || listed_there(i, j)) continue;
        pairs.push_back({costs[static_cast<size_t>(i)][k], std::min(i, j), std::max(i, j)});
      }
    }
    return pairs;
  }

  void Round() {
    std::vector<Pair> pairs = Pairs();
    const int64_t wanted = std::min(size() - target_, std::max<int64_t>(1, size() / kMergedAtOnce));
    std::sort(pairs.begin(), pairs.end());
    gone_.assign(moments_.size(), 0);
    std::vector<char> taken(moments_.size(), 0);
    int64_t merged = 0;
    for (const Pair& pair : pairs) {
      if (merged == wanted) break;
      const auto i = static_cast<size_t>(pair.first), j = static_cast<size_t>(pair.second);
      if (taken[i] != 0 || taken[j] != 0) continue;
      taken[i] = taken[j] = 1;
      Merge(i, j);
      ++merged;
    }
  }

  void Merge(size_t i, size_t j) {
    const double p = ShareOf(moments_[i], moments_[j]);
    const auto stride = static_cast<size_t>(cloud_.sh_stride());
    for (size_t c = 0; c < stride; ++c) {
      float& x = cloud_.sh[i * stride + c];
      x = static_cast<float>(p * double{x} + (1 - p) * double{cloud_.sh[j * stride + c]});
    }
    moments_[i] = MergeOf(moments_[i], moments_[j]);
    gone_[j] = changed_[i] = 1;
  }

  static std::array<double, 3> LengthsOf(const Ellipsoid& ellipsoid) {
    std::array<double, 3> lengths{};
    for (size_t k = 0; k < 3; ++k)
      lengths[k] = std::max(std::sqrt(std::max(0.0, ellipsoid.variances[k])), std::exp(-kMostLogScale));
    return lengths;
  }

  // Removes merged ones.
  void Compact() {
    const auto stride = static_cast<size_t>(cloud_.sh_stride());
    size_t to = 0;
    for (size_t i = 0; i < moments_.size(); ++i) {
      if (gone_[i] != 0) continue;
      moments_[to] = moments_[i];
      changed_[to] = changed_[i];
      const auto move = [&](Buffer<float>& values, size_t width) {
        std::copy_n(values.begin() + static_cast<int64_t>(i * width), width,
                    values.begin() + static_cast<int64_t>(to * width));
      };
      move(cloud_.means, 3);
      move(cloud_.log_scales, 3);
      move(cloud_.quats, 4);
      move(cloud_.opacity_logits, 1);
      move(cloud_.sh, stride);
      ++to;
    }
    moments_.resize(to);
    changed_.resize(to);
    cloud_.Resize(static_cast<int64_t>(to), cloud_.sh_degree);
  }

  // Converts moments of merged Gaussians to stored form.
  void Store() {
    ParallelFor(0, size(), kMergeGrain, [&](int64_t first, int64_t last) {
      for (auto i = static_cast<size_t>(first); i < static_cast<size_t>(last); ++i) {
        if (changed_[i] == 0) continue;
        const Ellipsoid ellipsoid = EllipsoidOf(moments_[i].covariance);
        std::array<double, 3> lengths = LengthsOf(ellipsoid);
        const double opacity = moments_[i].weight / SurfaceOf(lengths);
        for (double& length : lengths) length *= std::clamp(std::sqrt(opacity), 1.0, kMostGrowth);
        const std::array<double, 4> quat = QuaternionFromRotation(ellipsoid.axes);
        for (size_t k = 0; k < 3; ++k) {
          cloud_.means[3 * i + k] = static_cast<float>(moments_[i].mean[k]);
          // Merging two that are farther apart leaves nothing visible.
          cloud_.log_scales[3 * i + k] = std::min(static_cast<float>(std::log(lengths[k])), kMaxLogScale);
        }
        for (size_t k = 0; k < 4; ++k) cloud_.quats[4 * i + k] = static_cast<float>(quat[k]);
        cloud_.opacity_logits[i] = LogitFromOpacity(static_cast<float>(std::min(opacity, 1.0)));
      }
    });
  }

  GaussianCloud cloud_;
  int64_t target_;
  std::vector<Merged> moments_;
  std::vector<char> changed_, gone_;
  std::vector<double> logs_;  // ln|Σ| of each in this round
};

}  // namespace

GaussianCloud CoarsenCloud(const CloudView& cloud, int64_t target) {
  return Reduction(cloud, std::max<int64_t>(1, target)).Run();
}

}  // namespace anchorsplat
