#include "scene/mesh_import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/text.h"
#include "scene/assets_for_test.h"
#include "scene/assimp_files.h"

namespace anchorsplat {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

ImportedMesh Import(const AssetSource& assets, const std::string& name, const MeshReadOptions& options = {}) {
  auto mesh = ImportMesh(assets, name, name, options);
  EXPECT_TRUE(mesh.ok()) << mesh.error().message;
  return mesh.ok() ? *std::move(mesh) : ImportedMesh();
}

Error ImportError(const AssetSource& assets, const std::string& name, const MeshReadOptions& options = {}) {
  const auto mesh = ImportMesh(assets, name, name, options);
  EXPECT_FALSE(mesh.ok());
  return mesh.ok() ? Error() : mesh.error();
}

constexpr const char* kSquare =
    "mtllib square.mtl\n"
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
    "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    "usemtl painted\n"
    "f 1/1 2/2 3/3 4/4\n";

TEST(MeshImport, ReadsAnObjWithItsPicture) {
  MapAssets assets;
  Image image(2, 3, 4);
  for (size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i) / 24;
  assets.files = {{"square.obj", kSquare},
                  {"square.mtl", "newmtl painted\nKd 0.1 0.2 0.3\nd 0.9\nmap_Kd paint.png\n"},
                  {"paint.png", PngBytes(image)}};
  const ImportedMesh imported = Import(assets, "square.obj");
  const Mesh& mesh = imported.mesh;
  EXPECT_THAT(imported.warnings, IsEmpty());
  ASSERT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(mesh.positions.size(), 4u);  // corners that agree are one vertex
  ASSERT_EQ(mesh.uvs.size(), 4u);
  for (size_t v = 0; v < 4; ++v) {
    EXPECT_EQ(mesh.uvs[v][0], mesh.positions[v][0]);
    EXPECT_EQ(mesh.uvs[v][1], mesh.positions[v][1]);  // (0,0) stays the lower left corner
    EXPECT_THAT(mesh.normals[v], ElementsAre(0, 0, 1));
  }
  ASSERT_EQ(mesh.materials.size(), 1u);
  EXPECT_EQ(mesh.materials[0].name, "painted");
  EXPECT_THAT(mesh.materials[0].diffuse, ElementsAre(0.1f, 0.2f, 0.3f));
  EXPECT_FLOAT_EQ(mesh.materials[0].opacity, 0.9f);
  ASSERT_EQ(mesh.materials[0].texture, 0);
  const Texture& texture = mesh.textures[0];
  EXPECT_EQ(texture.width, 2);
  EXPECT_EQ(texture.height, 3);
  EXPECT_TRUE(texture.has_alpha);
  for (int c = 0; c < 4; ++c) {
    for (int y = 0; y < 3; ++y) {
      for (int x = 0; x < 2; ++x) {
        EXPECT_EQ(texture.rgba[static_cast<size_t>((y * 2 + x) * 4 + c)], std::lround(image.at(c, y, x) * 255));
      }
    }
  }
}

TEST(MeshImport, LinesAndPointsDoNotMakeAnObjFail) {
  MapAssets assets;
  assets.files = {{"a.obj", Cat(kSquare, "l 1 2 3 4\np 1\n  l 1//1 \\\n 2//2\nl -1 -2\npoint 3\nlod 5\n")}};
  const ImportedMesh imported = Import(assets, "a.obj");
  EXPECT_EQ(imported.mesh.triangles.size(), 2u);
  EXPECT_EQ(imported.lines_and_points, 4);
}

TEST(MeshImport, BlanksOnlyLinesAndPoints) {
  std::string obj = "v 1 2 3\r\nl 1 2\r\n\tp 3 \\\r\n 4\r\nlights off\nf 1 2 3\nl 1 2";
  EXPECT_EQ(BlankLinesAndPoints(obj), 3);
  EXPECT_EQ(obj, "v 1 2 3\r\n     \r\n\t     \r\n  \r\n          \nf 1 2 3\n     ");
}

TEST(MeshImport, NamesWhatIsMissing) {
  MapAssets assets;
  assets.files = {{"square.obj", kSquare},
                  {"square.mtl", "newmtl painted\nKd 0.1 0.2 0.3\nmap_Kd \"C:\\x\\wood.png\"\n"}};
  const ImportedMesh imported = Import(assets, "square.obj");
  ASSERT_EQ(imported.warnings.size(), 1u);
  EXPECT_THAT(imported.warnings[0], HasSubstr("painted"));
  EXPECT_THAT(imported.warnings[0], HasSubstr("wood.png"));
  EXPECT_THAT(imported.warnings[0], HasSubstr("missing"));
  EXPECT_EQ(imported.mesh.materials[0].texture, -1);
  EXPECT_THAT(imported.mesh.materials[0].diffuse, ElementsAre(0.1f, 0.2f, 0.3f));
  EXPECT_THAT(imported.mesh.textures, IsEmpty());

  assets.files["square.mtl"] = "newmtl painted\nmap_Kd paint.png\n";
  assets.files["paint.png"] = "no picture";
  EXPECT_THAT(Import(assets, "square.obj").warnings, ElementsAre(HasSubstr("paint.png")));

  assets.files.erase("square.mtl");
  EXPECT_EQ(Import(assets, "square.obj").mesh.triangles.size(), 2u);
  EXPECT_THAT(Import(assets, "square.obj").warnings, ElementsAre(HasSubstr("square.mtl"), HasSubstr("painted")));
}

TEST(MeshImport, NamesMaterialsThatNoLibraryDefines) {
  const std::string face = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\nusemtl dark green\nf 1 2 3\n";
  MapAssets assets;
  assets.files = {{"a.obj", face}};  // and names no library, so that none is missing
  EXPECT_THAT(Import(assets, "a.obj").warnings,
              ElementsAre("materials \"red\", \"dark green\" are in no material library: drawn grey"));
  assets.files = {
      {"a.obj", "mtllib a.mtl\nmtllib b.mtl\n" + face}, {"a.mtl", "newmtl red\n"}, {"b.mtl", "newmtl blue\n"}};
  EXPECT_THAT(Import(assets, "a.obj").warnings,
              ElementsAre("material \"dark green\" is in no material library: drawn grey"));
  std::string many;
  for (int i = 0; i < 30; ++i) many += "usemtl m" + std::to_string(i) + "\nf 1 2 3\n";
  assets.files["a.obj"] += many;
  EXPECT_THAT(Import(assets, "a.obj").warnings, ElementsAre(HasSubstr("and 21 more")));
}

TEST(MeshImport, FindsPicturesBesideTheMeshWhateverTheirPathSays) {
  MapAssets assets;
  assets.files = {{"square.obj", kSquare},
                  {"square.mtl", "newmtl painted\nmap_Kd C:\\Users\\me\\my wood.png\n"},
                  {"my wood.png", GreyPng(0.5f)}};
  EXPECT_THAT(Import(assets, "square.obj").warnings, IsEmpty());
}

TEST(MeshImport, DropsTrianglesWithoutAreaAndCountsThem) {
  MapAssets assets;
  assets.files = {{"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nv nan 0 0\nf 1 2 3\nf 1 2 4\nf 1 1 3\nf 1 2 5\n"}};
  const ImportedMesh imported = Import(assets, "a.obj");
  EXPECT_EQ(imported.mesh.triangles.size(), 1u);
  EXPECT_EQ(imported.degenerate + imported.not_finite, 3);
  EXPECT_THAT(imported.warnings, ::testing::Contains(HasSubstr("skipped")));
}

TEST(MeshImport, KeepsTheNormalsOfTheFile) {
  MapAssets assets;
  assets.files = {{"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 3 0 4\nvn 0 0 1\nf 1//1 2//2 3//2\n"}};
  const ImportedMesh imported = Import(assets, "a.obj");
  EXPECT_TRUE(imported.has_normals);
  EXPECT_THAT(imported.mesh.normals[0], ElementsAre(0.6f, 0, 0.8f));
  EXPECT_THAT(imported.mesh.normals[1], ElementsAre(0, 0, 1));
}

TEST(MeshImport, ReadsGltfWithEmbeddedPicture) {
  MapAssets assets;
  assets.files = {{"a.gltf", TriangleGltf(R"({"name":"m","pbrMetallicRoughness":{"baseColorTexture":{"index":0},
    "baseColorFactor":[1,0.214041,0,1]}})")}};
  const ImportedMesh imported = Import(assets, "a.gltf");
  EXPECT_THAT(imported.warnings, IsEmpty());
  ASSERT_EQ(imported.mesh.triangles.size(), 1u);
  const Mesh& mesh = imported.mesh;
  // Moved and mirrored by the node; the winding is turned with it, so that the normal still points to the front.
  for (size_t v = 0; v < 3; ++v) {
    const float x = (10 - mesh.positions[v][0]) / 2, y = mesh.positions[v][1] / 2;
    EXPECT_FLOAT_EQ(mesh.uvs[v][0], x);
    EXPECT_FLOAT_EQ(mesh.uvs[v][1], y);
    EXPECT_THAT(mesh.normals[v], ElementsAre(0, 0, 1));
  }
  ASSERT_EQ(mesh.textures.size(), 1u);
  // 0.214041 linear is ½ in sRGB.
  EXPECT_THAT(mesh.textures[0].rgba, ElementsAre(204, 102, 0, 255));
}

TEST(MeshImport, ReadsVertexColorsOfPly) {
  MapAssets assets;
  assets.files = {{"a.ply",
                   "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                   "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n"
                   "property list uchar int vertex_indices\nend_header\n"
                   "0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 51 51 51\n3 0 1 2\n"}};
  const ImportedMesh imported = Import(assets, "a.ply");
  ASSERT_EQ(imported.mesh.colors.size(), 3u);
  EXPECT_THAT(imported.mesh.colors[0], ElementsAre(1, 0, 0, 1));
  EXPECT_THAT(imported.mesh.colors[2], ElementsAre(0.2f, 0.2f, 0.2f, 1));
}

TEST(MeshImport, ReadsAc3d) {
  MapAssets assets;
  assets.files = {{"a.ac",
                   "AC3Db\nMATERIAL \"m\" rgb 1 1 1 amb 1 1 1 emis 0 0 0 spec 0 0 0 shi 0 trans 0.25\nOBJECT world\n"
                   "kids 1\nOBJECT poly\nname \"part\"\nloc 0 5 0\ntexture \"skin.rgb\"\nnumvert 3\n0 0 0\n1 0 0\n"
                   "0 1 0\nnumsurf 1\nSURF 0x20\nmat 0\nrefs 3\n0 0 0\n1 1 0\n2 0 1\nkids 0\n"},
                  {"skin.rgb", SgiBytes(1, 1, 3, {10, 20, 30})}};
  const ImportedMesh imported = Import(assets, "a.ac");
  EXPECT_THAT(imported.warnings, IsEmpty());
  ASSERT_EQ(imported.mesh.triangles.size(), 1u);
  EXPECT_FLOAT_EQ(imported.mesh.positions[0][1], 5);
  EXPECT_FLOAT_EQ(imported.mesh.materials[0].opacity, 0.75f);
  ASSERT_EQ(imported.mesh.textures.size(), 1u);
  EXPECT_THAT(imported.mesh.textures[0].rgba, ElementsAre(10, 20, 30, 255));
}

TEST(MeshImport, TheProcessOfItsOwnChangesNothing) {
  MapAssets assets;
  assets.files = {{"a.gltf", TriangleGltf(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})")},
                  {"square.obj", kSquare}};
  MeshReadOptions here;
  here.isolated = false;
  for (const char* name : {"a.gltf", "square.obj"}) {
    const ImportedMesh a = Import(assets, name), b = Import(assets, name, here);
    EXPECT_EQ(a.mesh.positions, b.mesh.positions);
    EXPECT_EQ(a.mesh.normals, b.mesh.normals);
    EXPECT_EQ(a.mesh.uvs, b.mesh.uvs);
    EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
    EXPECT_EQ(a.mesh.textures.size(), b.mesh.textures.size());
    EXPECT_EQ(a.warnings, b.warnings);
  }
}

// What assimp's readers believe, never to come back or to fail an assertion.
TEST(MeshImport, PlyHeadersThatPromiseTooMuchAreErrors) {
  const auto ply = [](const char* vertices, const char* faces) {
    return Cat("ply\nformat ascii 1.0\nelement vertex ", vertices,
               "\nproperty float x\nproperty float y\nproperty float z\nelement face ", faces,
               "\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  };
  MapAssets assets;
  assets.files = {{"a.ply", ply("3", "1")}};
  EXPECT_EQ(Import(assets, "a.ply").mesh.triangles.size(), 1u);
  for (const auto& [vertices, faces] : {std::pair("4294967295", "1"), {"3", "100"}, {"3", "1e308"}, {"3", "-1"}}) {
    assets.files["a.ply"] = ply(vertices, faces);
    EXPECT_THAT(ImportError(assets, "a.ply").message, HasSubstr("a.ply: header: "));
  }
}

TEST(MeshImport, RefusesWithASentence) {
  MapAssets assets;
  assets.files = {{"empty.obj", ""},
                  {"points.obj", "v 0 0 0\np 1\n"},
                  {"flat.obj", "v 0 0 0\nv 1 0 0\nf 1 2 1\n"},
                  {"text.gltf", "hello"},
                  {"a.docx", "PK"}};
  EXPECT_EQ(ImportError(assets, "none.obj").code, ErrorCode::kNotFound);
  for (const auto& [name, bytes] : assets.files) {
    const Error error = ImportError(assets, name);
    EXPECT_EQ(error.code, ErrorCode::kBadFile) << name;
    EXPECT_THAT(error.message, HasSubstr(name));
  }
}

TEST(MeshImport, KeepsToItsLimits) {
  MapAssets assets;
  assets.files = {{"square.obj", kSquare},
                  {"square.mtl", "newmtl painted\nmap_Kd paint.png\n"},
                  {"paint.png", PngBytes(Image(8, 8, 3))}};
  MeshReadOptions few_vertices, short_file, small_picture, triangles_only;
  few_vertices.limits.max_vertices = 3;
  EXPECT_THAT(ImportError(assets, "square.obj", few_vertices).message, HasSubstr("vertices"));
  short_file.limits.max_file_bytes = 20;
  EXPECT_EQ(ImportError(assets, "square.obj", short_file).code, ErrorCode::kBadFile);
  triangles_only.limits.max_polygon = 3;
  EXPECT_THAT(ImportError(assets, "square.obj", triangles_only).message, HasSubstr("corners"));
  small_picture.limits.max_texture_pixels = 63;
  EXPECT_THAT(Import(assets, "square.obj", small_picture).warnings, ElementsAre(HasSubstr("pixels")));
}

// A tree in which every node shows the same mesh: few bytes, many triangles.
TEST(MeshImport, InstancesCountAgainstTheLimit) {
  MapAssets assets;
  std::string gltf = TriangleGltf("{}");
  std::string nodes = "\"nodes\":[{\"mesh\":0}";
  std::string roots = "0";
  for (int k = 1; k < 50; ++k) {
    nodes += ",{\"mesh\":0}";
    roots += Cat(",", k);
  }
  const auto replace = [&](const std::string& from, const std::string& to) {
    gltf.replace(gltf.find(from), from.size(), to);
  };
  replace("\"nodes\":[0]", "\"nodes\":[" + roots + "]");
  replace("\"nodes\":[{\"mesh\":0,\"translation\":[10,0,0],\"scale\":[-2,2,2]}", nodes);
  assets.files = {{"a.gltf", gltf}};
  EXPECT_EQ(Import(assets, "a.gltf").mesh.triangles.size(), 50u);
  MeshReadOptions options;
  options.limits.max_vertices = 149;
  EXPECT_THAT(ImportError(assets, "a.gltf", options).message, HasSubstr("instances"));
}

}  // namespace
}  // namespace anchorsplat
