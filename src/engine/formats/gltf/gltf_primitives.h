#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/gltf/gltf_document.h"
#include "formats/gltf/gltf_place.h"
#include "io/input_file.h"
#include "io/json_file.h"

namespace anchorsplat {

inline constexpr const char* kGltfSplatting = "KHR_gaussian_splatting";

// A primitive of splats in a node, with its accessors checked against each other.
struct GltfPrimitive {
  GltfDocument::Accessor means, quats, scales, opacities;
  std::vector<GltfDocument::Accessor> sh;  // floats, by coefficient
  int degree = 0;
  GltfPlace place;
  bool logarithms = false, logits = false;  // instead of lengths, opacities (gltf_meanings.h)
  bool linear = false;                      // colours are linear light (linear_color.h)
  bool other_sorting = false;               // not sorted by camera distance

  // Whether colours depend on the harmonics, or these are rotated.
  bool mixes_harmonics() const { return degree > 0 && (linear || place.turns()); }
  int64_t count() const { return means.count; }
};

// All splats shown by the scene. Accessors belong to the document.
struct GltfSplats {
  std::vector<GltfPrimitive> primitives;
  int64_t count = 0;                  // of Gaussians
  int degree = 0;                     // highest of all
  WorldOrigin origin = {0, 0, 0};     // of the primitives' placements, in the file's axes
  std::vector<std::string> warnings;  // deviations from what the file states
};
// Errors: those of ReadGltf except read errors.
Result<GltfSplats> FindGltfSplats(const InputFile& file, const GltfDocument& document, const ReadLimits& limits);

// The extension that makes a primitive a splat.
std::optional<JsonValue> SplatExtension(const JsonValue& primitive);

// Splat primitives of meshes. Each mesh is examined once: a hostile file may reference one with a hundred thousand
// primitives from as many nodes.
class MeshSplats {
 public:
  struct Mesh {
    std::vector<JsonValue> splats;
    int64_t others = 0;  // other primitives
  };
  explicit MeshSplats(const GltfDocument& document) : document_(&document) {}

  // Valid as long as this object.
  Result<const Mesh*> Find(const JsonValue& index);

 private:
  const GltfDocument* document_;
  std::map<const nlohmann::json*, Mesh> meshes_;
};

}  // namespace anchorsplat
