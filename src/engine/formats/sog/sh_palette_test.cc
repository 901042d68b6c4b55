#include "formats/sog/sh_palette.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "formats/random_cloud_for_test.h"
#include "formats/sog/clustered_cloud_for_test.h"
#include "formats/sog/nearest_centroid.h"

namespace anchorsplat {
namespace {

double Distortion(const GaussianCloud& cloud, const ShPalette& palette) {
  const int64_t width = cloud.sh_stride() - 3;
  double sum = 0;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    for (int64_t k = 0; k < width; ++k) {
      sum += std::pow(cloud.sh[static_cast<size_t>(i * cloud.sh_stride() + 3 + k)] -
                          palette.centroids[static_cast<size_t>(palette.labels[static_cast<size_t>(i)] * width + k)],
                      2);
    }
  }
  return sum;
}

// Ten rounds of k-means over all centroids from random vectors, as slow as it gets.
ShPalette PlainKMeans(const GaussianCloud& cloud, int64_t entries) {
  const int64_t width = cloud.sh_stride() - 3;
  ShPalette palette;
  palette.entries = entries;
  palette.centroids.resize(static_cast<size_t>(entries * width));
  palette.labels.resize(static_cast<size_t>(cloud.size()));
  Random random(99);
  for (int64_t c = 0; c < entries; ++c) {
    std::copy_n(cloud.sh.data() + random.Below(cloud.size()) * cloud.sh_stride() + 3, width,
                palette.centroids.data() + c * width);
  }
  for (int round = 0; round <= 10; ++round) {
    std::vector<double> sums(palette.centroids.size()), counts(static_cast<size_t>(entries));
    for (int64_t i = 0; i < cloud.size(); ++i) {
      const float* x = cloud.sh.data() + i * cloud.sh_stride() + 3;
      double best = std::numeric_limits<double>::infinity();
      for (int64_t c = 0; c < entries; ++c) {
        double distance = 0;
        for (int64_t k = 0; k < width; ++k) {
          distance += std::pow(x[k] - palette.centroids[static_cast<size_t>(c * width + k)], 2);
        }
        if (distance < best) {
          best = distance;
          palette.labels[static_cast<size_t>(i)] = static_cast<uint16_t>(c);
        }
      }
      const auto label = int64_t{palette.labels[static_cast<size_t>(i)]};
      ++counts[static_cast<size_t>(label)];
      for (int64_t k = 0; k < width; ++k) sums[static_cast<size_t>(label * width + k)] += x[k];
    }
    if (round == 10) break;
    for (size_t k = 0; k < sums.size(); ++k) {
      const double count = counts[k / static_cast<size_t>(width)];
      if (count > 0) palette.centroids[k] = static_cast<float>(sums[k] / count);
    }
  }
  return palette;
}

TEST(ShPalette, AsGoodAsPlainKMeans) {
  for (int degree = 1; degree <= 2; ++degree) {
    const GaussianCloud cloud = Clustered(6000, degree, 7);
    const ShPalette plain = PlainKMeans(cloud, 512);
    const ShPalette ours = BuildShPalette(cloud, 512, 8);
    EXPECT_EQ(ours.entries, 512);
    EXPECT_LT(Distortion(cloud, ours), 1.05 * Distortion(cloud, plain)) << degree;
  }
}

TEST(ShPalette, RoundsImproveAndThreadsDoNotMatter) {
  const GaussianCloud cloud = Clustered(20'000, 3, 5);
  const ShPalette start = BuildShPalette(cloud, 1024, 0);
  SetThreadCount(1);
  const ShPalette one = BuildShPalette(cloud, 1024, 3);
  SetThreadCount(3);
  const ShPalette three = BuildShPalette(cloud, 1024, 3);
  SetThreadCount(0);
  EXPECT_LT(Distortion(cloud, one), 0.99 * Distortion(cloud, start));
  EXPECT_TRUE(SameBits(one.centroids, three.centroids));
  EXPECT_EQ(one.labels, three.labels);
}

TEST(ShPalette, EnoughEntriesKeepEverything) {
  GaussianCloud cloud = RandomCloud(300, 3, 5);
  const ShPalette palette = BuildShPalette(cloud, 1024, 2);
  EXPECT_EQ(palette.entries, 300);
  EXPECT_LT(std::sqrt(Distortion(cloud, palette) / (300 * 45)), 0.002);  // twelve bits
  std::fill(cloud.sh.begin(), cloud.sh.end(), 0.25f);
  cloud.sh[5] = std::nanf("");
  cloud.sh[53] = std::numeric_limits<float>::infinity();
  const ShPalette flat = BuildShPalette(cloud, 1024, 2);
  EXPECT_LE(flat.entries, 3);
  for (const float x : flat.centroids) EXPECT_TRUE(std::isfinite(x));
  std::fill(cloud.sh.begin(), cloud.sh.end(), 0.0f);
  EXPECT_EQ(BuildShPalette(cloud, 1024, 2).entries, 1);
}

TEST(NearestCentroids, MatchesTheDefinition) {
  Random random(3);
  for (const int64_t width : {16, 32, 48}) {
    for (const int64_t entries : {1, 7, 300}) {
      std::vector<int16_t> points(static_cast<size_t>(50 * width)), centroids(static_cast<size_t>(entries * width));
      for (auto* some : {&points, &centroids}) {
        for (int16_t& x : *some) x = static_cast<int16_t>(random.Below(4095) - 2047);
      }
      std::copy_n(centroids.begin(), width, points.begin());
      std::vector<uint16_t> nearest(50);
      NearestCentroids(points.data(), 50, centroids.data(), entries, width, nearest.data());
      for (size_t i = 0; i < 50; ++i) {
        int64_t best = std::numeric_limits<int64_t>::max(), expected = 0;
        for (int64_t c = 0; c < entries; ++c) {
          int64_t distance = 0;
          for (int64_t k = 0; k < width; ++k) {
            const int64_t d = points[i * static_cast<size_t>(width) + static_cast<size_t>(k)] -
                              centroids[static_cast<size_t>(c * width + k)];
            distance += d * d;
          }
          if (distance < best) {
            best = distance;
            expected = c;
          }
        }
        EXPECT_EQ(nearest[i], expected);
      }
      EXPECT_EQ(nearest[0], 0);
    }
  }
}

}  // namespace
}  // namespace anchorsplat
