#include "viewer/quantized_cloud.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numeric>

#include "cameras/camera_io.h"
#include "core/rotation.h"
#include "core/source_dir_for_test.h"
#include "formats/cloud_io.h"
#include "render/rasterizer.h"
#include "viewer/dequantize.h"
#include "viewer/fitted_cloud.h"

namespace anchorsplat {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// A cloud whose rows can be told apart by x, and its rows in the order of x after a trip through the planes.
struct Trip {
  GaussianCloud original;
  GaussianCloud decoded;
  QuantizedCloud quantized;
};
Trip RoundTrip(int64_t n, int sh_degree) {
  Trip trip;
  trip.original = FittedLookingCloud(n, sh_degree, 7);
  for (int64_t i = 0; i < n; ++i) {
    trip.original.means[static_cast<size_t>(3 * i)] = static_cast<float>(i) / static_cast<float>(n);
  }
  trip.quantized = *Quantize(trip.original, 3);
  GaussianCloud decoded = Dequantize(trip.quantized);
  std::vector<int64_t> rows(static_cast<size_t>(n));
  std::iota(rows.begin(), rows.end(), 0);
  std::sort(rows.begin(), rows.end(), [&](int64_t a, int64_t b) {
    return decoded.means[static_cast<size_t>(3 * a)] < decoded.means[static_cast<size_t>(3 * b)];
  });
  trip.decoded = *Subset(decoded, rows);
  return trip;
}

double Opacity(float logit) { return 1 / (1 + std::exp(-static_cast<double>(logit))); }

// The angle that takes one rotation to the other, in radians.
double AngleBetween(const float* a, const float* b) {
  const auto r = RotationFromQuaternion<double>(a[0], a[1], a[2], a[3]);
  const auto s = RotationFromQuaternion<double>(b[0], b[1], b[2], b[3]);
  double squares = 0;
  for (size_t k = 0; k < 9; ++k) squares += (r[k] - s[k]) * (r[k] - s[k]);
  return 2 * std::asin(std::min(1.0, std::sqrt(squares / 8)));
}

TEST(QuantizedCloud, EveryValueComesBackWithinItsStep) {
  const Trip t = RoundTrip(2000, 3);
  const QuantizedCloud& q = t.quantized;
  const double top = (1 << kScalarBits) - 1;
  const double mean_step = 2 * q.reach * q.spread * std::cosh(q.reach) / ((1 << kMeanBits) - 1);
  for (size_t i = 0; i < t.original.means.size(); ++i) {
    ASSERT_NEAR(t.decoded.means[i], t.original.means[i], 0.51 * mean_step + 1e-7) << i;
    ASSERT_NEAR(t.decoded.log_scales[i], t.original.log_scales[i], 0.51 * (q.log_scale[1] - q.log_scale[0]) / top) << i;
  }
  for (size_t i = 0; i < t.original.opacity_logits.size(); ++i) {
    ASSERT_NEAR(Opacity(t.decoded.opacity_logits[i]), Opacity(t.original.opacity_logits[i]), 0.51 / top) << i;
    ASSERT_LT(AngleBetween(&t.decoded.quats[4 * i], &t.original.quats[4 * i]), 0.004) << i;
  }
  for (size_t i = 0; i < t.original.sh.size(); ++i) {
    const size_t k = i % 48;
    const double value = t.original.sh[i];
    if (k < 3) {
      ASSERT_NEAR(t.decoded.sh[i], value, 0.51 * (q.dc[1] - q.dc[0]) / top) << i;
    } else {
      // Around t the parabola m·t² is as steep as 2·m·t.
      const double max = q.sh_max[k < 12 ? 0 : k < 27 ? 1 : 2];
      const double half = 0.51 / kHarmonicTop;
      ASSERT_NEAR(t.decoded.sh[i], value, max * (2 * std::sqrt(std::abs(value) / max) * half + half * half)) << i;
    }
  }
}

TEST(QuantizedCloud, EverySmallestThreeCase) {
  GaussianCloud cloud = FittedLookingCloud(8, 0, 1);
  for (size_t i = 0; i < 8; ++i) {  // each component largest, once positive and once negative; any norm
    cloud.means[3 * i] = static_cast<float>(i);
    for (size_t k = 0; k < 4; ++k) {
      cloud.quats[4 * i + k] = (k == i / 2 ? 9.f : 1.5f + static_cast<float>(k)) * (i % 2 == 0 ? 1e-3f : -1e3f);
    }
  }
  const GaussianCloud decoded = Dequantize(*Quantize(cloud, 3));
  for (size_t i = 0; i < 8; ++i) {
    const auto row = static_cast<size_t>(std::lround(decoded.means[3 * i]));
    EXPECT_LT(AngleBetween(&decoded.quats[4 * i], &cloud.quats[4 * row]), 0.004) << row;
  }
}

TEST(QuantizedCloud, LowerDegreesAndFewerCoefficients) {
  for (int degree : {0, 1, 2, 3}) {
    const GaussianCloud cloud = FittedLookingCloud(50, 3, 3);
    const QuantizedCloud q = *Quantize(cloud, degree);
    EXPECT_EQ(q.sh_degree, degree);
    EXPECT_EQ(q.planes.size(), 50u * static_cast<size_t>(PlanesPerGaussian(degree)));
    EXPECT_EQ(Dequantize(q).sh.size(), 50u * 3u * static_cast<size_t>(ShCoefficients(degree)));
  }
}

TEST(QuantizedCloud, OneStrayGaussianCostsNobodyPrecision) {
  GaussianCloud cloud = FittedLookingCloud(1000, 0, 5);
  for (size_t i = 0; i < 1000; ++i) cloud.means[3 * i] = static_cast<float>(i) * 1e-3f;
  cloud.means[0] = -1e6f;
  const GaussianCloud decoded = Dequantize(*Quantize(cloud, 3));
  std::vector<float> x;
  for (size_t i = 0; i < 1000; ++i) x.push_back(decoded.means[3 * i]);
  std::sort(x.begin(), x.end());
  EXPECT_NEAR(x[0], -1e6, 100);
  for (size_t i = 1; i < 1000; ++i) ASSERT_NEAR(x[i], static_cast<float>(i) * 1e-3f, 4e-5) << i;
}

TEST(QuantizedCloud, OneVeilAndWhatIsNotDrawnCostNobodySize) {
  GaussianCloud cloud = FittedLookingCloud(1000, 0, 5);
  const std::array<double, 2> range = Quantize(cloud, 0)->log_scale;
  for (size_t k = 0; k < 3; ++k) cloud.log_scales[k] = 43;
  for (size_t k = 3; k < 6; ++k) cloud.log_scales[k] = 44.5f;
  for (size_t k = 6; k < 9; ++k) cloud.log_scales[k] = 30;
  cloud.opacity_logits[2] = -7;
  const QuantizedCloud q = *Quantize(cloud, 0);
  EXPECT_EQ(q.left_out, 1);
  EXPECT_LT(q.log_scale[1], 25);
  EXPECT_LT(q.log_scale[0], range[0] + 5);
}

TEST(QuantizedCloud, EdgesOfWhatACloudMayHold) {
  GaussianCloud cloud = FittedLookingCloud(6, 1, 9);
  std::fill(cloud.quats.begin(), cloud.quats.begin() + 4, 0.f);  // no rotation: the identity
  cloud.log_scales[4] = -kInfinity;                              // scale 0
  cloud.opacity_logits[1] = -kInfinity;                          // opacity 0
  cloud.means[6] = std::numeric_limits<float>::quiet_NaN();      // rows 2 and 3 are not drawn
  cloud.sh[3 * 12] = kInfinity;
  cloud.sh[4 * 12 + 5] = 1e30f;  // broken, but finite
  cloud.opacity_logits[5] = 1000;
  const QuantizedCloud q = *Quantize(cloud, 3);
  EXPECT_EQ(q.count, 4);
  EXPECT_EQ(q.left_out, 2);
  const GaussianCloud decoded = Dequantize(q);
  for (int64_t i = 0; i < decoded.size(); ++i) {
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(std::isfinite(decoded.means[static_cast<size_t>(3 * i + k)]));
  }
  EXPECT_EQ(*std::min_element(decoded.opacity_logits.begin(), decoded.opacity_logits.end()), -kInfinity);
  EXPECT_GT(*std::max_element(decoded.opacity_logits.begin(), decoded.opacity_logits.end()), 10);
  EXPECT_LE(q.log_scale[1] - q.log_scale[0], 32);
}

TEST(QuantizedCloud, AllAlikeAndFarAway) {
  GaussianCloud cloud = FittedLookingCloud(3, 0, 2);
  std::fill(cloud.means.begin(), cloud.means.end(), 4e5f);
  std::fill(cloud.log_scales.begin(), cloud.log_scales.end(), -3.f);
  std::fill(cloud.sh.begin(), cloud.sh.end(), 0.25f);
  GaussianCloud decoded = Dequantize(*Quantize(cloud, 3));
  for (float x : decoded.means) EXPECT_EQ(x, 4e5f);
  for (float s : decoded.log_scales) EXPECT_EQ(s, -3.f);
  for (float c : decoded.sh) EXPECT_EQ(c, 0.25f);

  for (size_t i = 0; i < 9; ++i) cloud.means[i] = i % 2 == 0 ? 3.4e38f : -3.4e38f;
  std::fill(cloud.log_scales.begin(), cloud.log_scales.end(), -kInfinity);
  decoded = Dequantize(*Quantize(cloud, 3));
  EXPECT_EQ(decoded.size(), 3);
  for (float s : decoded.log_scales) EXPECT_LE(s, -32);
}

TEST(QuantizedCloud, NothingToShowIsAnError) {
  EXPECT_EQ(Quantize(GaussianCloud{}, 3).error().code, ErrorCode::kBadArgument);
  GaussianCloud cloud = FittedLookingCloud(1, 0, 2);
  cloud.means[1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(Quantize(cloud, 3).error().code, ErrorCode::kBadArgument);
  cloud.quats.pop_back();
  EXPECT_EQ(Quantize(cloud, 3).error().code, ErrorCode::kBadArgument);
}

// What all the steps are for: nobody can tell the page's splat from the file's.
TEST(QuantizedCloud, RendersOfAFittedSplatAreTheSame) {
  const std::filesystem::path folder = SourceDirForTest() / "examples/biplane";
  const auto cloud = ReadCloud(folder / "input.ply");
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  const auto cameras = ReadCameras(folder / "transforms_hr.json");
  ASSERT_TRUE(cameras.ok()) << cameras.error().message;
  const GaussianCloud decoded = Dequantize(*Quantize(*cloud, 3));
  Rasterizer rasterizer;
  RenderOutput expected, got;
  for (size_t k : {size_t{1}, size_t{6}}) {
    Camera camera = cameras->cameras[k];
    camera.intrinsics = Scaled(camera.intrinsics, 0.25);
    ASSERT_TRUE(rasterizer.Render(*cloud, camera, {}, expected).ok());
    ASSERT_TRUE(rasterizer.Render(decoded, camera, {}, got).ok());
    double squares = 0;
    for (size_t i = 0; i < expected.color.pixels.size(); ++i) {
      const double d = expected.color.pixels[i] - got.color.pixels[i];
      squares += d * d;
    }
    EXPECT_GT(-10 * std::log10(squares / static_cast<double>(expected.color.pixels.size())), 55) << k;
  }
}

}  // namespace
}  // namespace anchorsplat
