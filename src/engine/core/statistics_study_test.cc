#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

#include "core/activations.h"
#include "core/framing.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/rank_search.h"
#include "core/statistics.h"

namespace anchorsplat {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
const float kNan = std::nanf("");

// What RankSearch finds of `values`, shown in pieces.
std::vector<float> Found(const std::vector<float>& values, std::span<const double> quantiles) {
  RankSearch search(quantiles);
  const size_t half = values.size() / 3;
  for (const auto& [first, last] : {std::pair(size_t{0}, half), std::pair(half, values.size())}) {
    std::vector<uint32_t> counts(RankSearch::kCoarse);
    for (size_t i = first; i < last; ++i) ++counts[RankSearch::CoarseBin(values[i])];
    search.Count(counts);
  }
  search.EndCounting();
  search.Refine(std::span(values).first(half));
  search.Refine(std::span(values).subspan(half));
  std::vector<float> out;
  for (size_t k = 0; k < quantiles.size(); ++k) {
    const RankSearch::Place at = search.At(k);
    EXPECT_FALSE(at.low < search.LowerBound(k) || at.high > search.UpperBound(k));
    out.push_back(at.fraction == 0 || at.low == at.high
                      ? at.low
                      : static_cast<float>(at.low + at.fraction * (double{at.high} - at.low)));
  }
  return out;
}

TEST(RankSearch, AgreesWithSorting) {
  const std::vector<double> quantiles = {0, 0.01, 0.25, 1.0 / 3, 0.5, 0.99, 1};
  Random random(3);
  std::vector<std::vector<float>> cases = {{7}, {2, -1}, {-0.0f, 0.0f, kInf, kInf}, std::vector<float>(1000, 0.25f)};
  for (const int64_t steps : {int64_t{5}, int64_t{1} << 40}) {  // with and without many equal ones
    std::vector<float> values(5000);
    for (float& x : values) x = static_cast<float>(random.Normal() * std::exp(3 * random.Normal()));
    for (float& x : values) x = std::round(x * static_cast<float>(steps)) / static_cast<float>(steps);
    cases.push_back(values);
  }
  for (std::vector<float> values : cases) {
    const std::vector<float> found = Found(values, quantiles);
    for (size_t k = 0; k < quantiles.size(); ++k) EXPECT_EQ(found[k], Quantile(values, quantiles[k])) << quantiles[k];
  }
  EXPECT_TRUE(std::isnan(Found({}, quantiles)[0]));
}

// The plain way to the same numbers.
CloudStatistics Reference(const CloudView& cloud) {
  CloudStatistics out;
  out.gaussians = cloud.size();
  out.sh_degree = cloud.sh_degree;
  GaussianCloud usable = CopyOf(cloud);
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (!IsUsable(cloud, i)) usable.means[static_cast<size_t>(3 * i)] = kNan;
  }
  out.bounds = ComputeBounds(usable);
  std::vector<float> largest, smallest, ratio, opacity;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (!IsUsable(cloud, i)) {
      ++out.not_finite;
      continue;
    }
    const auto row = static_cast<size_t>(i);
    const float* p = cloud.means.data() + 3 * i;
    const float* s = cloud.log_scales.data() + 3 * i;
    const float* q = cloud.quats.data() + 4 * i;
    const auto [low, high] = std::minmax({s[0], s[1], s[2]});
    double norm = 0;
    for (int k = 0; k < 4; ++k) norm += double{q[k]} * q[k];
    norm = std::sqrt(norm);
    out.zero_quaternions += norm == 0 ? 1 : 0;
    out.unnormalised_quaternions += norm > 0 && std::abs(norm - 1) > 0.01 ? 1 : 0;
    opacity.push_back(Sigmoid(cloud.opacity_logits[row]));
    out.invisible += opacity.back() < 1.0f / 255 ? 1 : 0;
    out.zero_scales += std::isfinite(low) ? 0 : 1;
    bool plausible = high <= std::log(kPlausibleExtent);
    for (int k = 0; k < 3; ++k) plausible &= std::fabs(p[k]) <= kPlausibleExtent;
    out.implausible += plausible ? 0 : 1;
    if (!std::isfinite(high)) continue;
    largest.push_back(std::exp(high));
    smallest.push_back(std::exp(low));
    if (std::isfinite(low)) ratio.push_back(std::exp(high - low));
  }
  for (size_t k = 0; k < kPercentiles.size(); ++k) {
    out.largest_axis[k] = Quantile(largest, kPercentiles[k]);
    out.smallest_axis[k] = Quantile(smallest, kPercentiles[k]);
    out.axis_ratio[k] = Quantile(ratio, kPercentiles[k]);
    out.opacity[k] = Quantile(opacity, kPercentiles[k]);
  }
  const Framing framing = FrameCloud(cloud);
  for (int64_t i = 0; i < cloud.size(); ++i) {
    out.outliers += IsUsable(cloud, i) && IsFarOut(framing, cloud.means.data() + 3 * i) ? 1 : 0;
  }
  return out;
}

void ExpectSame(const CloudStatistics& a, const CloudStatistics& b) {
  const auto counts = [](const CloudStatistics& s) {
    return std::tuple(s.gaussians, s.sh_degree, s.not_finite, s.zero_quaternions, s.unnormalised_quaternions,
                      s.zero_scales, s.invisible, s.outliers, s.implausible);
  };
  EXPECT_EQ(counts(a), counts(b));
  ASSERT_EQ(a.bounds.has_value(), b.bounds.has_value());
  if (a.bounds) {
    EXPECT_EQ(a.bounds->min, b.bounds->min);
    EXPECT_EQ(a.bounds->max, b.bounds->max);
  }
  EXPECT_EQ(a.largest_axis, b.largest_axis);
  EXPECT_EQ(a.smallest_axis, b.smallest_axis);
  EXPECT_EQ(a.axis_ratio, b.axis_ratio);
  EXPECT_EQ(a.opacity, b.opacity);
}

// With one of each kind of trouble here and there.
GaussianCloud CloudWithNonFinite(int64_t n, int degree) {
  GaussianCloud cloud;
  cloud.Resize(n, degree);
  Random random(static_cast<uint64_t>(n));
  for (float& x : cloud.means) x = static_cast<float>(random.Normal());
  for (float& x : cloud.log_scales) x = static_cast<float>(-4 + random.Normal());
  for (float& x : cloud.quats) x = static_cast<float>(random.Normal());
  for (float& x : cloud.opacity_logits) x = static_cast<float>(4 * random.Normal());
  for (float& x : cloud.sh) x = static_cast<float>(random.Normal());
  for (int64_t i = 0; i < n; i += 97) {
    const auto k = static_cast<size_t>(i);
    switch (i / 97 % 9) {
      case 0:
        cloud.means[3 * k + 1] = kNan;
        break;
      case 1:
        cloud.sh[cloud.sh.size() / cloud.opacity_logits.size() * (k + 1) - 1] = kInf;
        break;
      case 2:
        cloud.means[3 * k + 2] = static_cast<float>(100 * random.Normal());
        break;
      case 3:
        cloud.log_scales[3 * k] = -kInf;
        break;
      case 4:
        std::fill_n(cloud.log_scales.data() + 3 * k, 3, -kInf);
        break;
      case 5:
        std::fill_n(cloud.quats.data() + 4 * k, 4, 0.0f);
        break;
      case 6:
        cloud.opacity_logits[k] = i % 2 == 0 ? kInf : -kInf;
        break;
      case 7:
        cloud.means[3 * k] = -3e6f;
        break;
      default:
        cloud.log_scales[3 * k + 1] = kNan;
    }
  }
  return cloud;
}

TEST(StatisticsStudy, AgreesWithThePlainWay) {
  for (const auto& [n, degree] : {std::pair(int64_t{1}, 0), std::pair(int64_t{3}, 0), std::pair(int64_t{500}, 1),
                                  std::pair(3 * kCloudBlockRows + 17, 3)}) {
    const GaussianCloud cloud = CloudWithNonFinite(n, degree);
    const CloudStatistics expected = Reference(cloud);
    for (const int threads : {1, 3}) {
      SetThreadCount(threads);
      SCOPED_TRACE(testing::Message() << n << " Gaussians, threads " << threads);
      const CloudStatistics found = ComputeStatistics(cloud);
      // Of no numbers there are no percentiles, and NaN is not equal to itself.
      if (n > 1) ExpectSame(found, expected);
      EXPECT_EQ(found.not_finite, expected.not_finite);
    }
    SetThreadCount(0);
  }
}

TEST(FramingStudy, AgreesWithFrameCloud) {
  GaussianCloud haze = CloudWithNonFinite(200, 0);
  for (float& x : haze.opacity_logits) x = -5;
  GaussianCloud point = CloudWithNonFinite(50, 0);
  std::ranges::fill(point.means, 1.0f);
  for (const GaussianCloud& cloud :
       {CloudWithNonFinite(5000, 0), haze, point, CloudWithNonFinite(1'000'300, 0), GaussianCloud{}}) {
    MemoryBlocks blocks{CloudView(cloud)};
    FramingStudy study(cloud.size());
    ASSERT_TRUE(blocks.ForEach([&](const CloudBlock& block) { study.Visit(block.first, block.rows); }).ok());
    const Framing found = study.Find(), expected = FrameCloud(cloud);
    EXPECT_EQ(found.target, expected.target) << cloud.size();
    EXPECT_EQ(found.radius, expected.radius) << cloud.size();
  }
}

TEST(MemoryBlocks, ShowEachRowOnceWithoutItsHarmonics) {
  const GaussianCloud cloud = CloudWithNonFinite(2 * kCloudBlockRows + 5, 2);
  MemoryBlocks blocks{CloudView(cloud)};
  for (int pass = 0; pass < 2; ++pass) {
    std::vector<int> seen(static_cast<size_t>(cloud.size()));
    ASSERT_TRUE(blocks
                    .ForEach([&](const CloudBlock& block) {
                      for (int64_t i = 0; i < block.size(); ++i) {
                        const int64_t row = block.first + i;
                        ++seen[static_cast<size_t>(row)];
                        EXPECT_EQ(block.usable[static_cast<size_t>(i)] != 0, IsUsable(cloud, row));
                        EXPECT_EQ(block.rows.opacity_logits[static_cast<size_t>(i)],
                                  cloud.opacity_logits[static_cast<size_t>(row)]);
                        for (int64_t k = 0; k < 3; ++k) {
                          EXPECT_EQ(block.rows.sh[static_cast<size_t>(3 * i + k)],
                                    cloud.sh[static_cast<size_t>(row * cloud.sh_stride() + k)]);
                        }
                      }
                    })
                    .ok());
    EXPECT_EQ(std::ranges::count(seen, 1), cloud.size());
  }
}

}  // namespace
}  // namespace anchorsplat
