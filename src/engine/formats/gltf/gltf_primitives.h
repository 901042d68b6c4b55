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

// A primitive of splats as a node shows it, its accessors checked against each other.
struct GltfPrimitive {
  GltfDocument::Accessor means, quats, scales, opacities;
  std::vector<GltfDocument::Accessor> sh;  // floats, by coefficient
  int degree = 0;
  GltfPlace place;
  bool logarithms = false, logits = false;  // in the place of lengths, of opacities (gltf_meanings.h)
  bool linear = false;                      // its colours are linear light (linear_color.h)
  bool other_sorting = false;               // than by the distance to the camera

  // Its harmonics have to be seen to know its colours, or are turned.
  bool mixes_harmonics() const { return degree > 0 && (linear || place.turns()); }
  int64_t count() const { return means.count; }
};

// All that the scene's nodes show. The accessors are the document's.
struct GltfSplats {
  std::vector<GltfPrimitive> primitives;
  int64_t count = 0;                  // of their Gaussians
  int degree = 0;                     // the highest
  WorldOrigin origin = {0, 0, 0};     // that the places of primitives are from, in the file's axes
  std::vector<std::string> warnings;  // what is read otherwise than the file says
};
// Errors as ReadGltf, but for those of reading.
Result<GltfSplats> FindGltfSplats(const InputFile& file, const GltfDocument& document, const ReadLimits& limits);

// What makes a primitive a splat.
std::optional<JsonValue> SplatExtension(const JsonValue& primitive);

// The primitives of meshes. Each mesh is looked through once: a hostile file shows one with a hundred thousand
// primitives by as many nodes.
class MeshSplats {
 public:
  struct Mesh {
    std::vector<JsonValue> splats;
    int64_t others = 0;  // primitives that are none
  };
  explicit MeshSplats(const GltfDocument& document) : document_(&document) {}

  // Valid as long as this lives.
  Result<const Mesh*> Find(const JsonValue& index);

 private:
  const GltfDocument* document_;
  std::map<const nlohmann::json*, Mesh> meshes_;
};

}  // namespace anchorsplat
