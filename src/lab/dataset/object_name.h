#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "scene/mesh.h"

namespace anchorsplat {

// Turns a text into an object's folder name: letters, digits, '.', '_' and '-', not starting with '.'. Names reserved
// by data sets (manifest.jsonl, splits.json, temporary files such as "chair.log") get the suffix "-object". May be
// empty.
std::string SafeName(const std::string& text);

// Folder name of an object from its mesh address, as SafeName. Objects of a furniture library start with the library's
// name. Depends on the address alone.
std::string ObjectName(const std::string& mesh_address);

// The common stem of a model's variants: the name in lower case without trailing numbers, sizes, sides and colours
// ("sofa2", "Sofa_red", "sofa-left" → "sofa"). Different models may share a stem; variants of one never differ in it.
std::string VariantStem(std::string_view name);

// Short text shared by copies and recolourings of a model: triangle count, proportions and area, rounded. Requires a
// mesh in the unit cube.
std::string MeshFingerprint(const Mesh& mesh);

// FNV-1a, 64 bits; the same on every machine.
uint64_t StableHash(std::string_view text, uint64_t seed = 0);

}  // namespace anchorsplat
