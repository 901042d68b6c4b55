#include "scene/obj_materials.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace anchorsplat {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(ObjMaterials, NamesAreTheRestOfTheLine) {
  const ObjMaterialNames names = ReadObjMaterialNames(
      "mtllib my wood.mtl \r\n# usemtl no\n\tusemtl  dark oak\nusemtl\nusemtl a\nusemtl dark oak\nusemtlx b\nmtllib "
      "b.mtl");
  EXPECT_THAT(names.libraries, ElementsAre("my wood.mtl", "b.mtl"));
  EXPECT_THAT(names.used, ElementsAre("dark oak", "a"));
  EXPECT_THAT(ReadObjMaterialNames("").used, IsEmpty());
  EXPECT_THAT(ReadObjMaterialNames("usemtl").used, IsEmpty());
}

TEST(ObjMaterials, LibrariesDefineByNewmtl) {
  std::set<std::string> names = {"known"};
  AddDefinedMaterials("newmtl dark oak\r\nKd 1 1 1\nmap_Kd newmtl.png\nnewmtl a", names);
  EXPECT_THAT(names, ElementsAre("a", "dark oak", "known"));
}

}  // namespace
}  // namespace anchorsplat
