#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "core/activations.h"
#include "formats/cloud_io.h"
#include "formats/random_cloud_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

// The table "What is lost" of docs/formats.md, measured: values all over the range of a format are written and read
// back; no error may be larger than the table says, and the largest must come close to it, or the table is wrong.

constexpr int64_t kCount = 256 * 150;

float Between(Random& random, double low, double high) {
  return static_cast<float>(low + (high - low) * random.Uniform());
}

// Means in [−16, 16]³, log-scales in [−9, 5], opacities in (0, 1), colours in [0, 1], SH in ±1; the first two Gaussians
// of every chunk of 256 hold the ends, so that all chunks have the same range. Half of the rotations are near those
// whose components are all ±½, where a component that is restored from the others is least certain.
GaussianCloud CloudOfAllValues() {
  GaussianCloud cloud;
  cloud.Resize(kCount, 3);
  Random random(5);
  for (int64_t i = 0; i < kCount; ++i) {
    const auto at = static_cast<size_t>(i);
    const int64_t in_chunk = i % 256;
    const auto value = [&](double low, double high) {
      return in_chunk > 1 ? Between(random, low, high) : static_cast<float>(in_chunk == 0 ? low : high);
    };
    for (size_t k = 0; k < 3; ++k) {
      cloud.means[3 * at + k] = value(-16, 16);
      cloud.log_scales[3 * at + k] = value(-9, 5);
      cloud.sh[48 * at + k] = value(-0.5, 0.5) / 0.2820948f;
    }
    for (size_t k = 3; k < 48; ++k) cloud.sh[48 * at + k] = Between(random, -1, 1);
    cloud.opacity_logits[at] = LogitFromOpacity(Between(random, 0, 1));
    float norm = 0;
    for (size_t k = 0; k < 4; ++k) {
      float& q = cloud.quats[4 * at + k];
      q = i % 2 == 0 ? static_cast<float>(random.Normal())
                     : static_cast<float>((random.Below(2) == 0 ? 0.5 : -0.5) + 0.01 * random.Normal());
      norm += q * q;
    }
    for (size_t k = 0; k < 4; ++k) cloud.quats[4 * at + k] /= std::sqrt(norm);
  }
  return cloud;
}

struct Worst {
  double mean_x = 0, mean_y = 0;                // world units
  double log_scale_x = 0, log_scale_y = 0;      //
  double stored_component = 0, restored = 0;    // of quaternions: the three smaller ones, the largest
  double opacity = 0, dc = 0;                   //
  double degree1 = 0, higher = 0, extreme = 0;  // of SH; of those in the last 1/32 before the ends
};

Worst Compare(const GaussianCloud& a, const GaussianCloud& b, double sh_end) {
  Worst worst;
  const auto raise = [](double& to, double x, double y) { to = std::max(to, std::fabs(x - y)); };
  for (size_t i = 0; i < static_cast<size_t>(kCount); ++i) {
    raise(worst.mean_x, a.means[3 * i], b.means[3 * i]);
    raise(worst.mean_y, a.means[3 * i + 1], b.means[3 * i + 1]);
    raise(worst.log_scale_x, a.log_scales[3 * i], b.log_scales[3 * i]);
    raise(worst.log_scale_y, a.log_scales[3 * i + 1], b.log_scales[3 * i + 1]);
    const float* p = &a.quats[4 * i];
    const float* q = &b.quats[4 * i];
    const double sign = p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3] < 0 ? -1 : 1;
    // The writer's choice of the largest is not ours where two are nearly equal: take what the reader restored.
    size_t largest = 0;
    for (size_t k = 1; k < 4; ++k) {
      if (std::fabs(q[k] * sign - p[k]) > std::fabs(q[largest] * sign - p[largest])) largest = k;
    }
    for (size_t k = 0; k < 4; ++k) raise(k == largest ? worst.restored : worst.stored_component, p[k], sign * q[k]);
    // What is too faint to be drawn stays so.
    const bool drawn = IsDrawn(a, static_cast<int64_t>(i)), bytes = Sigmoid(b.opacity_logits[i]) < 2e-6f;
    if (drawn || !bytes) raise(worst.opacity, Sigmoid(a.opacity_logits[i]), Sigmoid(b.opacity_logits[i]));
    for (size_t k = 0; k < 48; ++k) {
      if (b.sh_degree == 0 && k >= 3) break;
      const float x = a.sh[48 * i + k];
      const bool at_end = k >= 3 && std::fabs(x) > sh_end - 1.0 / 32 - 1e-5;
      raise(k < 3    ? worst.dc
            : at_end ? worst.extreme
            : k < 12 ? worst.degree1
                     : worst.higher,
            x, b.sh[static_cast<size_t>(b.sh_stride()) * i + k]);
    }
  }
  return worst;
}

// Not above, up to the rounding of floats, and not far below.
#define EXPECT_STEP(measured, stated)                  \
  EXPECT_LE(measured, (stated)*1.0001 + 3e-6) << name; \
  EXPECT_GE(measured, (stated)*0.8) << name << ": the table says more than is lost"

Worst WriteAndCompare(const GaussianCloud& cloud, const std::string& name, const CloudWriteOptions& options,
                      double sh_end) {
  const TestFolder folder;
  EXPECT_TRUE(WriteCloud(folder / name, cloud, options).ok());
  const auto back = ReadCloud(folder / name);
  EXPECT_TRUE(back.ok());
  return Compare(cloud, *back, sh_end);
}

TEST(FormatPrecision, CompressedPly) {
  const std::string name = "a.compressed.ply";
  GaussianCloud cloud = CloudOfAllValues();
  for (size_t i = 0; i < cloud.sh.size(); ++i) cloud.sh[i] *= i % 48 < 3 ? 1 : 4;
  const Worst worst = WriteAndCompare(cloud, name, {.order = SplatOrder::kKeep}, 4);
  EXPECT_STEP(worst.mean_x, 32.0 / 4094);
  EXPECT_STEP(worst.mean_y, 32.0 / 2046);
  EXPECT_STEP(worst.log_scale_x, 14.0 / 4094);
  EXPECT_STEP(worst.log_scale_y, 14.0 / 2046);
  EXPECT_STEP(worst.restored, 3.0 / 1447);
  EXPECT_LE(worst.stored_component, 1.0 / 1447 + 3e-6);
  EXPECT_STEP(worst.opacity, 1.0 / 510);
  EXPECT_STEP(worst.dc, 1 / 0.2820948 / 510);
  EXPECT_STEP(worst.degree1, 1.0 / 64);
  EXPECT_STEP(worst.higher, 1.0 / 64);
  EXPECT_STEP(worst.extreme, 1.0 / 32);
}

TEST(FormatPrecision, Spz) {
  const GaussianCloud cloud = CloudOfAllValues();
  for (const int version : {3, 4}) {
    const std::string name = "a.spz";
    const Worst worst = WriteAndCompare(cloud, name, {.spz_version = version}, 2);
    EXPECT_STEP(worst.mean_x, 1.0 / 8192);
    EXPECT_STEP(worst.mean_y, 1.0 / 8192);
    EXPECT_STEP(worst.log_scale_x, 1.0 / 32);
    EXPECT_STEP(worst.restored, 3.0 / 1445);
    EXPECT_LE(worst.stored_component, 1.0 / 1445 + 3e-6);
    EXPECT_STEP(worst.opacity, 1.0 / 510);
    EXPECT_STEP(worst.dc, 1.0 / 76.5);
    EXPECT_STEP(worst.degree1, 1.0 / 32);
    EXPECT_STEP(worst.higher, 1.0 / 16);
  }
}

TEST(FormatPrecision, Splat) {
  const std::string name = "a.splat";
  GaussianCloud cloud = CloudOfAllValues();
  const Worst worst = WriteAndCompare(cloud, name, {.order = SplatOrder::kKeep}, 2);
  EXPECT_EQ(worst.mean_x, 0);
  EXPECT_LE(worst.log_scale_x, 2e-6);
  EXPECT_LE(worst.restored, 1.0 / 128 + 1e-6);  // 1 itself has no byte
  EXPECT_STEP(worst.stored_component, 1.0 / 256);
  EXPECT_STEP(worst.opacity, 1.0 / 510);
  EXPECT_STEP(worst.dc, 1.0 / 143.9);
}

TEST(FormatPrecision, Sog) {
  const std::string name = "a.sog";
  GaussianCloud cloud = CloudOfAllValues();
  cloud = WithShDegree(cloud, 0);
  const TestFolder folder;
  ASSERT_TRUE(WriteCloud(folder / name, cloud, {.order = SplatOrder::kKeep}).ok());
  const auto back = ReadCloud(folder / name);
  ASSERT_TRUE(back.ok());
  const auto logarithm = [](float x) { return std::copysign(std::log1p(std::fabs(double{x})), double{x}); };
  double mean = 0;
  for (size_t k = 0; k < cloud.means.size(); ++k) {
    mean = std::max(mean, std::fabs(logarithm(cloud.means[k]) - logarithm(back->means[k])));
  }
  EXPECT_STEP(mean, 2 * std::log(17.0) / 131070);
  const Worst worst = Compare(WithShDegree(cloud, 3), *back, 2);
  EXPECT_STEP(worst.restored, 3.0 / 361);
  EXPECT_LE(worst.stored_component, 1.0 / 360.6 + 1e-6);
  EXPECT_STEP(worst.opacity, 1.0 / 510);
}

TEST(FormatPrecision, Gltf) {
  const Worst worst = WriteAndCompare(CloudOfAllValues(), "a.glb", {}, 2);
  EXPECT_EQ(worst.mean_x, 0);
  EXPECT_LE(worst.log_scale_x, 2e-6);
  EXPECT_LE(worst.restored, 1e-6);
  EXPECT_LE(worst.opacity, 2e-6);
  EXPECT_EQ(worst.dc, 0);
  EXPECT_EQ(worst.higher, 0);
}

// What becomes of NaN: kept, or a value that the format can hold.
TEST(FormatPrecision, NaN) {
  const TestFolder folder;
  for (const std::string name : {"a.compressed.ply", "a.splat", "a.spz", "a.sog", "a.glb", "a.ply"}) {
    GaussianCloud cloud = RandomCloud(300, 1, 3);
    for (float* value : {&cloud.means[3], &cloud.log_scales[3], &cloud.quats[4], &cloud.opacity_logits[1],
                         &cloud.sh[12], &cloud.sh[17]}) {
      *value = std::nanf("");
    }
    ASSERT_TRUE(WriteCloud(folder / name, cloud, {.order = SplatOrder::kKeep}).ok());
    const auto back = ReadCloud(folder / name);
    ASSERT_TRUE(back.ok());
    const bool all = name == "a.ply";
    EXPECT_EQ(std::isnan(back->means[3]), all) << name;
    EXPECT_EQ(std::isnan(back->log_scales[3]), all) << name;
    EXPECT_EQ(std::isnan(back->quats[4]), all) << name;
    EXPECT_EQ(std::isnan(back->opacity_logits[1]), all) << name;
    if (!all) {
      EXPECT_LT(back->opacity_logits[1], -10) << name;
    }
    EXPECT_EQ(std::isnan(back->sh[3 * static_cast<size_t>(back->coefficients())]), all) << name;
  }
}

}  // namespace
}  // namespace anchorsplat
