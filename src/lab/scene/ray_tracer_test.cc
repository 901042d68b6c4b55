#include "scene/ray_tracer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "core/parallel.h"
#include "core/vector3.h"
#include "scene/camera_rig.h"
#include "scene/meshes_for_test.h"
#include "scene/surface_shader.h"

namespace anchorsplat {
namespace {

using Vec3 = std::array<double, 3>;

Vec3 Unit(const Vec3& a) {
  const double n = std::sqrt(Dot(a, a));
  return {a[0] / n, a[1] / n, a[2] / n};
}
Vec3 Corner(const Mesh& mesh, size_t t, size_t k) {
  const auto& p = mesh.positions[mesh.triangles[t][k]];
  return {p[0], p[1], p[2]};
}

// What a ray meets: every triangle is tried (Möller and Trumbore 1997), in double precision.
struct Meeting {
  size_t triangle;
  double u, v;
};
std::optional<Meeting> FirstTriangle(const Mesh& mesh, const Vec3& origin, const Vec3& direction) {
  std::optional<Meeting> best;
  double nearest = std::numeric_limits<double>::infinity();
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 a = Corner(mesh, t, 0), e = Minus(Corner(mesh, t, 1), a), f = Minus(Corner(mesh, t, 2), a);
    const Vec3 p = Cross(direction, f);
    const double det = Dot(e, p);
    if (det == 0) continue;
    const Vec3 s = Minus(origin, a), q = Cross(s, e);
    const double u = Dot(s, p) / det, v = Dot(direction, q) / det, depth = Dot(f, q) / det;
    if (u < 0 || v < 0 || u + v > 1 || depth <= 0 || depth >= nearest) continue;
    nearest = depth;
    best = Meeting{t, u, v};
  }
  return best;
}

// Lambert with the lamps of surface_shader.h, for meshes without textures.
Vec3 LitColor(const Mesh& mesh, const Meeting& hit, const Vec3& direction) {
  Vec3 face = Unit(Cross(Minus(Corner(mesh, hit.triangle, 1), Corner(mesh, hit.triangle, 0)),
                         Minus(Corner(mesh, hit.triangle, 2), Corner(mesh, hit.triangle, 0))));
  if (Dot(face, direction) > 0) face = {-face[0], -face[1], -face[2]};
  Vec3 n = face;
  if (!mesh.normals.empty()) {
    const double weights[3] = {1 - hit.u - hit.v, hit.u, hit.v};
    n = {0, 0, 0};
    for (size_t k = 0; k < 3; ++k) {
      for (size_t i = 0; i < 3; ++i) n[i] += weights[k] * mesh.normals[mesh.triangles[hit.triangle][k]][i];
    }
    n = Unit(n);
    if (Dot(n, face) < 0) n = {-n[0], -n[1], -n[2]};
  }
  double light = kAmbientLight;
  for (const Lamp& lamp : kLamps) {
    light += lamp.strength * std::max(0.0, Dot(n, Unit({lamp.towards[0], lamp.towards[1], lamp.towards[2]})));
  }
  const auto& diffuse = mesh.materials[static_cast<size_t>(mesh.triangle_materials[hit.triangle])].diffuse;
  return {std::min(1.0, diffuse[0] * light), std::min(1.0, diffuse[1] * light), std::min(1.0, diffuse[2] * light)};
}

Image RenderReference(const Mesh& mesh, const Camera& camera, int samples) {
  const Pinhole& k = camera.intrinsics;
  const auto& r = camera.world_to_camera.rotation;
  Image image(k.width, k.height, 4);
  for (int y = 0; y < k.height; ++y) {
    for (int x = 0; x < k.width; ++x) {
      Vec3 sum = {0, 0, 0};
      int met = 0;
      for (int j = 0; j < samples; ++j) {
        for (int i = 0; i < samples; ++i) {
          const Vec3 in_camera = {(x + (i + 0.5) / samples - k.cx) / k.fx, (y + (j + 0.5) / samples - k.cy) / k.fy, 1};
          const Vec3 d = {r[0] * in_camera[0] + r[3] * in_camera[1] + r[6],
                          r[1] * in_camera[0] + r[4] * in_camera[1] + r[7],
                          r[2] * in_camera[0] + r[5] * in_camera[1] + r[8]};
          const auto hit = FirstTriangle(mesh, camera.Center(), d);
          if (!hit) continue;
          ++met;
          const Vec3 color = LitColor(mesh, *hit, d);
          for (size_t c = 0; c < 3; ++c) sum[c] += color[c];
        }
      }
      for (int c = 0; c < 3; ++c) {
        image.at(c, y, x) = met > 0 ? static_cast<float>(sum[static_cast<size_t>(c)] / met) : 0.0f;
      }
      image.at(3, y, x) = static_cast<float>(met) / static_cast<float>(samples * samples);
    }
  }
  return image;
}

Camera ViewFrom(const Vec3& eye, int width, int height, double focal) {
  Camera camera;
  camera.intrinsics = {width, height, focal, focal, 0.5 * width, 0.5 * height};
  camera.world_to_camera = *LookAt(eye, {0, 0, 0}, {0, 1, 0});
  return camera;
}

Image Render(const Mesh& mesh, const Camera& camera, int samples = 4) {
  auto tracer = RayTracer::Create(mesh);
  EXPECT_TRUE(tracer.ok()) << (tracer.ok() ? "" : tracer.error().message);
  auto image = tracer->Render(camera, {.samples = samples});
  EXPECT_TRUE(image.ok()) << (image.ok() ? "" : image.error().message);
  return *std::move(image);
}

// Pixels that differ by more than rounding: a ray along an edge may fall to either side.
int64_t DifferingPixels(const Image& a, const Image& b, float tolerance) {
  int64_t count = 0;
  for (int64_t i = 0; i < a.plane(); ++i) {
    bool differs = false;
    for (int c = 0; c < 4; ++c) differs |= !(std::abs(a.channel(c)[i] - b.channel(c)[i]) <= tolerance);
    count += differs ? 1 : 0;
  }
  return count;
}

double LightOn(const Vec3& normal) {
  double light = kAmbientLight;
  for (const Lamp& lamp : kLamps) {
    light += lamp.strength * std::max(0.0, Dot(normal, Unit({lamp.towards[0], lamp.towards[1], lamp.towards[2]})));
  }
  return light;
}

TEST(RayTracer, MatchesTryingEveryTriangle) {
  for (const uint64_t seed : {1u, 2u, 3u}) {
    const Mesh mesh = RandomTriangles(60, seed);
    const Camera camera = ViewFrom({1, 0.7, 1.1}, 67, 41, 60);  // sizes that divide nothing
    for (const int samples : {1, 3, 4}) {
      const Image fast = Render(mesh, camera, samples), reference = RenderReference(mesh, camera, samples);
      EXPECT_LE(DifferingPixels(fast, reference, 1e-4f), 2) << seed << " " << samples;
      EXPECT_GT(*std::max_element(fast.channel(3), fast.channel(3) + fast.plane()), 0.9f);
    }
  }
}

TEST(RayTracer, SmoothNormalsMatchTheReference) {
  const Mesh mesh = SphereMesh(0.5f, 8, true);
  const Camera camera = ViewFrom({0.4, 0.3, 1.6}, 50, 50, 60);
  EXPECT_LE(DifferingPixels(Render(mesh, camera, 2), RenderReference(mesh, camera, 2), 2e-4f), 2);
}

TEST(RayTracer, EyeInsideTheObjectAndTrianglesBehindIt) {
  const Mesh mesh = RandomTriangles(80, 9);
  Camera camera = ViewFrom({0.02, 0.01, 0.03}, 40, 40, 20);
  EXPECT_LE(DifferingPixels(Render(mesh, camera, 2), RenderReference(mesh, camera, 2), 1e-4f), 4);
}

TEST(RayTracer, SilhouetteOfASphereHasTheRightArea) {
  // A sphere of radius r at distance d is seen as a disc of tan(asin(r/d)).
  const Image image = Render(SphereMesh(0.5f, 200, true), ViewFrom({0, 0, 1.7}, 128, 128, 150));
  double area = 0;
  for (int64_t i = 0; i < image.plane(); ++i) area += image.channel(3)[i];
  const double radius = 150 * std::tan(std::asin(0.5 / 1.7));
  EXPECT_NEAR(area / (std::numbers::pi * radius * radius), 1, 2e-3);
}

TEST(RayTracer, AlphaIsCoverageAndColourIsStraight) {
  // The square's edge runs through the middle of a pixel: half of its rays hit.
  Mesh mesh = SquareAt(0, {0.5f, 0.25f, 1});
  for (auto& p : mesh.positions) p[0] += 0.5f;  // from x = 0
  Camera camera = ViewFrom({0, 0, 1}, 9, 9, 4);
  const Image image = Render(mesh, camera);
  const float light = static_cast<float>(LightOn({0, 0, 1}));
  EXPECT_FLOAT_EQ(image.at(3, 4, 4), 0.5f);
  EXPECT_NEAR(image.at(0, 4, 4), 0.5f * light, 1e-5f);
  EXPECT_NEAR(image.at(1, 4, 4), 0.25f * light, 1e-5f);
  EXPECT_EQ(image.at(3, 4, 2), 0);
  EXPECT_EQ(image.at(0, 4, 2), 0);
}

TEST(RayTracer, TexelsLandWhereTheyShould) {
  Mesh mesh = SquareAt(0, {1, 0, 0});
  Texture texture{"four", 2, 2, false, {}};
  // Upper left red, upper right green, lower left blue, lower right white.
  for (const auto& [r, g, b] : {std::array<uint8_t, 3>{255, 0, 0}, {0, 255, 0}, {0, 0, 255}, {255, 255, 255}}) {
    texture.rgba.insert(texture.rgba.end(), {r, g, b, 255});
  }
  mesh.textures = {texture};
  mesh.materials[0].texture = 0;
  const Image image = Render(mesh, ViewFrom({0, 0, 1}, 100, 100, 100));
  const float light = static_cast<float>(LightOn({0, 0, 1}));
  // Texel centres are a quarter in from the border; there the pixel sees nearly that texel alone.
  const auto color = [&](int y, int x) {
    return std::array<int, 3>{static_cast<int>(std::lround(image.at(0, y, x) / light)),
                              static_cast<int>(std::lround(image.at(1, y, x) / light)),
                              static_cast<int>(std::lround(image.at(2, y, x) / light))};
  };
  EXPECT_EQ(color(25, 25), (std::array<int, 3>{1, 0, 0}));
  EXPECT_EQ(color(25, 75), (std::array<int, 3>{0, 1, 0}));
  EXPECT_EQ(color(75, 25), (std::array<int, 3>{0, 0, 1}));
  EXPECT_EQ(color(75, 75), (std::array<int, 3>{1, 1, 1}));
}

Mesh CheckeredSquare(int texels, bool holes) {
  Mesh mesh = SquareAt(0, {1, 1, 1});
  Texture texture{"checker", texels, texels, holes, {}};
  for (int y = 0; y < texels; ++y) {
    for (int x = 0; x < texels; ++x) {
      const uint8_t value = (x + y) % 2 == 0 ? 255 : 0;
      const uint8_t color = holes ? 255 : value;
      texture.rgba.insert(texture.rgba.end(), {color, color, color, holes ? value : uint8_t{255}});
    }
  }
  mesh.textures = {texture};
  mesh.materials[0].texture = 0;
  return mesh;
}

TEST(RayTracer, FineTexturesAreAveragedOverTheFootprint) {
  // 32 texels a pixel and direction, 8 a sample: single texels would give noise of ±0.1.
  const Image image = Render(CheckeredSquare(1024, false), ViewFrom({0, 0, 1}, 32, 32, 32));
  const float light = static_cast<float>(LightOn({0, 0, 1}));
  for (int64_t i = 0; i < image.plane(); ++i) ASSERT_NEAR(image.channel(0)[i] / light, 0.5f, 0.01f) << i;
}

TEST(RayTracer, HolesShowWhatIsBehind) {
  // Left half of the front square is a hole; behind it stands a red one.
  Mesh mesh = SquareAt(0, {1, 1, 1});
  mesh.textures = {{"half", 2, 1, true, {255, 255, 255, 0, 0, 255, 0, 255}}};
  mesh.materials[0].texture = 0;
  Material red;
  red.diffuse = {1, 0, 0};
  mesh.materials.push_back(red);
  AddQuad(mesh, {-0.5f, -0.5f, -0.1f}, {1, 0, 0}, {0, 1, 0}, 1);
  const Image image = Render(mesh, ViewFrom({0, 0, 1}, 64, 64, 64));
  EXPECT_GT(image.at(0, 32, 16), 0.5f);
  EXPECT_LT(image.at(1, 32, 16), 0.02f);
  EXPECT_LT(image.at(0, 32, 48), 0.02f);
  EXPECT_GT(image.at(1, 32, 48), 0.5f);
  // Without anything behind the hole there is nothing.
  mesh.triangles.resize(2);
  mesh.triangle_materials.resize(2);
  EXPECT_EQ(Render(mesh, ViewFrom({0, 0, 1}, 64, 64, 64)).at(3, 32, 16), 0);
}

TEST(RayTracer, WindingAndTurnedNormalsDoNotMatter) {
  const Mesh mesh = SphereMesh(0.5f, 12, true);
  Mesh turned = mesh;
  for (auto& t : turned.triangles) std::swap(t[1], t[2]);
  for (auto& n : turned.normals) n = {-n[0], -n[1], -n[2]};
  const Camera camera = ViewFrom({1, 0.5, 1.2}, 48, 48, 50);
  // Another corner comes first, so that sums round differently.
  EXPECT_LE(DifferingPixels(Render(mesh, camera), Render(turned, camera), 1e-5f), 2);
}

TEST(RayTracer, VertexColoursMultiply) {
  Mesh mesh = SquareAt(0, {1, 0.5f, 1});
  mesh.colors.assign(4, {0.5f, 1, 0, 1});
  const Image image = Render(mesh, ViewFrom({0, 0, 1}, 16, 16, 16));
  const float light = static_cast<float>(LightOn({0, 0, 1}));
  EXPECT_NEAR(image.at(0, 8, 8), 0.5f * light, 1e-5f);
  EXPECT_NEAR(image.at(1, 8, 8), 0.5f * light, 1e-5f);
  EXPECT_EQ(image.at(2, 8, 8), 0);
}

TEST(RayTracer, SurvivesTrianglesWithoutAreaAndNumbersThatAreNone) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  Mesh mesh = SquareAt(0, {1, 1, 1});
  mesh.positions.push_back({0, 0, 0.2f});
  mesh.positions.push_back({kNan, 0, 0.2f});
  mesh.uvs.push_back({kNan, 1e30f});
  mesh.uvs.push_back({-1e30f, 0});
  mesh.normals.assign(6, {kNan, 0, 0});
  mesh.triangles.push_back({4, 4, 4});
  mesh.triangles.push_back({0, 4, 5});
  mesh.triangle_materials.insert(mesh.triangle_materials.end(), {0, 0});
  mesh.materials[0].diffuse = {kNan, 2, -1};
  mesh.textures = {{"dot", 1, 1, false, {255, 255, 255, 255}}};
  const Image image = Render(mesh, ViewFrom({0, 0, 1}, 32, 32, 32));
  for (const float x : image.pixels) ASSERT_TRUE(x >= 0 && x <= 1) << x;
  EXPECT_EQ(image.at(3, 16, 16), 1);
}

TEST(RayTracer, TheSameBitsForAnyNumberOfThreads) {
  Mesh mesh = RandomTriangles(2000, 4);
  mesh.triangles.insert(mesh.triangles.end(), mesh.triangles.begin(), mesh.triangles.end());  // all of them twice
  for (size_t i = 0; i < 2000; ++i) mesh.triangle_materials.push_back(static_cast<int32_t>((i + 1) % 2000));
  const Camera camera = ViewFrom({1, 0.7, 1.1}, 96, 96, 90);
  SetThreadCount(1);
  const Image one = Render(mesh, camera);
  SetThreadCount(4);
  const Image four = Render(mesh, camera);
  SetThreadCount(0);
  EXPECT_TRUE(one.pixels == four.pixels);
}

TEST(RayTracer, CountsItsRays) {
  auto tracer = RayTracer::Create(SphereMesh(0.1f, 16, false));
  ASSERT_TRUE(tracer.ok());
  TraceCost cost;
  ASSERT_TRUE(tracer->Render(ViewFrom({0, 0, 1.7}, 128, 128, 150), {.samples = 2}, &cost).ok());
  EXPECT_GT(cost.rays, 4 * 250);            // the disc
  EXPECT_LT(cost.rays, 128 * 128 * 4 / 4);  // not the empty rest of the picture
}

TEST(RayTracer, RefusesWhatItCannotDraw) {
  EXPECT_EQ(RayTracer::Create(Mesh()).error().code, ErrorCode::kBadArgument);
  Mesh broken = SquareAt(0, {1, 1, 1});
  broken.triangles[0][1] = 77;
  EXPECT_NE(RayTracer::Create(broken).error().message.find("vertex 77 of 4"), std::string::npos);
  auto tracer = RayTracer::Create(SquareAt(0, {1, 1, 1}));
  ASSERT_TRUE(tracer.ok());
  EXPECT_FALSE(tracer->Render(ViewFrom({0, 0, 1}, 8, 8, 8), {.samples = 0}).ok());
  EXPECT_FALSE(tracer->Render(ViewFrom({0, 0, 1}, 8, 8, 8), {.samples = 17}).ok());
  EXPECT_FALSE(tracer->Render(ViewFrom({0, 0, 1}, 0, 8, 8)).ok());
  EXPECT_FALSE(tracer->Render(ViewFrom({0, 0, 1}, 1 << 19, 1 << 19, 8)).ok());
}

}  // namespace
}  // namespace anchorsplat
