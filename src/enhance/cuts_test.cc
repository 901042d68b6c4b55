#include "enhance/cuts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "core/source_dir_for_test.h"
#include "core/vector3.h"
#include "formats/cloud_io.h"

namespace anchorsplat {
namespace {

using Vec3 = std::array<double, 3>;

GaussianCloud Example(const char* object) {
  auto cloud = ReadCloud(SourceDirForTest() / "examples" / object / "input.ply");
  EXPECT_TRUE(cloud.ok());
  return cloud.ok() ? *std::move(cloud) : GaussianCloud{};
}

Vec3 At(const GaussianCloud& cloud, int64_t i) {
  const float* p = cloud.means.data() + 3 * i;
  return {p[0], p[1], p[2]};
}

GaussianCloud Kept(const GaussianCloud& cloud, const std::function<bool(const Vec3&)>& keeps) {
  std::vector<int64_t> rows;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (keeps(At(cloud, i))) rows.push_back(i);
  }
  return Subset(cloud, rows).value();
}

double Distance(const Vec3& a, const Vec3& b) {
  return std::sqrt(std::pow(a[0] - b[0], 2) + std::pow(a[1] - b[1], 2) + std::pow(a[2] - b[2], 2));
}

// What nobody cut ends by itself: wings, roofs, a handle.
TEST(Cuts, WholeFitsHaveNone) {
  for (const char* object : {"biplane", "stone_lantern", "tankard"}) {
    EXPECT_TRUE(FindCuts(Example(object)).empty()) << object;
  }
}

TEST(Cuts, APlaneIsFound) {
  const Vec3 normal = {2.0 / 3, -1.0 / 3, 2.0 / 3};
  for (const char* object : {"biplane", "stone_lantern"}) {
    const GaussianCloud half = Kept(Example(object), [&](const Vec3& p) { return Dot(p, normal) < 0.05; });
    const std::vector<Cut> cuts = FindCuts(half);
    ASSERT_EQ(cuts.size(), 1u) << object;
    EXPECT_FALSE(cuts[0].ball);
    EXPECT_GT(Dot(cuts[0].direction, normal), std::cos(0.01)) << object;
    EXPECT_NEAR(cuts[0].reach, 0.05, 0.002) << object;
  }
}

TEST(Cuts, ABoxHasManyAndTheyAreItsSides) {
  const auto inside = [](const Vec3& p) { return std::ranges::all_of(p, [](double x) { return std::abs(x) < 0.15; }); };
  const std::vector<Cut> cuts = FindCuts(Kept(Example("stone_lantern"), inside));
  EXPECT_GE(cuts.size(), 4u);
  for (const Cut& cut : cuts) {
    if (cut.ball) continue;
    double largest = 0;
    for (const double x : cut.direction) largest = std::max(largest, std::abs(x));
    EXPECT_GT(largest, std::cos(0.03));
    EXPECT_NEAR(cut.reach, 0.15, 0.003);
  }
}

TEST(Cuts, ABallIsFoundAndScalesWithTheCloud) {
  const Vec3 middle = {0.1, 0.02, -0.05};
  const GaussianCloud part = Kept(Example("stone_lantern"), [&](const Vec3& p) { return Distance(p, middle) < 0.2; });
  for (const double scale : {1.0, 1e-4, 3e3}) {
    GaussianCloud scaled = part;
    for (float& x : scaled.means) x = static_cast<float>(x * scale + 7 * scale);
    for (float& x : scaled.log_scales) x += static_cast<float>(std::log(scale));
    const std::vector<Cut> cuts = FindCuts(scaled);
    const auto ball = std::ranges::find_if(cuts, &Cut::ball);
    ASSERT_NE(ball, cuts.end()) << scale;
    EXPECT_NEAR(ball->reach, 0.2 * scale, 0.01 * scale);
    for (size_t a = 0; a < 3; ++a) EXPECT_NEAR(ball->direction[a], (middle[a] + 7) * scale, 0.01 * scale);
  }
}

// Gaussians that lie flat on a ball, as converters of meshes place them, are its face and not a cut.
TEST(Cuts, FacesAreNoCuts) {
  Random random(3);
  GaussianCloud faces;
  faces.Resize(8000, 0);
  std::fill(faces.opacity_logits.begin(), faces.opacity_logits.end(), 2.0f);
  for (size_t i = 0; i < 8000; ++i) {
    Vec3 p;
    for (double& x : p) x = random.Normal();
    const double length = std::sqrt(Dot(p, p));
    for (double& x : p) x /= length;
    for (size_t a = 0; a < 3; ++a) faces.means[3 * i + a] = static_cast<float>(p[a]);
    const double quaternion[] = {1 + p[2], -p[1], p[0], 0};  // turns z outwards
    for (size_t a = 0; a < 4; ++a) faces.quats[4 * i + a] = static_cast<float>(quaternion[a]);
    const double size = 0.02 * std::exp(0.5 * random.Normal());
    for (size_t a = 0; a < 3; ++a) {
      faces.log_scales[3 * i + a] = static_cast<float>(std::log(a == 2 ? 0.05 * size : size));
    }
  }
  EXPECT_TRUE(FindCuts(faces).empty());
  const std::vector<Cut> cuts = FindCuts(Kept(faces, [](const Vec3& p) { return p[1] < 0.3; }));
  ASSERT_EQ(cuts.size(), 1u);
  EXPECT_NEAR(cuts[0].reach, 0.3, 0.003);
}

TEST(Cuts, DepthIsInDeviationsAcrossTheCut) {
  GaussianCloud one;
  one.Resize(1, 0);
  const float mean[] = {0.5f, 0, 0}, quaternion[] = {1, 0, 0, 0};
  const float scales[] = {std::log(0.1f), std::log(0.2f), std::log(0.4f)};
  std::ranges::copy(mean, one.means.begin());
  std::ranges::copy(quaternion, one.quats.begin());
  std::ranges::copy(scales, one.log_scales.begin());
  EXPECT_NEAR((Cut{false, {1, 0, 0}, 0.7}.Depth(one, 0)), 2, 1e-5);
  EXPECT_NEAR((Cut{false, {0, 1, 0}, 0.1}.Depth(one, 0)), 0.5, 1e-5);
  EXPECT_NEAR((Cut{true, {0, 0, 0}, 0.8}.Depth(one, 0)), 3, 1e-5);
  EXPECT_NEAR((Cut{true, {0.5, 0, 1}, 1.2}.Depth(one, 0)), 0.5, 1e-5);
  std::fill(one.log_scales.begin(), one.log_scales.end(), -std::numeric_limits<float>::infinity());
  EXPECT_GT((Cut{false, {1, 0, 0}, 0.7}.Depth(one, 0)), 1e30);
}

TEST(Cuts, LittleOrDegenerateHasNone) {
  EXPECT_TRUE(FindCuts({}).empty());
  for (const int dimensions : {0, 1, 2}) {  // one point, a line, a plane
    Random random(5);
    GaussianCloud cloud;
    cloud.Resize(3000, 0);
    std::fill(cloud.means.begin(), cloud.means.end(), 1.0f);
    std::fill(cloud.quats.begin(), cloud.quats.end(), 0.0f);
    std::fill(cloud.log_scales.begin(), cloud.log_scales.end(), -5.0f);
    std::fill(cloud.opacity_logits.begin(), cloud.opacity_logits.end(), 1.0f);
    for (size_t i = 0; i < 3000; ++i) {
      for (int a = 0; a < dimensions; ++a)
        cloud.means[3 * i + static_cast<size_t>(a)] = static_cast<float>(random.Normal());
    }
    EXPECT_TRUE(FindCuts(cloud).empty()) << dimensions;
  }
}

TEST(Cuts, AreTheSameForAnyNumberOfThreads) {
  const GaussianCloud half = Kept(Example("biplane"), [](const Vec3& p) { return p[0] + p[1] < 0.1; });
  SetThreadCount(1);
  const std::vector<Cut> one = FindCuts(half);
  SetThreadCount(5);
  const std::vector<Cut> five = FindCuts(half);
  SetThreadCount(0);
  ASSERT_FALSE(one.empty());
  ASSERT_EQ(one.size(), five.size());
  for (size_t k = 0; k < one.size(); ++k) {
    EXPECT_EQ(one[k].direction, five[k].direction);
    EXPECT_EQ(one[k].reach, five[k].reach);
  }
}

}  // namespace
}  // namespace anchorsplat
