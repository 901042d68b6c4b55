#include "scene/smooth_normals.h"

#include <gtest/gtest.h>

#include <cmath>

namespace anchorsplat {
namespace {

using Float3 = std::array<float, 3>;

std::vector<Float3> Normals(const std::vector<Float3>& corners, float angle) {
  std::vector<Float3> normals(corners.size(), Float3{0, 0, 0});
  FillSmoothNormals(corners, angle, normals);
  return normals;
}

void ExpectNear(const Float3& a, const Float3& b) {
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(a[k], b[k], 1e-6) << k;
}

// Two squares of two triangles each that meet at the z axis under the given angle between their normals.
std::vector<Float3> Fold(double degrees) {
  const double a = degrees * std::acos(-1.0) / 180;
  const Float3 p = {0, 0, 0}, q = {0, 0, 1}, l0 = {-1, 0, 0}, l1 = {-1, 0, 1};
  const Float3 r0 = {static_cast<float>(std::cos(a)), static_cast<float>(-std::sin(a)), 0};
  const Float3 r1 = {r0[0], r0[1], 1};
  return {l0, l1, q, l0, q, p, p, q, r1, p, r1, r0};
}

TEST(SmoothNormals, EdgesWithinTheAngleAreSmooth) {
  const double a = 30 * std::acos(-1.0) / 180;
  const auto normals = Normals(Fold(30), 45);
  // Half-way between the two at the fold, whatever the diagonals: weights are angles.
  const Float3 middle = {static_cast<float>(std::sin(a / 2)), static_cast<float>(std::cos(a / 2)), 0};
  ExpectNear(normals[2], middle);
  ExpectNear(normals[5], middle);
  ExpectNear(normals[6], middle);
  ExpectNear(normals[0], {0, 1, 0});
  ExpectNear(normals[8], {static_cast<float>(std::sin(a)), static_cast<float>(std::cos(a)), 0});
}

TEST(SmoothNormals, SharperEdgesStaySharp) {
  const auto normals = Normals(Fold(60), 45);
  for (size_t i = 0; i < 6; ++i) ExpectNear(normals[i], {0, 1, 0});
  const double a = 60 * std::acos(-1.0) / 180;
  for (size_t i = 6; i < 12; ++i)
    ExpectNear(normals[i], {static_cast<float>(std::sin(a)), static_cast<float>(std::cos(a)), 0});
}

TEST(SmoothNormals, BothSidesOfASheetKeepTheirs) {
  const auto normals = Normals({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}, {0, 1, 0}, {1, 0, 0}}, 45);
  for (size_t i = 0; i < 3; ++i) ExpectNear(normals[i], {0, 0, 1});
  for (size_t i = 3; i < 6; ++i) ExpectNear(normals[i], {0, 0, -1});
}

TEST(SmoothNormals, GivenOnesStay) {
  std::vector<Float3> normals = {{1, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  FillSmoothNormals(std::vector<Float3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, 45, normals);
  ExpectNear(normals[0], {1, 0, 0});
  ExpectNear(normals[1], {0, 0, 1});
}

TEST(SmoothNormals, FlatTrianglesAndNothingAtAll) {
  EXPECT_TRUE(Normals({}, 45).empty());
  for (const Float3& n : Normals({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, 45)) ExpectNear(n, {0, 0, 0});
}

TEST(SmoothNormals, TinyAndHugeTriangles) {
  for (const float s : {1e-18f, 1e18f}) {
    for (const Float3& n : Normals({{0, 0, 0}, {s, 0, 0}, {0, s, 0}}, 45)) ExpectNear(n, {0, 0, 1});
  }
}

TEST(SmoothNormals, WhereTooManyMeetFacetsAreGiven) {
  std::vector<Float3> corners;
  constexpr int kCount = 600;
  for (int k = 0; k < kCount; ++k) {
    const double a = 2 * std::acos(-1.0) * k / kCount, b = 2 * std::acos(-1.0) * (k + 1) / kCount;
    corners.push_back({0, 0, 0});
    corners.push_back({static_cast<float>(std::cos(a)), static_cast<float>(std::sin(a)), 0.1f});
    corners.push_back({static_cast<float>(std::cos(b)), static_cast<float>(std::sin(b)), 0.1f});
  }
  const auto normals = Normals(corners, 45);
  EXPECT_LT(normals[0][0], -0.09f);  // the first facet's own, not the mean of all, which is the z axis
}

}  // namespace
}  // namespace anchorsplat
