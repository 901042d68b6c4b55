#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "scene/mesh.h"

namespace anchorsplat {

// The name of an object's folder, from where its mesh is: letters, digits, '.', '_' and '-'. Objects of a furniture
// library begin with the library's name. Depends on the address alone, so that a list can be continued in any order.
std::string ObjectName(const std::string& mesh_address);

// What variants of one model have in common: the name in lower case without numbers, sizes, sides and colours at its
// end ("sofa2", "Sofa_red", "sofa-left" → "sofa"). Different models may share a stem; variants of one never differ in
// it.
std::string VariantStem(std::string_view name);

// A short text that copies and recolourings of a model share: triangles, proportions and area, rounded. Expects a mesh
// in the unit cube.
std::string Fingerprint(const Mesh& mesh);

// FNV-1a, 64 bits: the same on every machine.
uint64_t StableHash(std::string_view text, uint64_t seed = 0);

}  // namespace anchorsplat
