#include "dataset/backdrop.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "scene/ray_tracer.h"

namespace anchorsplat {
namespace {

Mesh Triangle() {
  Mesh mesh;
  mesh.positions = {{-0.5f, 0, 0}, {0.5f, 0, 0}, {0, 0.5f, 0}};
  mesh.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
  mesh.triangles = {{0, 1, 2}};
  mesh.triangle_materials = {0};
  mesh.materials.resize(1);
  return mesh;
}

TEST(Backdrop, EveryRayMeetsAWallOrTheObject) {
  Mesh mesh = Triangle();
  ASSERT_TRUE(AddBackdrop(mesh, 2, 7).ok());
  EXPECT_EQ(mesh.triangles.size(), 13u);
  EXPECT_EQ(mesh.triangle_materials[0], 0);
  EXPECT_EQ(mesh.normals.size(), mesh.positions.size());
  EXPECT_EQ(mesh.uvs.size(), mesh.positions.size());
  const auto tracer = RayTracer::Create(std::move(mesh));
  ASSERT_TRUE(tracer.ok()) << tracer.error().message;
  const CameraSet cameras = *OrbitCameras(4, 1.7, {0, 0, 0}, PinholeFromFov(32, 32, 0.8));
  for (const Camera& camera : cameras.cameras) {
    const auto view = tracer->Render(camera);
    ASSERT_TRUE(view.ok());
    EXPECT_EQ(*std::min_element(view->channel(3), view->channel(3) + view->plane()), 1);
    const auto [least, most] = std::minmax_element(view->channel(0), view->channel(0) + view->plane());
    EXPECT_GT(*most - *least, 0.2f);  // something is painted on them
  }
}

TEST(Backdrop, TheSeedPaintsIt) {
  Mesh a = Triangle(), b = Triangle(), c = Triangle();
  ASSERT_TRUE(AddBackdrop(a, 2, 7).ok() && AddBackdrop(b, 2, 7).ok() && AddBackdrop(c, 2, 8).ok());
  EXPECT_EQ(a.textures[3].rgba, b.textures[3].rgba);
  EXPECT_NE(a.textures[3].rgba, c.textures[3].rgba);
  EXPECT_NE(a.textures[3].rgba, a.textures[4].rgba);
}

TEST(Backdrop, TheObjectMustFit) {
  Mesh mesh = Triangle();
  EXPECT_EQ(AddBackdrop(mesh, 0.4, 1).error().code, ErrorCode::kBadArgument);
  EXPECT_EQ(AddBackdrop(mesh, 0, 1).error().code, ErrorCode::kBadArgument);
}

}  // namespace
}  // namespace anchorsplat
