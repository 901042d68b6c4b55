#include "scene/surface_samples.h"

#include <gtest/gtest.h>

#include <cmath>

#include "scene/camera_rig.h"
#include "scene/meshes_for_test.h"

namespace anchorsplat {
namespace {

TEST(SurfaceSamples, LieOnWhatCanBeSeenEvenly) {
  // A sphere hides a smaller one inside it.
  Mesh mesh = SphereMesh(0.5f, 24, false);
  const Mesh inner = SphereMesh(0.3f, 24, false);
  const uint32_t first = static_cast<uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), inner.positions.begin(), inner.positions.end());
  for (const auto& t : inner.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  mesh.triangle_materials.assign(mesh.triangles.size(), 0);

  auto tracer = RayTracer::Create(mesh);
  ASSERT_TRUE(tracer.ok());
  const auto cameras = MakeRig({.views = 60}, 64, 64);
  const auto samples = SampleSurface(*tracer, *cameras, 4000, 1);
  ASSERT_EQ(samples.size(), 4000u);
  int above = 0;
  for (const SurfaceSample& s : samples) {
    const float radius =
        std::sqrt(s.position[0] * s.position[0] + s.position[1] * s.position[1] + s.position[2] * s.position[2]);
    ASSERT_GT(radius, 0.49f);
    above += s.position[1] > 0.25f ? 1 : 0;  // a quarter of a sphere's area (Archimedes)
    for (const float x : s.color) ASSERT_TRUE(x >= 0.7f * 0.45f - 1e-6f && x <= 0.7f * 0.9f + 1e-6f) << x;
  }
  EXPECT_NEAR(above / 4000.0, 0.25, 0.03);
}

TEST(SurfaceSamples, DependOnTheSeedAlone) {
  auto tracer = RayTracer::Create(SphereMesh(0.5f, 8, true));
  ASSERT_TRUE(tracer.ok());
  const auto cameras = MakeRig({.views = 5}, 64, 64);
  const auto a = SampleSurface(*tracer, *cameras, 100, 1), b = SampleSurface(*tracer, *cameras, 100, 1),
             c = SampleSurface(*tracer, *cameras, 100, 2);
  ASSERT_EQ(a.size(), 100u);
  EXPECT_EQ(a[99].position, b[99].position);
  EXPECT_NE(a[99].position, c[99].position);
}

TEST(SurfaceSamples, NoneWhereNobodyLooksOrNothingIsSolid) {
  Mesh mesh = SquareAt(0, {1, 1, 1});
  mesh.textures = {{"air", 1, 1, true, {255, 255, 255, 0}}};
  mesh.materials[0].texture = 0;
  auto tracer = RayTracer::Create(mesh);
  ASSERT_TRUE(tracer.ok());
  EXPECT_TRUE(SampleSurface(*tracer, *MakeRig({.views = 5}, 64, 64), 100, 1).empty());
  EXPECT_TRUE(SampleSurface(*tracer, CameraSet{}, 100, 1).empty());
}

}  // namespace
}  // namespace anchorsplat
