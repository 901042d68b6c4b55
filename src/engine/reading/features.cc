#include "reading/features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "core/activations.h"
#include "core/ellipsoid.h"
#include "core/kd_tree.h"
#include "core/parallel.h"
#include "core/quaternion_length.h"
#include "core/render_mode.h"
#include "core/rotation.h"
#include "core/run_context.h"
#include "core/spherical_harmonics.h"
#include "core/statistics.h"
#include "core/text.h"
#include "reading/places.h"
#include "reading/splat_pictures.h"

namespace anchorsplat {

namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr int64_t kMostOfStatistics = 20'000;  // Gaussians; more do not change the quantiles
constexpr int64_t kMostOfNeighbours = 3'000;
constexpr double kLeastDifference = 0.02;  // smaller differences are rounding of formats
constexpr double kLeastLength = -12;       // ln of the unit

// Collects either names or values, in the same order.
class Row {
 public:
  explicit Row(std::vector<std::string>& names) : names_(&names) {}
  Row(std::vector<double>& values, double unit) : values_(&values), log_unit_(std::log(unit)) {}

  void Add(std::string_view name, double value) {
    if (names_ != nullptr) names_->emplace_back(name);
    if (values_ != nullptr) values_->push_back(std::isfinite(value) ? value : kUnknown);
  }
  // Flat Gaussians count as kLeastLength.
  void AddLogLength(std::string_view name, double log_length) {
    Add(name, std::max(log_length - log_unit_, kLeastLength));
  }

 private:
  std::vector<std::string>* names_ = nullptr;
  std::vector<double>* values_ = nullptr;
  double log_unit_ = 0;
};

// Weighted values of a sample of Gaussians.
struct Weighted {
  std::vector<std::pair<float, float>> items;
  double total = 0;
  bool sorted = false;

  void Add(float value, float weight) {
    items.emplace_back(value, weight);
    total += double{weight};
  }
  // Value at which this share of the weight is reached.
  double Quantile(double share) {
    if (items.empty()) return kUnknown;
    if (!sorted) std::sort(items.begin(), items.end());
    sorted = true;
    double sum = 0;
    for (const auto& [value, weight] : items) {
      sum += double{weight};
      if (sum >= share * total) return double{value};
    }
    return double{items.back().first};
  }
};

// ln of the axes, smallest first.
std::array<float, 3> SortedAxes(const GaussianCloud& cloud, size_t i) {
  std::array<float, 3> axes;
  std::copy_n(cloud.log_scales.data() + 3 * i, 3, axes.begin());
  std::ranges::sort(axes);
  return axes;
}

struct Gaussians {
  // Sorted samples of visible Gaussians: ln of the axes, smallest first; opacity and its logit.
  std::array<Buffer<float>, 3> axes;
  Buffer<float> opacities, logits;
  std::vector<std::pair<float, float>> areas;  // sorted: ln(middle × largest axis), opacity
  std::array<Weighted, 4> weighted;            // ln of the axes, then opacity; weights opacity × area
};

Gaussians SampleOf(const GaussianCloud& visible) {
  Gaussians out;
  const int64_t step = std::max<int64_t>(1, visible.size() / kMostOfStatistics);
  for (int64_t row = 0; row < visible.size(); row += step) {
    const auto i = static_cast<size_t>(row);
    const std::array<float, 3> own = SortedAxes(visible, i);
    const float opacity = Sigmoid(visible.opacity_logits[i]);
    const float weight = opacity * std::exp(own[1] + own[2]);
    for (size_t a = 0; a < 3; ++a) {
      if (std::isfinite(own[a])) out.axes[a].push_back(own[a]);
    }
    out.opacities.push_back(opacity);
    out.areas.emplace_back(own[1] + own[2], opacity);
    out.logits.push_back(std::clamp(visible.opacity_logits[i], -20.0f, 20.0f));
    if (!(weight > 0) || !std::isfinite(weight)) continue;
    for (size_t a = 0; a < 3; ++a) out.weighted[a].Add(std::max(own[a], -80.0f), weight);
    out.weighted[3].Add(opacity, weight);
  }
  for (Buffer<float>* values : {&out.axes[0], &out.axes[1], &out.axes[2], &out.opacities, &out.logits}) {
    std::ranges::sort(*values);
  }
  std::sort(out.areas.begin(), out.areas.end());
  return out;
}

// √(largest × middle axis) of their 10 % quantiles.
double SmallSize(Gaussians& sample) {
  return std::exp(0.5 * (sample.weighted[1].Quantile(0.1) + sample.weighted[2].Quantile(0.1)));
}

double SortedQuantile(std::span<const float> sorted, double q) {
  if (sorted.empty()) return kUnknown;
  const double at = q * static_cast<double>(sorted.size() - 1);
  const auto low = static_cast<size_t>(at);
  const size_t high = std::min(low + 1, sorted.size() - 1);
  const double part = at - static_cast<double>(low);
  return double{sorted[low]} * (1 - part) + double{sorted[high]} * part;
}

// Mean distance of the smallest `share` below its quantile.
double Tail(std::span<const float> sorted, double share) {
  const double quantile = SortedQuantile(sorted, share);
  double sum = 0;
  for (const float x : sorted) {
    if (double{x} >= quantile) break;
    sum += quantile - double{x};
  }
  return sum / (share * static_cast<double>(std::max<size_t>(1, sorted.size())));
}

// Share of values equal to the most common one (within a thousandth), as when a program set them.
double ShareOfTheSame(std::span<const float> sorted) {
  if (sorted.empty()) return kUnknown;
  constexpr float kSame = 1e-3f;
  size_t most = 0;
  for (size_t first = 0, last = 0; last < sorted.size(); ++last) {
    while (sorted[last] - sorted[first] > kSame) ++first;
    most = std::max(most, last - first + 1);
  }
  return static_cast<double>(most) / static_cast<double>(sorted.size());
}

// Share within one format quantization step of the minimum.
double ShareOfTheLeast(std::span<const float> sorted) {
  constexpr float kStep = 0.07f;
  if (sorted.empty()) return kUnknown;
  const auto end = std::ranges::upper_bound(sorted, sorted.front() + kStep);
  return static_cast<double>(end - sorted.begin()) / static_cast<double>(sorted.size());
}

void AddFile(const CloudView& whole, Row& row) {
  for (const RenderMode mode : kRenderModes) {
    row.Add(Cat("file.", NameOf(mode)), whole.render_mode == mode ? 1 : 0);
  }
  row.Add("file.sh_degree", whole.sh_degree);
}

// Leaves out counts and overall size: they are equal for all fits of one data set, and differ between data sets.
void AddCounts(const VisibleGaussians& visible, Row& row) {
  const auto count = [](int64_t n) { return static_cast<double>(std::max<int64_t>(1, n)); };
  const int64_t shown = visible.cloud.size();
  row.Add("count.share_showing", static_cast<double>(shown) / count(visible.central.cloud.size()));
  int64_t black = 0;
  for (size_t i = 0; i < visible.cloud.opacity_logits.size(); ++i) black += IsNearlyBlack(visible.cloud, i) ? 1 : 0;
  row.Add("count.share_bright", static_cast<double>(shown - black) / count(shown));
}

void AddSizes(Gaussians& sample, Row& row) {
  constexpr std::array<double, 4> kShares = {0.1, 0.25, 0.5, 0.75};
  for (size_t a = 0; a < 3; ++a) {
    for (const double q : kShares) {
      row.AddLogLength(Cat("size.axis", a, ".", q), sample.weighted[a].Quantile(q));
    }
  }
  for (const double q : kShares) row.Add(Cat("size.opacity.", q), sample.weighted[3].Quantile(q));

  const Buffer<float>& opacities = sample.opacities;
  for (int decile = 1; decile <= 9; ++decile) {
    row.Add(Cat("opacity.", decile), SortedQuantile(opacities, decile / 10.0));
  }
  const auto faint = std::ranges::lower_bound(opacities, 0.3f) - opacities.begin();
  row.Add("opacity.faint", static_cast<double>(faint) / static_cast<double>(std::max<size_t>(1, opacities.size())));
  for (const double q : {0.001, 0.01, 0.05}) row.Add(Cat("opacity.logit.", q), SortedQuantile(sample.logits, q));
  row.Add("opacity.same", ShareOfTheSame(sample.logits));
}

void AddAxes(const Gaussians& sample, Row& row) {
  for (size_t a = 0; a < 3; ++a) {
    for (const double q : {0.005, 0.02, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99}) {
      row.AddLogLength(Cat("axis", a, ".", q), SortedQuantile(sample.axes[a], q));
    }
    for (const double share : {0.02, 0.05, 0.2}) {
      row.Add(Cat("tail", a, ".", share), std::log(Tail(sample.axes[a], share) + kLeastDifference));
    }
    row.Add(Cat("axis", a, ".same"), ShareOfTheSame(sample.axes[a]));
    row.Add(Cat("axis", a, ".least"), ShareOfTheLeast(sample.axes[a]));
  }
}

// Opacity as a function of size.
void AddOpacityBySize(const Gaussians& sample, Row& row) {
  const auto& items = sample.areas;
  for (size_t fifth = 0; fifth < 5; ++fifth) {
    const size_t begin = fifth * items.size() / 5, end = (fifth + 1) * items.size() / 5;
    double sum = 0, opaque = 0;
    for (size_t i = begin; i < end; ++i) {
      sum += double{items[i].second};
      opaque += items[i].second > 0.95f ? 1 : 0;
    }
    const auto count = static_cast<double>(std::max<size_t>(1, end - begin));
    row.Add(Cat("opacity.of_fifth", fifth), sum / count);
    row.Add(Cat("opacity.opaque_of_fifth", fifth), opaque / count);
  }
}

void AddColorsAndTurns(const CloudView& whole, const VisibleGaussians& visible, Row& row) {
  double outside = 0, constant = 0, rest = 0, lengths = 0, count = 0;
  const auto step = std::max<size_t>(1, visible.rows.size() / kMostOfStatistics);
  for (size_t n = 0; n < visible.rows.size(); n += step) {
    const int64_t i = visible.rows[n];
    const float* const sh = whole.sh.data() + i * whole.sh_stride();
    bool out = false;
    for (int64_t k = 0; k < whole.sh_stride(); ++k) {
      const double value{sh[k]};
      if (k < 3) out = out || std::abs(value) * double{kSh0} > 0.5;
      (k < 3 ? constant : rest) += value * value;
    }
    outside += out ? 1 : 0;
    lengths += std::min(1.0, std::abs(QuaternionLength(whole.quats.data() + 4 * i) - 1));
    ++count;
  }
  count = std::max(1.0, count);
  row.Add("color.outside", outside / count);
  row.Add("color.harmonics", std::sqrt(rest / std::max(constant, 1e-12)));
  row.Add("turn.lengths", std::log(lengths / count + 1e-3));
}

// Half the matrix logarithm of the covariance (log-scales along the axes): xx, yy, zz, √2·xy, √2·xz, √2·yz, so that the
// vector norm of differences is their matrix norm.
std::array<double, 6> LogCovariance(const GaussianCloud& cloud, size_t i, const std::array<double, 9>& r) {
  const float* s = cloud.log_scales.data() + 3 * i;
  const auto entry = [&](size_t a, size_t b) {
    double sum = 0;
    for (size_t k = 0; k < 3; ++k) sum += r[3 * a + k] * std::max(-30.0, double{s[k]}) * r[3 * b + k];
    return sum;
  };
  const double root = std::sqrt(2.0);
  return {entry(0, 0), entry(1, 1), entry(2, 2), root * entry(0, 1), root * entry(0, 2), root * entry(1, 2)};
}

std::array<double, 9> TurnOf(const GaussianCloud& cloud, size_t i) {
  const float* q = cloud.quats.data() + 4 * i;
  return RotationFromQuaternion(double{q[0]}, double{q[1]}, double{q[2]}, double{q[3]});
}

double Difference(const std::array<double, 6>& a, const std::array<double, 6>& b) {
  double sum = 0;
  for (size_t k = 0; k < 6; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum);
}

// Distance from i to j in standard deviations of i.
double Deviations(const GaussianCloud& cloud, size_t i, size_t j, const std::array<double, 9>& r) {
  double sum = 0;
  for (size_t a = 0; a < 3; ++a) {
    double along = 0;
    for (size_t k = 0; k < 3; ++k) {
      along += r[3 * k + a] * (double{cloud.means[3 * j + k]} - double{cloud.means[3 * i + k]});
    }
    along *= std::exp(-std::max(-30.0, double{cloud.log_scales[3 * i + a]}));
    sum += along * along;
  }
  return std::min(1e6, std::sqrt(sum));
}

// Rotation angle between two Gaussians, radians.
double TurnBetween(const GaussianCloud& cloud, size_t i, size_t j) {
  double product = 0, of_i = 0, of_j = 0;
  for (size_t k = 0; k < 4; ++k) {
    const double a{cloud.quats[4 * i + k]}, b{cloud.quats[4 * j + k]};
    product += a * b;
    of_i += a * a;
    of_j += b * b;
  }
  const double norms = std::sqrt(of_i * of_j);
  return norms > 0 ? 2 * std::acos(std::min(1.0, std::abs(product) / norms)) : 0;
}

// Cosine between SH of degrees 2 and 3: a network scales those of a Gaussian for all its copies.
double LikenessOfHarmonics(const CloudView& whole, int64_t a, int64_t b) {
  const auto first = 3 * static_cast<size_t>(ShCoefficients(1)), stride = static_cast<size_t>(whole.sh_stride());
  const float* const x = whole.sh.data() + static_cast<size_t>(a) * stride;
  const float* const y = whole.sh.data() + static_cast<size_t>(b) * stride;
  double product = 0, of_x = 0, of_y = 0;
  for (size_t k = first; k < stride; ++k) {
    product += double{x[k]} * double{y[k]};
    of_x += double{x[k]} * double{x[k]};
    of_y += double{y[k]} * double{y[k]};
  }
  const double norms = std::sqrt(of_x * of_y);
  return norms > 1e-8 && std::isfinite(norms) ? product / norms : kUnknown;
}

struct Neighbours {
  std::array<Buffer<float>, 3> difference;                  // of the three most similar of eight, sorted
  Buffer<float> distance, color, opacity, turn, harmonics;  // to the most similar
  Buffer<float> side, wide;  // side of the square of surface per Gaussian, from 8 and from 64 neighbours; ln
  Buffer<float> own;         // ln √(largest × middle axis) over `side`
};

Neighbours NeighboursOf(const CloudView& whole, const VisibleGaussians& visible) {
  const GaussianCloud& cloud = visible.cloud;
  const KdTree tree(cloud.means);
  const auto samples = std::min(kMostOfNeighbours, tree.size());
  const auto count = static_cast<size_t>(samples);
  Neighbours out;
  for (auto* values : {&out.difference[0], &out.difference[1], &out.difference[2], &out.distance, &out.color,
                       &out.opacity, &out.turn, &out.harmonics, &out.side, &out.wide, &out.own}) {
    values->assign(count, std::numeric_limits<float>::quiet_NaN());
  }
  constexpr int64_t kPerTask = 64;
  ParallelFor(0, samples, kPerTask, [&](int64_t begin, int64_t end) {
    for (int64_t k = begin; k < end; ++k) {
      const auto at = static_cast<size_t>(k);
      // Samples by tree order, not rows, because files may be in any order.
      const int64_t place = k * tree.size() / samples;
      const auto own = static_cast<size_t>(tree.PointAt(place));
      std::array<KdTree::Neighbour, 64> nearest{};
      const auto found = static_cast<size_t>(tree.Nearest(place, nearest));
      if (found < 8) continue;
      const auto side = [&](size_t n) {
        return 0.5 * std::log(std::numbers::pi * nearest[n - 1].squared_distance / static_cast<double>(n) + 1e-30);
      };
      out.side[at] = static_cast<float>(side(8));
      out.wide[at] = static_cast<float>(side(found));
      const std::array<float, 3> axes = SortedAxes(cloud, own);
      out.own[at] = 0.5f * (axes[1] + axes[2]) - out.side[at];
      const auto turn = TurnOf(cloud, own);
      const auto covariance = LogCovariance(cloud, own, turn);
      std::array<std::pair<double, size_t>, 8> others{};
      for (size_t n = 0; n < others.size(); ++n) {
        const auto other = static_cast<size_t>(nearest[n].index);
        others[n] = {Difference(covariance, LogCovariance(cloud, other, TurnOf(cloud, other))), other};
      }
      std::partial_sort(others.begin(), others.begin() + 3, others.end());
      for (size_t rank = 0; rank < 3; ++rank) out.difference[rank][at] = static_cast<float>(others[rank].first);
      const size_t twin = others[0].second;
      out.distance[at] = static_cast<float>(Deviations(cloud, own, twin, turn));
      out.turn[at] = static_cast<float>(TurnBetween(cloud, own, twin));
      double most = 0;
      for (size_t c = 0; c < 3; ++c) {
        most = std::max(most, std::abs(double{cloud.sh[3 * own + c]} - double{cloud.sh[3 * twin + c]}));
      }
      out.color[at] = static_cast<float>(most);
      out.opacity[at] = std::abs(std::clamp(cloud.opacity_logits[own], -10.0f, 10.0f) -
                                 std::clamp(cloud.opacity_logits[twin], -10.0f, 10.0f));
      if (whole.sh_degree >= 2) {
        out.harmonics[at] = static_cast<float>(LikenessOfHarmonics(whole, visible.rows[own], visible.rows[twin]));
      }
    }
  });
  return out;
}

// The values that are not NaN, sorted.
std::span<float> Known(Buffer<float>& values) {
  std::erase_if(values, [](float x) { return !std::isfinite(x); });
  std::ranges::sort(values);
  return values;
}

void AddNeighbours(Neighbours neighbours, Row& row) {
  const auto log = [](double x) { return std::log(x + kLeastDifference); };
  for (size_t rank = 0; rank < 3; ++rank) {
    const auto values = Known(neighbours.difference[rank]);
    for (const double q : {0.1, 0.25, 0.5, 0.75, 0.9}) {
      row.Add(Cat("twin.difference", rank, ".", q), log(SortedQuantile(values, q)));
    }
  }
  const auto add = [&](std::string_view name, Buffer<float>& values) {
    const auto known = Known(values);
    for (const double q : {0.1, 0.25, 0.5, 0.75}) row.Add(Cat("twin.", name, ".", q), log(SortedQuantile(known, q)));
  };
  add("distance", neighbours.distance);
  add("color", neighbours.color);
  add("opacity", neighbours.opacity);
  add("turn", neighbours.turn);
  const auto harmonics = Known(neighbours.harmonics);
  for (const double q : {0.25, 0.5, 0.75}) row.Add(Cat("twin.harmonics.", q), SortedQuantile(harmonics, q));
  for (auto& [name, values] : {std::pair("side", &neighbours.side), std::pair("wide", &neighbours.wide)}) {
    const auto known = Known(*values);
    for (const double q : {0.1, 0.25, 0.5, 0.75, 0.9}) {
      row.AddLogLength(Cat("near.", name, ".", q), SortedQuantile(known, q));
    }
  }
  const auto own = Known(neighbours.own);
  for (const double q : {0.1, 0.5, 0.9}) row.Add(Cat("near.own.", q), SortedQuantile(own, q));
}

// Standard deviations along the principal axes, relative to the largest.
void AddShape(const GaussianCloud& visible, Row& row) {
  std::array<double, 3> mean{};
  std::array<double, 6> moments{};
  const auto count = static_cast<double>(std::max<int64_t>(1, visible.size()));
  for (int64_t i = 0; i < visible.size(); ++i) {
    for (size_t a = 0; a < 3; ++a) mean[a] += double{visible.means[static_cast<size_t>(3 * i) + a]} / count;
  }
  for (int64_t i = 0; i < visible.size(); ++i) {
    std::array<double, 3> d;
    for (size_t a = 0; a < 3; ++a) d[a] = double{visible.means[static_cast<size_t>(3 * i) + a]} - mean[a];
    const std::array<double, 6> products = {d[0] * d[0], d[0] * d[1], d[0] * d[2],
                                            d[1] * d[1], d[1] * d[2], d[2] * d[2]};
    for (size_t k = 0; k < 6; ++k) moments[k] += products[k] / count;
  }
  std::array<double, 3> variances = EllipsoidOf(moments).variances;
  std::ranges::sort(variances);
  const double most = std::max(variances[2], 1e-30);
  row.Add("shape.thickness", 0.5 * std::log(variances[0] / most + 1e-6));
  row.Add("shape.width", 0.5 * std::log(variances[1] / most + 1e-6));
}

void AddPictures(const SplatPictures& pictures, Row& row) {
  for (size_t k = 0; k < SplatPictures::kSizes; ++k) {
    const SplatPictures::AtSize& at = pictures.sizes[k];
    const std::string name = Cat("outline[", static_cast<int>(k) - SplatPictures::kOctaves, "]");
    for (size_t j = 0; j < kOutlineValues; ++j) row.Add(Cat(name, ".classic", j), at.classic[j]);
    for (size_t j = 0; j < kOutlineValues && k % 2 == 1; ++j) {
      row.Add(Cat(name, ".antialiased", j), at.antialiased[j]);
    }
    row.Add(name + ".cut", at.cut);
    row.Add(name + ".coarse", at.coarse);
  }
  for (size_t k = 0; k < SplatPictures::kDetails; ++k) {
    row.Add(Cat("detail.luminance", k), pictures.of_luminance[k]);
    row.Add(Cat("detail.alpha", k), pictures.of_alpha[k]);
  }
}

void AddAll(const CloudView& whole, const VisibleGaussians& visible, const SplatPictures& pictures, Gaussians sample,
            Neighbours neighbours, Row& row) {
  AddFile(whole, row);
  AddCounts(visible, row);
  AddSizes(sample, row);
  AddAxes(sample, row);
  AddOpacityBySize(sample, row);
  AddColorsAndTurns(whole, visible, row);
  AddNeighbours(std::move(neighbours), row);
  AddShape(visible.cloud, row);
  AddPictures(pictures, row);
}

}  // namespace

const std::vector<std::string>& FeatureNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> out;
    Row row(out);
    AddAll({}, {}, {}, {}, {}, row);
    return out;
  }();
  return names;
}

namespace {

// `unit`: the sample's if not given.
Result<SplatFeatures> Measure(const CloudView& whole, const VisibleGaussians& visible, std::optional<double> unit,
                              bool with_pictures) {
  if (visible.cloud.size() < kMinGaussians) {
    return Error{ErrorCode::kBadArgument, Cat("fewer than ", kMinGaussians, " visible, small Gaussians")};
  }
  LeaveIfAbandoned();
  Gaussians sample = SampleOf(visible.cloud);
  SplatFeatures features{unit.value_or(SmallSize(sample)), {}, {}};
  if (!(features.unit > 0) || !std::isfinite(features.unit)) {
    return Error{ErrorCode::kBadArgument, "the visible Gaussians have zero size"};
  }
  LeaveIfAbandoned();
  Neighbours neighbours = NeighboursOf(whole, visible);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SplatPictures pictures,
                               with_pictures ? MeasurePictures(visible.central, features.unit) : UnknownPictures());
  Row row(features.values, features.unit);
  AddAll(whole, visible, pictures, std::move(sample), std::move(neighbours), row);
  return features;
}

// Of the places that can be measured.
std::vector<SplatFeatures> FeaturesOfPlaces(const CloudView& whole, const VisibleGaussians& visible) {
  const SplatPlaces places(visible.cloud);
  std::vector<std::optional<SplatFeatures>> found(static_cast<size_t>(places.count()));
  ParallelFor(0, places.count(), 1, [&](int64_t place, int64_t) {
    std::vector<int64_t> rows = places.rows(place);
    for (int64_t& row : rows) row = visible.rows[static_cast<size_t>(row)];
    auto features = FeaturesOfPlace(whole, rows);
    if (features.ok()) found[static_cast<size_t>(place)] = *std::move(features);
  });
  std::vector<SplatFeatures> out;
  for (auto& features : found) {
    if (features) out.push_back(*std::move(features));
  }
  return out;
}

}  // namespace

Result<SplatFeatures> FeaturesOfPlace(const CloudView& whole, std::span<const int64_t> rows) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud place, Subset(whole, rows));
  return Measure(place, FindVisibleGaussians(place), {}, /*with_pictures=*/false);
}

Result<SplatFeatures> FeaturesOf(const CloudView& whole, const VisibleGaussians& visible) {
  std::vector<SplatFeatures> places = FeaturesOfPlaces(whole, visible);
  std::optional<double> unit;
  if (places.size() > 1) {
    Buffer<float> log_units;
    for (const SplatFeatures& place : places) log_units.push_back(static_cast<float>(std::log(place.unit)));
    unit = std::exp(double{Quantile(log_units, 0.5)});
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(SplatFeatures features, Measure(whole, visible, unit, /*with_pictures=*/true));
  features.places = std::move(places);
  return features;
}

Result<SplatFeatures> FeaturesOf(const CloudView& whole) { return FeaturesOf(whole, FindVisibleGaussians(whole)); }

}  // namespace anchorsplat
