#include "enhance/enhanced_look.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/buffer.h"
#include "core/kd_tree.h"
#include "core/parallel.h"
#include "core/quaternion_length.h"
#include "core/rotation.h"
#include "core/run_context.h"
#include "core/statistics.h"
#include "enhance/enhanced_look_coefficients.h"
#include "enhance/trained_kind.h"

namespace anchorsplat {

namespace {

constexpr int64_t kFewest = 1000;
constexpr int64_t kSamples = 4000;
constexpr size_t kNeighbours = 8;
constexpr size_t kRanks = 3;  // the twin, the second and the third
constexpr std::array<double, 5> kDifferenceQuantiles = {0.1, 0.25, 0.5, 0.75, 0.9};
constexpr std::array<double, 3> kQuartiles = {0.25, 0.5, 0.75};
constexpr double kLeast = 0.02;  // below that, formats round
constexpr double kMostDifferent = 1;
constexpr double kMostDeviations = 4;  // that count, of a feature
constexpr double kUnlikeAny = 5;       // beyond that it is like nothing that was learned from
constexpr double kNearlyRound = 0.2;   // ln of the ratio of two axes
constexpr double kNoHarmonics = 1e-8;  // product of the norms of two

double Logarithm(double x) { return std::log(x + kLeast); }

// The logarithm of a Gaussian's covariance, halved: its log-scales along its own axes. xx, yy, zz, √2·xy, √2·xz, √2·yz,
// so that differences have the norm of the matrix.
std::array<double, 6> LogCovariance(const GaussianCloud& cloud, size_t i) {
  const float* q = cloud.quats.data() + 4 * i;
  const auto r = RotationFromQuaternion(double{q[0]}, double{q[1]}, double{q[2]}, double{q[3]});
  const float* s = cloud.log_scales.data() + 3 * i;
  const auto entry = [&](size_t a, size_t b) {
    double sum = 0;
    for (size_t k = 0; k < 3; ++k) sum += r[3 * a + k] * double{s[k]} * r[3 * b + k];
    return sum;
  };
  const double root = std::sqrt(2.0);
  return {entry(0, 0), entry(1, 1), entry(2, 2), root * entry(0, 1), root * entry(0, 2), root * entry(1, 2)};
}

double Difference(const std::array<double, 6>& a, const std::array<double, 6>& b) {
  double sum = 0;
  for (size_t k = 0; k < 6; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum);
}

// From i to j, in standard deviations of i.
double Deviations(const GaussianCloud& cloud, size_t i, size_t j) {
  const float* q = cloud.quats.data() + 4 * i;
  const auto r = RotationFromQuaternion(double{q[0]}, double{q[1]}, double{q[2]}, double{q[3]});
  double sum = 0;
  for (size_t a = 0; a < 3; ++a) {
    double along = 0;
    for (size_t k = 0; k < 3; ++k) {
      along += r[3 * k + a] * (double{cloud.means[3 * j + k]} - double{cloud.means[3 * i + k]});
    }
    along *= std::exp(-double{cloud.log_scales[3 * i + a]});
    sum += along * along;
  }
  return std::sqrt(sum);
}

double ColourDifference(const GaussianCloud& cloud, size_t i, size_t j) {
  const auto of = [&](size_t row) { return cloud.sh.data() + row * static_cast<size_t>(cloud.sh_stride()); };
  double most = 0;
  for (size_t c = 0; c < 3; ++c) most = std::max(most, std::abs(double{of(i)[c]} - double{of(j)[c]}));
  return most;
}

// |cos| of half the angle between them.
double HalfTurn(const GaussianCloud& cloud, size_t i, size_t j) {
  double product = 0, of_i = 0, of_j = 0;
  for (size_t k = 0; k < 4; ++k) {
    const double a{cloud.quats[4 * i + k]}, b{cloud.quats[4 * j + k]};
    product += a * b;
    of_i += a * a;
    of_j += b * b;
  }
  const double norms = std::sqrt(of_i * of_j);
  return norms > 0 ? std::min(1.0, std::abs(product) / norms) : 1;  // a zero quaternion counts as no rotation
}

// What is asked of a sample.
struct Twins {
  std::array<Buffer<float>, kRanks> differences;  // rising
  Buffer<float> distance, colour, opacity;        // to the twin
  Buffer<float> turn;                             // likewise: cosine of half the angle
  std::vector<std::array<int64_t, 2>> rows;
};

Twins FindTwins(const GaussianCloud& cloud, std::span<const int64_t> rows) {
  Buffer<float> means;
  for (const int64_t row : rows) {
    means.insert(means.end(), cloud.means.begin() + 3 * row, cloud.means.begin() + 3 * row + 3);
  }
  const KdTree tree(means);
  const auto samples = std::min(kSamples, tree.size());
  Twins twins;
  for (auto* values : {&twins.differences[0], &twins.differences[1], &twins.differences[2], &twins.distance,
                       &twins.colour, &twins.opacity, &twins.turn}) {
    values->resize(static_cast<size_t>(samples));
  }
  twins.rows.resize(static_cast<size_t>(samples));
  constexpr int64_t kPerTask = 64;
  ParallelFor(0, samples, kPerTask, [&](int64_t begin, int64_t end) {
    for (int64_t k = begin; k < end; ++k) {
      const auto at = static_cast<size_t>(k);
      // Places of the tree, and not rows: files may be in any order.
      const int64_t place = k * tree.size() / samples;
      const auto own = static_cast<size_t>(rows[static_cast<size_t>(tree.PointAt(place))]);
      std::array<KdTree::Neighbour, kNeighbours> nearest{};
      const auto found = static_cast<size_t>(tree.Nearest(place, nearest));
      const auto covariance = LogCovariance(cloud, own);
      std::array<std::pair<double, size_t>, kNeighbours> others{};
      for (size_t n = 0; n < found; ++n) {
        const auto other = static_cast<size_t>(rows[static_cast<size_t>(nearest[n].index)]);
        others[n] = {Difference(covariance, LogCovariance(cloud, other)), other};
      }
      std::partial_sort(others.begin(), others.begin() + kRanks, others.begin() + static_cast<std::ptrdiff_t>(found));
      for (size_t rank = 0; rank < kRanks; ++rank) {
        twins.differences[rank][at] = static_cast<float>(others[rank].first);
      }
      const size_t twin = others[0].second;
      twins.rows[at] = {static_cast<int64_t>(own), static_cast<int64_t>(twin)};
      twins.distance[at] = static_cast<float>(Deviations(cloud, own, twin));
      twins.turn[at] = static_cast<float>(HalfTurn(cloud, own, twin));
      twins.colour[at] = static_cast<float>(ColourDifference(cloud, own, twin));
      twins.opacity[at] = std::abs(std::clamp(cloud.opacity_logits[own], -10.0f, 10.0f) -
                                   std::clamp(cloud.opacity_logits[twin], -10.0f, 10.0f));
    }
  });
  return twins;
}

// Median angle to the twin, degrees, and how near the tenth is that is nearest to its twin, in standard deviations.
// Fits of 300 to 3,000 steps are at 24 to 87, and on top of each other (0.05 to 0.24) or apart (0.65 to 1.7). What
// networks made is at 3 to 25 and, beyond 15, at 0.37 and more; where they made one of each of a standard or
// antialiased fit, at 56 to 84 and 0.41 to 0.64. Merged levels of detail are at 31 to 58 and 0.96.
constexpr double kTurned = 20, kOnTop = 0.3, kTurnedFar = 30, kApart = 0.65;
bool AreUnrelated(Twins& twins) {
  const double turn = 2 * std::acos(double{Quantile(twins.turn, 0.5)}) * 180 / std::numbers::pi;
  const auto nearest = double{Quantile(twins.distance, 0.1)};
  return (turn > kTurned && nearest < kOnTop) || (turn > kTurnedFar && nearest > kApart);
}

}  // namespace

std::optional<EnhancedLook> FindEnhancedLook(const GaussianCloud& showing, const SizeTails& tails, FoundTwins* found) {
  std::vector<int64_t> rows;
  Buffer<float> smallest, middle, largest, opacities;
  for (int64_t row = 0; row < showing.size(); ++row) {
    const auto i = static_cast<size_t>(row);
    const float* scales = showing.log_scales.data() + 3 * i;
    std::array<float, 3> axes = {scales[0], scales[1], scales[2]};
    if (!std::ranges::all_of(axes, [](float axis) { return std::isfinite(axis); })) continue;  // flat
    std::ranges::sort(axes);
    rows.push_back(row);
    smallest.push_back(axes[0]);
    middle.push_back(axes[1]);
    largest.push_back(axes[2]);
    opacities.push_back(Sigmoid(showing.opacity_logits[i]));
  }
  if (static_cast<int64_t>(rows.size()) < kFewest) return std::nullopt;
  LeaveIfAbandoned();
  Twins twins = FindTwins(showing, rows);
  LeaveIfAbandoned();

  if (found != nullptr) *found = {.unrelated = AreUnrelated(twins), .rows = std::move(twins.rows)};
  EnhancedLook look{};
  size_t next = 0;
  for (Buffer<float>& differences : twins.differences) {
    for (const double q : kDifferenceQuantiles) look[next++] = Logarithm(double{Quantile(differences, q)});
  }
  for (Buffer<float>* values : {&twins.distance, &twins.colour, &twins.opacity}) {
    for (const double q : kQuartiles) look[next++] = Logarithm(double{Quantile(*values, q)});
  }
  look[next++] = Logarithm(tails.smallest);
  look[next++] = Logarithm(tails.middle);
  look[next++] = std::log(tails.roundness);
  const double median = double{Quantile(smallest, 0.5)}, of_middle = double{Quantile(middle, 0.5)};
  look[next++] = median - of_middle;
  look[next++] = double{Quantile(largest, 0.5)} - of_middle;
  look[next++] = median - double{Quantile(smallest, 0.1)};
  look[next++] = median - double{Quantile(smallest, 0.25)};
  const auto opaque = std::ranges::count_if(opacities, [](float o) { return o > 0.95f; });
  look[next++] = tails.opaque;
  look[next++] = static_cast<double>(opaque) / static_cast<double>(opacities.size());
  look[next++] = double{Quantile(opacities, 0.5)};
  look[next++] = double{Quantile(opacities, 0.25)};
  return look;
}

bool HasQuaternionsOfTraining(const GaussianCloud& showing) {
  const size_t count = showing.opacity_logits.size();
  size_t own = 0;
  for (size_t i = 0; i < count; ++i) own += IsNotNormalised(QuaternionLength(showing.quats.data() + 4 * i));
  return 2 * own > count;
}

std::optional<double> LikenessOfHarmonics(const CloudView& whole, std::span<const int64_t> rows_of_showing,
                                          const FoundTwins& twins) {
  if (whole.sh_degree < 2) return std::nullopt;
  const auto first = static_cast<size_t>(3 * ShCoefficients(1)), stride = static_cast<size_t>(whole.sh_stride());
  const auto of = [&](int64_t row) {
    return whole.sh.subspan(static_cast<size_t>(rows_of_showing[static_cast<size_t>(row)]) * stride + first,
                            stride - first);
  };
  Buffer<float> cosines, values;
  for (const auto& [row, twin] : twins.rows) {
    const auto a = of(row), b = of(twin);
    double product = 0, of_a = 0, of_b = 0;
    for (size_t k = 0; k < a.size(); ++k) {
      product += double{a[k]} * double{b[k]};
      of_a += double{a[k]} * double{a[k]};
      of_b += double{b[k]} * double{b[k]};
    }
    const double norms = std::sqrt(of_a * of_b);
    if (!(norms > kNoHarmonics) || !std::isfinite(norms)) continue;
    cosines.push_back(static_cast<float>(product / norms));
    values.push_back(a[0]);
  }
  if (std::ssize(cosines) < kFewest / 4) return std::nullopt;
  std::ranges::sort(values);
  const auto different = std::ranges::unique(values).begin() - values.begin();
  if (2 * different < std::ssize(cosines)) return std::nullopt;
  return double{Quantile(cosines, 0.75)};
}

double LogOddsOfEnhanced(const EnhancedLook& look) {
  const bool round = look[kFlatness] > -kNearlyRound && look[kElongation] < kNearlyRound;
  if (round || look[kTwinUpperQuartile] > Logarithm(kMostDifferent)) return -std::numeric_limits<double>::infinity();
  const EnhancedLookNetwork& network = kEnhancedLookNetwork;
  EnhancedLook x{};
  for (size_t k = 0; k < x.size(); ++k) {
    const double deviation = (look[k] - network.middle[k]) / network.width[k];
    if (!(std::abs(deviation) <= kUnlikeAny)) return -std::numeric_limits<double>::infinity();
    x[k] = std::clamp(deviation, -kMostDeviations, kMostDeviations);
  }
  double odds = network.last;
  for (size_t h = 0; h < kEnhancedLookHidden; ++h) {
    double sum = network.bias[h];
    for (size_t k = 0; k < x.size(); ++k) sum += network.inner[h][k] * x[k];
    odds += network.outer[h] * std::tanh(sum);
  }
  return odds;
}

}  // namespace anchorsplat
