#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "scene/mesh.h"

namespace anchorsplat {

// A text as the name of an object's folder: letters, digits, '.', '_' and '-', no '.' in front. Names that a data set
// needs for itself (manifest.jsonl, splits.json; those of its files on the way, such as "chair.log") end in "-object".
// Empty where nothing is left.
std::string SafeName(const std::string& text);

// The name of an object's folder, from where its mesh is, as SafeName. Objects of a furniture library begin with the
// library's name. Depends on the address alone.
std::string ObjectName(const std::string& mesh_address);

// What variants of one model have in common: the name in lower case without numbers, sizes, sides and colours at its
// end ("sofa2", "Sofa_red", "sofa-left" → "sofa"). Different models may share a stem; variants of one never differ in
// it.
std::string VariantStem(std::string_view name);

// A short text that copies and recolourings of a model share: triangles, proportions and area, rounded. Expects a mesh
// in the unit cube.
std::string MeshFingerprint(const Mesh& mesh);

// FNV-1a, 64 bits: the same on every machine.
uint64_t StableHash(std::string_view text, uint64_t seed = 0);

}  // namespace anchorsplat
