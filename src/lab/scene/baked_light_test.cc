#include "scene/baked_light.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "scene/meshes_for_test.h"
#include "scene/ray_tracer.h"

namespace anchorsplat {
namespace {

float LongestEdge(const Mesh& mesh) {
  float longest = 0;
  for (const auto& t : mesh.triangles) {
    for (size_t k = 0; k < 3; ++k) {
      const auto &a = mesh.positions[t[k]], &b = mesh.positions[t[(k + 1) % 3]];
      longest = std::max(longest, std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]));
    }
  }
  return longest;
}

double Area(const Mesh& mesh) {
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const auto &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    const double e[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, f[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    area += 0.5 * std::hypot(e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]);
  }
  return area;
}

// A floor of 4 x 4 m that is seen from above, the window in the wall at z = 0, and perhaps a box's lid 0.3 m above the
// floor's middle.
Mesh Floor(bool with_lid) {
  Mesh mesh;
  mesh.materials.resize(1);
  mesh.materials[0].diffuse = {1, 1, 1};
  AddQuad(mesh, {0, 0, 4}, {4, 0, 0}, {0, 0, -4}, 0);
  if (with_lid) AddQuad(mesh, {1.5f, 0.3f, 2.5f}, {1, 0, 0}, {0, 0, -1}, 0);
  return mesh;
}

DaylightOptions WindowAtZero() {
  DaylightOptions options;
  options.corner = {1, 1, 0};
  options.right = {2, 0, 0};
  options.up = {0, 1, 0};
  options.low = {0, 0, 0};
  options.high = {4, 3, 4};
  options.longest_edge = 0.2f;
  return options;
}

// Of the vertex nearest to a place on the floor.
float LightAt(const Mesh& mesh, float x, float z) {
  float nearest = 1e9f, light = -1;
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    const auto& p = mesh.positions[i];
    const float far = std::abs(p[0] - x) + std::abs(p[2] - z) + 100 * std::abs(p[1]);
    if (far < nearest && std::any_of(mesh.triangles.begin(), mesh.triangles.end(),
                                     [&](const auto& t) { return t[0] == i || t[1] == i || t[2] == i; })) {
      nearest = far;
      light = mesh.colors[i][0];
    }
  }
  return light;
}

TEST(BakedLight, CutsEdgesAndKeepsTheSurface) {
  Mesh mesh = Floor(true);
  const double area = Area(mesh);
  ASSERT_TRUE(CutToEdges(mesh, 0.3f).ok());
  EXPECT_LE(LongestEdge(mesh), 0.3f);
  EXPECT_NEAR(Area(mesh), area, 1e-4);
  EXPECT_TRUE(Validate(mesh).ok());
  for (const auto& t : mesh.triangles) {  // texture coordinates went along
    if (mesh.positions[t[0]][1] != 0) continue;
    EXPECT_NEAR(mesh.uvs[t[0]][0], mesh.positions[t[0]][0] / 4, 1e-6f);
    EXPECT_NEAR(mesh.uvs[t[0]][1], 1 - mesh.positions[t[0]][2] / 4, 1e-6f);
  }
}

TEST(BakedLight, NeighboursAreCutAtTheSamePlaces) {
  Mesh mesh = Floor(false);
  ASSERT_TRUE(CutToEdges(mesh, 0.3f).ok());
  // Every edge inside of the floor belongs to two triangles.
  std::vector<std::pair<uint32_t, uint32_t>> edges;
  for (const auto& t : mesh.triangles) {
    for (size_t k = 0; k < 3; ++k) edges.push_back(std::minmax(t[k], t[(k + 1) % 3]));
  }
  for (const auto& edge : edges) {
    const auto &a = mesh.positions[edge.first], &b = mesh.positions[edge.second];
    bool border = false;
    for (const size_t k : {size_t{0}, size_t{2}}) border = border || (a[k] == b[k] && (a[k] == 0 || a[k] == 4));
    EXPECT_EQ(std::count(edges.begin(), edges.end(), edge), border ? 1 : 2);
  }
}

TEST(BakedLight, BrighterNearTheWindowAndDarkUnderFurniture) {
  Mesh open = Floor(false), covered = Floor(true);
  ASSERT_TRUE(BakeDaylight(open, WindowAtZero()).ok());
  ASSERT_TRUE(BakeDaylight(covered, WindowAtZero()).ok());
  EXPECT_GT(LightAt(open, 2, 1), LightAt(open, 2, 3.5f) + 0.1f);
  EXPECT_NEAR(LightAt(open, 1, 2), LightAt(open, 3, 2), 1e-3f);  // the window is in the middle
  EXPECT_LT(LightAt(covered, 2, 2), LightAt(open, 2, 2) - 0.2f);
  EXPECT_NEAR(LightAt(covered, 0.4f, 0.4f), LightAt(open, 0.4f, 0.4f), 1e-3f);  // far from it
}

// The formula itself where nothing is in the way: all directions are open, and the window is summed up pane by pane.
TEST(BakedLight, IsTheFormula) {
  Mesh mesh = Floor(false);
  const DaylightOptions options = WindowAtZero();
  ASSERT_TRUE(BakeDaylight(mesh, options).ok());
  double window = 0;
  for (int i = 0; i < 200; ++i) {
    for (int j = 0; j < 200; ++j) {
      const double x = 1 + 2 * (i + 0.5) / 200 - 2, y = 1 + (j + 0.5) / 200, z = -2.0;
      const double square = x * x + y * y + z * z;
      window += 2.0 / 40000 * y * -z / (square * square);
    }
  }
  EXPECT_NEAR(LightAt(mesh, 2, 2), std::min(1.0, 0.6 + 0.5 * window / (window + 0.1)), 0.01);
}

TEST(BakedLight, IsShownWithoutLampsAndLeavesWhatWasLit) {
  Mesh mesh = SquareAt(-1, {0.5f, 0.25f, 0.75f});
  mesh.materials[0].lit = true;
  DaylightOptions options = WindowAtZero();
  ASSERT_TRUE(BakeDaylight(mesh, options).ok());
  EXPECT_EQ(mesh.triangles.size(), 2u);
  const auto tracer = RayTracer::Create(mesh);
  ASSERT_TRUE(tracer.ok());
  Camera camera;
  camera.intrinsics = PinholeFromFov(8, 8, 0.3);
  camera.world_to_camera = *LookAt({0, 0, 1}, {0, 0, -1}, {0, 1, 0});
  const auto view = tracer->Render(camera);
  ASSERT_TRUE(view.ok());
  EXPECT_FLOAT_EQ(view->at(0, 4, 4), 0.5f);
  EXPECT_FLOAT_EQ(view->at(1, 4, 4), 0.25f);
  EXPECT_FLOAT_EQ(view->at(2, 4, 4), 0.75f);
}

TEST(BakedLight, TheSameForAnyNumberOfThreads) {
  Mesh one = Floor(true), four = Floor(true);
  SetThreadCount(1);
  ASSERT_TRUE(BakeDaylight(one, WindowAtZero()).ok());
  SetThreadCount(4);
  ASSERT_TRUE(BakeDaylight(four, WindowAtZero()).ok());
  SetThreadCount(0);
  EXPECT_EQ(one.colors, four.colors);
}

TEST(BakedLight, RefusesEdgesWithoutLengthAndTooManyTriangles) {
  Mesh mesh = Floor(false);
  EXPECT_EQ(CutToEdges(mesh, 0).error().code, ErrorCode::kBadArgument);
  EXPECT_EQ(CutToEdges(mesh, std::nanf("")).error().code, ErrorCode::kBadArgument);
}

TEST(RayTracer, KnowsWhatIsInTheWay) {
  const auto tracer = RayTracer::Create(SquareAt(0, {1, 1, 1}));
  ASSERT_TRUE(tracer.ok());
  EXPECT_TRUE(tracer->IsBlocked({0, 0, 1}, {0, 0, -1}));
  EXPECT_FALSE(tracer->IsBlocked({0, 0, 1}, {0, 0, 0.5f}));
  EXPECT_FALSE(tracer->IsBlocked({2, 0, 1}, {2, 0, -1}));
  EXPECT_FALSE(tracer->IsBlocked({0, 0, 0}, {0, 0, -1}));  // leaves the square itself
}

}  // namespace
}  // namespace anchorsplat
