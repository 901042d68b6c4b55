#include "scene/obj_materials.h"

#include <algorithm>
#include <functional>

namespace anchorsplat {

namespace {

constexpr std::string_view kBlanks = " \t\r";

std::string_view Trimmed(std::string_view text) {
  const size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

// Calls `take` with keyword and rest for every line that has both.
void ForEachStatement(std::string_view text,
                      const std::function<void(std::string_view statement, std::string_view name)>& take) {
  while (!text.empty()) {
    const size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = Trimmed(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    const size_t blank = line.find_first_of(kBlanks);
    if (blank != std::string_view::npos) take(line.substr(0, blank), Trimmed(line.substr(blank)));
  }
}

}  // namespace

ObjMaterialNames ReadObjMaterialNames(std::string_view obj) {
  ObjMaterialNames names;
  std::set<std::string_view> libraries, used;
  ForEachStatement(obj, [&](std::string_view statement, std::string_view name) {
    if (statement == "mtllib" && libraries.insert(name).second) names.libraries.emplace_back(name);
    if (statement == "usemtl" && used.insert(name).second) names.used.emplace_back(name);
  });
  return names;
}

void AddDefinedMaterials(std::string_view mtl, std::set<std::string>& names) {
  ForEachStatement(mtl, [&](std::string_view statement, std::string_view name) {
    if (statement == "newmtl") names.emplace(name);
  });
}

}  // namespace anchorsplat
