#include "viewer/quantized_cloud.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/statistics.h"

namespace anchorsplat {
namespace {

constexpr int64_t kGrain = 1 << 14;
// Range of log-scales: a Gaussian e³² times smaller than the largest is a point in any view. Log-scale −Inf ends up
// there.
constexpr double kLogScaleSpan = 32;
constexpr double kLargestLogScaleOfSpread = 20;
// Limit of SH coefficients, colours ±5 beyond black and white: a broken file's 1e30 must not cost precision.
constexpr double kCoefficientLimit = 16;
constexpr double kFloatMax = std::numeric_limits<float>::max();

uint32_t LinearCode(double value, double low, double high, int bits) {
  const double top = static_cast<double>((1u << bits) - 1);
  if (!(high > low)) return 0;
  return static_cast<uint32_t>(std::lround(std::clamp((value - low) / (high - low), 0.0, 1.0) * top));
}

// Encodes a quaternion (wxyz): 2 bits for the index of the largest component, then the others in order, 10 bits each
// over ±1/√2, the maximum beside a larger one. As q and −q are the same rotation, the largest is made positive.
uint32_t RotationCode(const float* wxyz) {
  std::array<double, 4> q{};
  double largest_magnitude = 0;
  for (size_t k = 0; k < 4; ++k) {
    q[k] = wxyz[k];
    largest_magnitude = std::max(largest_magnitude, std::abs(q[k]));
  }
  if (!(largest_magnitude > 0)) q = {1, 0, 0, 0};  // as in core/rotation.h
  double norm = 0;
  for (double c : q) norm += c * c;  // in double, so that squares of floats neither overflow nor underflow
  norm = std::sqrt(norm);
  size_t largest = 0;
  for (size_t k = 1; k < 4; ++k) {
    if (std::abs(q[k]) > std::abs(q[largest])) largest = k;
  }
  const double sign = q[largest] < 0 ? -1 : 1;
  uint32_t code = static_cast<uint32_t>(largest) << 30;
  int shift = 20;
  for (size_t k = 0; k < 4; ++k) {
    if (k == largest) continue;
    code |= LinearCode(sign * q[k] / norm, -std::sqrt(0.5), std::sqrt(0.5), 10) << shift;
    shift -= 10;
  }
  return code;
}

uint8_t HarmonicCode(double value, double max) {
  if (!(max > 0)) return 0;
  const double t = std::sqrt(std::min(std::abs(value) / max, 1.0));
  const auto code = static_cast<int>(std::lround(t * kHarmonicTop));
  return static_cast<uint8_t>(static_cast<int8_t>(value < 0 ? -code : code));
}

// Spreads `v`'s lowest ten bits to every third bit.
uint32_t SpreadBits(uint32_t v) {
  v = (v | v << 16) & 0x030000FF;
  v = (v | v << 8) & 0x0300F00F;
  v = (v | v << 4) & 0x030C30C3;
  return (v | v << 2) & 0x09249249;
}

struct MeanCode {
  const QuantizedCloud& q;
  uint32_t operator()(float x, size_t axis) const {
    return LinearCode(std::asinh((static_cast<double>(x) - q.center[axis]) / q.spread), -q.reach, q.reach, kMeanBits);
  }
};

// QuantizedCloud::radius, from a sample of Gaussians.
double RadiusOf(const CloudView& cloud, const std::vector<int64_t>& rows, const QuantizedCloud& q) {
  constexpr size_t kSample = 20'000;
  const size_t step = (rows.size() + kSample - 1) / kSample;
  std::vector<float> distances;
  for (size_t n = 0; n < rows.size(); n += step) {
    double most = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
      const double x = cloud.means[static_cast<size_t>(3 * rows[n]) + axis];
      most = std::max(most, std::abs(x - q.center[axis]));
    }
    distances.push_back(static_cast<float>(std::min(most, kFloatMax)));
  }
  const double largest = Quantile(distances, 1);
  const double radius = std::min(1.25 * Quantile(distances, 0.9), 3.0 * Quantile(distances, 0.5));
  return radius > 0 ? radius : largest > 0 ? largest : 1;
}

// Measures centre and spread of the Gaussians at `rows`.
void MeasureMeans(const CloudView& cloud, const std::vector<int64_t>& rows, QuantizedCloud& q) {
  std::vector<float> values(rows.size());
  double largest = 0;
  q.spread = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    const auto coordinate = [&](int64_t row) { return cloud.means[static_cast<size_t>(3 * row) + axis]; };
    std::transform(rows.begin(), rows.end(), values.begin(), coordinate);
    const float median = Quantile(values, 0.5);
    q.center[axis] = std::isfinite(median) ? median : 0;  // the mean of ±3e38 is beyond float
    for (float& v : values) {
      const double distance = std::abs(static_cast<double>(v) - q.center[axis]);
      largest = std::max(largest, distance);
      v = static_cast<float>(std::min(distance, kFloatMax));
    }
    q.spread = std::max(q.spread, static_cast<double>(Quantile(values, 0.9)));
  }
  if (!(q.spread > 0) || !std::isfinite(q.spread)) q.spread = largest > 0 ? largest : 1;
  q.reach = std::asinh(largest / q.spread);
  q.radius = RadiusOf(cloud, rows, q);
}

void MeasureRanges(const CloudView& cloud, const std::vector<int64_t>& rows, QuantizedCloud& q) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  q.log_scale = {kInfinity, -kInfinity};
  q.dc = {kInfinity, -kInfinity};
  const auto stride = static_cast<size_t>(cloud.sh_stride());
  double smallest = kInfinity;  // smallest of the longest axes
  for (const int64_t row : rows) {
    if (!IsDrawn(cloud, row)) continue;
    const auto i = static_cast<size_t>(row);
    const float* scales = cloud.log_scales.data() + 3 * i;
    smallest = std::min(smallest, double{std::max({scales[0], scales[1], scales[2]})});
    for (size_t k = 0; k < 3; ++k) {
      const double s = cloud.log_scales[3 * i + k];
      if (std::isfinite(s)) q.log_scale = {std::min(q.log_scale[0], s), std::max(q.log_scale[1], s)};
      const double c = std::clamp<double>(cloud.sh[stride * i + k], -kCoefficientLimit, kCoefficientLimit);
      q.dc = {std::min(q.dc[0], c), std::max(q.dc[1], c)};
    }
    for (int degree = 1; degree <= q.sh_degree; ++degree) {
      double& max = q.sh_max[static_cast<size_t>(degree - 1)];
      const auto first = static_cast<size_t>(3 * ShCoefficients(degree - 1));
      const auto last = static_cast<size_t>(3 * ShCoefficients(degree));
      for (size_t k = first; k < last; ++k) {
        max = std::max(max, std::min(std::abs(static_cast<double>(cloud.sh[stride * i + k])), kCoefficientLimit));
      }
    }
  }
  if (!std::isfinite(q.log_scale[1])) q.log_scale = {-kLogScaleSpan, -kLogScaleSpan};  // only points
  if (!std::isfinite(q.dc[1])) q.dc = {0, 0};                                          // nothing is drawn
  // A Gaussian longer than this is a uniform veil over everything at any length, and must not cost precision.
  q.log_scale[1] = std::min(q.log_scale[1], std::max(std::log(q.spread), smallest) + kLargestLogScaleOfSpread);
  q.log_scale[0] = std::max(q.log_scale[0], q.log_scale[1] - kLogScaleSpan);
}

}  // namespace

Result<MeasuredCloud> MeasureCloud(const CloudView& cloud, int max_sh_degree) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  MeasuredCloud measured;
  auto& [q, rows] = measured;
  q.sh_degree = std::clamp(max_sh_degree, 0, cloud.sh_degree);
  rows.reserve(static_cast<size_t>(cloud.size()));
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (IsUsable(cloud, i)) rows.push_back(i);
  }
  q.count = static_cast<int64_t>(rows.size());
  q.left_out = cloud.size() - q.count;
  if (rows.empty()) {
    return Error{ErrorCode::kBadArgument, "a splat without a single usable Gaussian cannot be shown in a page"};
  }
  MeasureMeans(cloud, rows, q);
  MeasureRanges(cloud, rows, q);
  return measured;
}

std::vector<uint8_t> PlanesOf(const CloudView& cloud, const QuantizedCloud& q, std::span<const int64_t> rows) {
  const auto count = static_cast<int64_t>(rows.size());
  const MeanCode mean_code{q};
  std::vector<std::pair<uint32_t, int64_t>> order(
      rows.size());  // Morton key, row: a total order, so any sort is stable
  ParallelFor(0, count, kGrain, [&](int64_t first, int64_t last) {
    for (int64_t n = first; n < last; ++n) {
      uint32_t key = 0;
      for (size_t axis = 0; axis < 3; ++axis) {
        const float x = cloud.means[static_cast<size_t>(3 * rows[static_cast<size_t>(n)]) + axis];
        key |= SpreadBits(mean_code(x, axis) >> (kMeanBits - 10)) << axis;
      }
      order[static_cast<size_t>(n)] = {key, rows[static_cast<size_t>(n)]};
    }
  });
  std::sort(order.begin(), order.end());

  std::vector<uint8_t> planes(rows.size() * static_cast<size_t>(PlanesPerGaussian(q.sh_degree)));
  const auto stride = static_cast<size_t>(cloud.sh_stride());
  ParallelFor(0, count, kGrain, [&](int64_t first, int64_t last) {
    for (int64_t n = first; n < last; ++n) {
      const auto i = static_cast<size_t>(order[static_cast<size_t>(n)].second);
      uint8_t* plane = planes.data() + n;
      const auto put = [&](uint32_t byte) {
        *plane = static_cast<uint8_t>(byte);
        plane += count;
      };
      const auto put_scalar = [&](uint32_t code) {
        put(code >> (kScalarBits - 8));
        put(code & ((1u << (kScalarBits - 8)) - 1));
      };
      for (size_t axis = 0; axis < 3; ++axis) {
        const uint32_t code = mean_code(cloud.means[3 * i + axis], axis);
        put(code >> (kMeanBits - 8));
        put(code >> (kMeanBits - 16) & 255);
        put(code & ((1u << (kMeanBits - 16)) - 1));
      }
      for (size_t k = 0; k < 3; ++k) {
        put_scalar(LinearCode(cloud.log_scales[3 * i + k], q.log_scale[0], q.log_scale[1], kScalarBits));
      }
      put_scalar(LinearCode(Sigmoid(double{cloud.opacity_logits[i]}), 0, 1, kScalarBits));
      for (size_t k = 0; k < 3; ++k) {
        put_scalar(LinearCode(cloud.sh[stride * i + k], q.dc[0], q.dc[1], kScalarBits));
      }
      const uint32_t rotation = RotationCode(&cloud.quats[4 * i]);
      for (int shift = 0; shift < 32; shift += 8) put(rotation >> shift & 255);
      for (int degree = 1; degree <= q.sh_degree; ++degree) {
        const double max = q.sh_max[static_cast<size_t>(degree - 1)];
        const auto end = static_cast<size_t>(3 * ShCoefficients(degree));
        for (auto k = static_cast<size_t>(3 * ShCoefficients(degree - 1)); k < end; ++k) {
          put(HarmonicCode(cloud.sh[stride * i + k], max));
        }
      }
    }
  });
  return planes;
}

Result<QuantizedCloud> Quantize(const CloudView& cloud, int max_sh_degree) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(MeasuredCloud measured, MeasureCloud(cloud, max_sh_degree));
  measured.scale.planes = PlanesOf(cloud, measured.scale, measured.rows);
  return std::move(measured.scale);
}

}  // namespace anchorsplat
