#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace anchorsplat {

// What an OBJ file says of materials, each name once and in the order of the file. As assimp, a name is the rest of the
// line, blanks in it included.
struct ObjMaterialNames {
  std::vector<std::string> libraries;  // mtllib
  std::vector<std::string> used;       // usemtl
};
ObjMaterialNames ReadObjMaterialNames(std::string_view obj);

// Adds the names that a material library defines (newmtl).
void AddDefinedMaterials(std::string_view mtl, std::set<std::string>& names);

}  // namespace anchorsplat
