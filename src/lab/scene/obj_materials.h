#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace anchorsplat {

// Material names in an OBJ file, each once, in file order. As in assimp, a name is the rest of the line, including
// blanks.
struct ObjMaterialNames {
  std::vector<std::string> libraries;  // mtllib
  std::vector<std::string> used;       // usemtl
};
ObjMaterialNames ReadObjMaterialNames(std::string_view obj);

// Adds the names that a material library defines (newmtl).
void AddDefinedMaterials(std::string_view mtl, std::set<std::string>& names);

}  // namespace anchorsplat
