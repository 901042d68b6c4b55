#include "scene/furniture_catalog.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "io/folder_for_test.h"
#include "scene/assets_for_test.h"
#include "scene/mesh_reader.h"

namespace anchorsplat {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kTriangle = "mtllib t.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n";
constexpr const char* kList =
    "# Models under the Creative Commons Attribution 3.0\n"
    "id=test\nname=Test library\nlicense=free\n"
    "name#1=Caf\xe9 table\ncategory#1=Kitchen\ncreator#1=Ann\\u00e9\nmodel#1=/lib/table/t.obj\n"
    "name#2=Lamp\nmodel#2=lib/lamp/t.obj\nmodelRotation#2=0 0 1 0 1 0 -1 0 0\n"
    "name#3=Ghost\n"
    "name#10=Broken\nmodel#10=/lib/broken.obj\nlicense#10=Creative Commons Zero\n";

void WriteLibrary(const std::filesystem::path& path, const std::vector<std::pair<std::string, std::string>>& members) {
  auto file = OutputFile::Create(path, true).value();
  ZipWriter zip(file);
  for (const auto& [name, bytes] : members) ASSERT_TRUE(zip.Add(name, bytes).ok());
  ASSERT_TRUE(zip.Finish().ok());
  ASSERT_TRUE(file.Commit().ok());
}

class Library : public ::testing::Test {
 protected:
  void SetUp() override {
    Image picture(1, 1, 3);
    for (int c = 0; c < 3; ++c) picture.at(c, 0, 0) = c == 0 ? 1.0f : 0.0f;
    WriteLibrary(path_, {{"PluginFurnitureCatalog.properties", kList},
                         {"lib/table/t.obj", kTriangle},
                         {"lib/table/t.mtl", "newmtl m\nmap_Kd Red.PNG\n"},
                         {"lib/table/red.png", PngBytes(picture)},
                         {"lib/table/BLEND_LICENSE.txt", "Creative Commons Zero, added CC-BY texture"},
                         {"lib/lamp/t.obj", kTriangle},
                         {"lib/lamp/t.mtl", "newmtl m\nKd 0 1 0\n"},
                         {"lib/broken.obj", "v 0 0 0\n"}});
  }

  TestFolder folder_;
  std::filesystem::path path_ = folder_ / "lib.sh3f";
};

TEST_F(Library, ListsItsObjects) {
  const auto catalog = FurnitureCatalog::Open(path_);
  ASSERT_TRUE(catalog.ok()) << catalog.error().message;
  EXPECT_EQ(catalog->name(), "Test library");
  ASSERT_EQ(catalog->entries().size(), 3u);  // an entry without model is none
  const CatalogEntry& table = catalog->entries()[0];
  EXPECT_EQ(table.key, "t");
  EXPECT_EQ(table.model, "lib/table/t.obj");
  EXPECT_EQ(table.origin.name, "Caf\u00e9 table");
  EXPECT_EQ(table.origin.category, "Kitchen");
  EXPECT_EQ(table.origin.creator, "Ann\u00e9");
  // Licences: of the model's own file with the library's for the picture; of the library's comment; of the entry.
  EXPECT_EQ(table.origin.licence, "CC0-1.0 AND CC-BY-3.0");
  EXPECT_EQ(table.origin.licence_source, "lib/table/BLEND_LICENSE.txt");
  EXPECT_EQ(catalog->entries()[1].origin.licence, "CC-BY-3.0");
  EXPECT_EQ(catalog->entries()[2].origin.licence, "CC0-1.0");
}

TEST_F(Library, ReadsAnObjectWithItsPicture) {
  const auto mesh = ReadMesh(path_.string() + "#t");
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_THAT(mesh->warnings, IsEmpty());
  ASSERT_EQ(mesh->mesh.textures.size(), 1u);
  EXPECT_THAT(mesh->mesh.textures[0].rgba, ElementsAre(255, 0, 0, 255));
  EXPECT_EQ(mesh->origin.creator, "Ann\u00e9");
}

TEST_F(Library, TurnsAnObjectAsItsEntrySays) {
  const auto mesh = ReadMesh(path_.string() + "##2");
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_THAT(mesh->mesh.positions[1], ElementsAre(0, 0, -1));
  EXPECT_THAT(mesh->mesh.normals[0], ElementsAre(1, 0, 0));
}

TEST_F(Library, AddressesOfAllObjectsReadThem) {
  const auto all = ExpandMeshAddress(path_.string());
  ASSERT_TRUE(all.ok());
  // Both models are called t: the second goes by its number.
  EXPECT_THAT(*all, ElementsAre(path_.string() + "#t", path_.string() + "##2", path_.string() + "#broken"));
  EXPECT_EQ(ReadMesh((*all)[1])->origin.name, "Lamp");
}

TEST_F(Library, RefusesWithASentence) {
  const auto broken = ReadMesh(path_.string() + "#broken");
  ASSERT_FALSE(broken.ok());
  EXPECT_THAT(broken.error().message, HasSubstr("lib.sh3f#broken"));
  const auto none = ReadMesh(path_.string() + "#chair");
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::kNotFound);
  EXPECT_EQ(ReadMesh(path_.string()).error().code, ErrorCode::kBadArgument);
  EXPECT_EQ(ReadMesh((folder_ / "no.sh3f#a").string()).error().code, ErrorCode::kNotFound);
  WriteLibrary(path_, {{"PluginFurnitureCatalog.properties", "name=nothing"}});
  EXPECT_EQ(FurnitureCatalog::Open(path_).error().code, ErrorCode::kBadFile);
  WriteLibrary(path_, {{"readme", "no list"}});
  EXPECT_EQ(FurnitureCatalog::Open(path_).error().code, ErrorCode::kBadFile);
  std::ofstream(path_) << "no archive";
  EXPECT_EQ(FurnitureCatalog::Open(path_).error().code, ErrorCode::kBadFile);
}

}  // namespace
}  // namespace anchorsplat
