#include "formats/streamed_sog/coarser_cloud.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <vector>

#include "core/activations.h"
#include "core/framing.h"
#include "core/parallel.h"
#include "core/rotation.h"
#include "core/source_dir_for_test.h"
#include "core/statistics.h"
#include "formats/cloud_io.h"
#include "formats/convert.h"
#include "formats/random_cloud_for_test.h"
#include "render/rasterizer.h"

namespace anchorsplat {
namespace {

// A Gaussian as the formulas have it, written from them.
struct Plain {
  std::array<double, 3> mean{};
  std::array<std::array<double, 3>, 3> covariance{};
  double surface = 0, opacity = 0;
};

Plain PlainOf(const GaussianCloud& cloud, size_t i) {
  Plain out;
  const float* q = cloud.quats.data() + 4 * i;
  const auto r = RotationFromQuaternion<double>(q[0], q[1], q[2], q[3]);
  double length[3];
  for (size_t k = 0; k < 3; ++k) {
    out.mean[k] = cloud.means[3 * i + k];
    length[k] = std::exp(double{cloud.log_scales[3 * i + k]});
  }
  for (size_t a = 0; a < 3; ++a) {
    for (size_t b = 0; b < 3; ++b) {
      for (size_t k = 0; k < 3; ++k) out.covariance[a][b] += r[3 * a + k] * r[3 * b + k] * length[k] * length[k];
    }
  }
  const double p = 1.6075, x = length[0], y = length[1], z = length[2];
  out.surface =
      4 * std::numbers::pi * std::pow((std::pow(x * y, p) + std::pow(x * z, p) + std::pow(y * z, p)) / 3, 1 / p);
  out.opacity = 1 / (1 + std::exp(-double{cloud.opacity_logits[i]}));
  return out;
}

TEST(CoarserCloud, APairKeepsItsMoments) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    GaussianCloud two = RandomCloud(2, 2, seed);
    for (float& logit : two.opacity_logits) logit -= 4;  // there is room for both in one opacity
    const Plain a = PlainOf(two, 0), b = PlainOf(two, 1);
    const double w1 = a.opacity * a.surface, w2 = b.opacity * b.surface, p = w1 / (w1 + w2);
    const GaussianCloud one = CoarsenCloud(two, 1);
    ASSERT_EQ(one.size(), 1);
    const Plain c = PlainOf(one, 0);
    double size = 0;
    for (size_t k = 0; k < 3; ++k) size += c.covariance[k][k];
    for (size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(c.mean[i], p * a.mean[i] + (1 - p) * b.mean[i], 1e-5) << seed;
      for (size_t j = 0; j < 3; ++j) {
        const double expected = p * (a.covariance[i][j] + (a.mean[i] - c.mean[i]) * (a.mean[j] - c.mean[j])) +
                                (1 - p) * (b.covariance[i][j] + (b.mean[i] - c.mean[i]) * (b.mean[j] - c.mean[j]));
        EXPECT_NEAR(c.covariance[i][j], expected, 1e-5 * size) << seed << " " << i << j;
      }
    }
    EXPECT_NEAR(c.opacity * c.surface, w1 + w2, 1e-4 * (w1 + w2)) << seed;
    for (size_t k = 0; k < 27; ++k) {
      EXPECT_NEAR(one.sh[k], p * double{two.sh[k]} + (1 - p) * double{two.sh[27 + k]}, 1e-5) << seed;
    }
  }
}

TEST(CoarserCloud, OpaqueNeighboursGrowInsteadOfLeavingGaps) {
  GaussianCloud two;
  two.Resize(2, 0);
  two.means = {0, 0, 0, 1, 0, 0};
  two.log_scales.assign(6, 0.0f);
  two.quats = {1, 0, 0, 0, 1, 0, 0, 0};
  two.opacity_logits = {20, 20};
  two.sh.assign(6, 0.5f);
  const GaussianCloud one = CoarsenCloud(two, 1);
  const double middle = one.log_scales[0] + one.log_scales[1] + one.log_scales[2];
  EXPECT_NEAR(middle, 0.5 * std::log(1.25) + 3 * std::log(1.2), 1e-5);  // variances 1, 1, 1 + 1/4; a fifth longer
  EXPECT_GT(one.opacity_logits[0], 13);
}

TEST(CoarserCloud, ThoseThatStayKeepTheirBitsAndTheirOrder) {
  const GaussianCloud cloud = RandomCloud(500, 1, 3);
  for (const int64_t target : {500, 499, 400, 17, 1}) {
    const GaussianCloud coarser = CoarsenCloud(cloud, target);
    ASSERT_EQ(coarser.size(), target);
    EXPECT_EQ(CountUnusable(coarser), 0);
    int64_t same = 0, at = 0;
    for (int64_t i = 0; i < target; ++i) {
      const auto equals = [&](int64_t j) {
        return std::equal(coarser.sh.begin() + 12 * i, coarser.sh.begin() + 12 * (i + 1), cloud.sh.begin() + 12 * j) &&
               std::equal(coarser.quats.begin() + 4 * i, coarser.quats.begin() + 4 * (i + 1),
                          cloud.quats.begin() + 4 * j);
      };
      int64_t j = at;
      while (j < cloud.size() && !equals(j)) ++j;
      if (j == cloud.size()) continue;
      ++same;
      at = j + 1;
    }
    EXPECT_GE(same, 2 * target - cloud.size()) << target;  // each merging takes two and gives one
  }
}

TEST(CoarserCloud, SameBitsForAnyNumberOfThreads) {
  const GaussianCloud cloud = RandomCloud(5000, 2, 4);
  SetThreadCount(1);
  const GaussianCloud one = CoarsenCloud(cloud, 1250);
  SetThreadCount(5);
  const GaussianCloud five = CoarsenCloud(cloud, 1250);
  SetThreadCount(0);
  ExpectSameCloud(one, five);
}

TEST(CoarserCloud, FlatFaintAndCoincidentOnes) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  GaussianCloud cloud = RandomCloud(300, 0, 5);
  for (size_t i = 0; i < 100; ++i) cloud.log_scales[3 * i] = -kInfinity;
  for (size_t i = 50; i < 150; ++i) cloud.opacity_logits[i] = i % 2 == 0 ? kInfinity : -kInfinity;
  for (size_t i = 0; i < 3 * 120; ++i) cloud.means[i] = 1;                      // 120 at one place
  for (size_t i = 3 * 200; i < 3 * 210; ++i) cloud.log_scales[i] = -kInfinity;  // points
  for (size_t i = 3 * 220; i < 3 * 223; ++i) cloud.log_scales[i] = 40;
  for (size_t i = 3 * 230; i < 3 * 233; ++i) cloud.means[i] = i % 2 == 0 ? 1e30f : -1e30f;
  for (size_t i = 4 * 240; i < 4 * 243; ++i) cloud.quats[i] = 0;
  ASSERT_EQ(CountUnusable(cloud), 0);
  for (const int64_t target : {100, 3, 1}) {
    const GaussianCloud coarser = CoarsenCloud(cloud, target);
    EXPECT_EQ(coarser.size(), target);
    EXPECT_EQ(CountUnusable(coarser), 0) << target;
  }
}

double PsnrOf(const Image& a, const Image& b) {
  double squares = 0;
  for (size_t i = 0; i < a.pixels.size(); ++i) {
    const double d = std::clamp(a.pixels[i], 0.0f, 1.0f) - std::clamp(b.pixels[i], 0.0f, 1.0f);
    squares += d * d;
  }
  return -10 * std::log10(squares / static_cast<double>(a.pixels.size()));
}

Image Averaged(const Image& image, int times) {
  Image out = image;
  out.width /= times;
  out.height /= times;
  out.pixels.assign(
      static_cast<size_t>(out.width) * static_cast<size_t>(out.height) * static_cast<size_t>(out.channels), 0);
  for (size_t i = 0; i < image.pixels.size(); ++i) {
    const auto w = static_cast<size_t>(image.width), h = static_cast<size_t>(image.height);
    const size_t x = i % w / static_cast<size_t>(times), y = i / w % h / static_cast<size_t>(times), c = i / w / h;
    out.pixels[(c * static_cast<size_t>(out.height) + y) * static_cast<size_t>(out.width) + x] +=
        std::clamp(image.pixels[i], 0.0f, 1.0f) / static_cast<float>(times * times);
  }
  return out;
}

// Twice as far away with each level, so that the object covers half the pixels per side: here by a smaller picture.
TEST(CoarserCloud, LooksLikeTheFinestFromFarAway) {
  constexpr int kSide = 400;
  const auto finest = ReadCloud(SourceDirForTest() / "examples/biplane/input.ply");
  ASSERT_TRUE(finest.ok());
  const Framing framing = FrameCloud(*finest);
  GaussianCloud level = *finest;
  // dB against the finest as it is drawn at that size, which is thicker than it is, and against its average.
  constexpr struct { double drawn, averaged, over_pruned; } kLeast[] = {{30, 31.5, 8}, {25.5, 27, 8}, {21.5, 24, 6}};
  for (int number = 1; number <= 3; ++number) {
    level = CoarsenCloud(level, (level.size() + 3) / 4);
    GaussianCloud pruned = *finest;
    KeepMostImportant(pruned, level.size());
    const auto picture = [&](const GaussianCloud& cloud, int side) {
      Camera camera;
      camera.intrinsics = PinholeFromFov(side, side, 0.8);
      const double distance = FramingDistance(framing, camera.intrinsics);
      std::array<double, 3> eye = framing.target;
      eye[0] += 0.6 * distance;
      eye[1] -= 0.5 * distance;
      eye[2] += 0.62 * distance;
      camera.world_to_camera = *LookAt(eye, framing.target, {0, -1, 0});
      Rasterizer rasterizer;
      RenderOutput output;
      EXPECT_TRUE(rasterizer.Render(cloud, camera, {}, output).ok());
      return output.color;
    };
    const int side = kSide >> number;
    const Image coarse = picture(level, side), fine = picture(*finest, side);
    const Image truth = Averaged(picture(*finest, kSide), 1 << number);
    const double drawn = PsnrOf(fine, coarse), averaged = PsnrOf(truth, coarse), too_thick = PsnrOf(truth, fine);
    const double dropped = PsnrOf(fine, picture(pruned, side));
    std::printf(
        "level %d, %lld Gaussians at %d px: %.2f dB to the finest (the most important alone %.2f); to its average %.2f "
        "(the finest %.2f)\n",
        number, static_cast<long long>(level.size()), side, drawn, dropped, averaged, too_thick);
    EXPECT_GT(averaged, too_thick - (number == 1 ? 1 : 0));
    EXPECT_GT(drawn, kLeast[number - 1].drawn);
    EXPECT_GT(averaged, kLeast[number - 1].averaged);
    EXPECT_GT(drawn - dropped, kLeast[number - 1].over_pruned);
  }
}

}  // namespace
}  // namespace anchorsplat
