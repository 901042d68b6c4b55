#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "io/input_file.h"
#include "io/json_file.h"

namespace anchorsplat {

// A glTF file with its buffers: accessors and node transforms.
class GltfDocument {
 public:
  // Errors: those of ReadGltf.
  static Result<GltfDocument> Open(const InputFile& file);

  JsonValue root() const { return json_.root(); }
  // Of the document and its buffer files.
  uint64_t bytes() const { return file_->size() + bytes_beside_; }

  // Location of an accessor's values, whose bytes have been checked to exist.
  struct Accessor {
    const InputFile* file = nullptr;
    uint64_t begin = 0, stride = 0;
    int64_t count = 0;
    int components = 0;      // 1 SCALAR, 3 VEC3, 4 VEC4
    int component_type = 0;  // glTF code: 5120 byte … 5126 float
    bool normalized = false;
  };
  Result<Accessor> FindAccessor(const JsonValue& index) const;

  // A mesh in a node of the scene: x' = matrix·x + translation (row-major).
  struct Placed {
    JsonValue node, mesh;
    std::array<double, 9> matrix = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    std::array<double, 3> translation = {0, 0, 0};
    bool shown = true;      // in the scene, and not hidden
    bool animated = false;  // an animation moves the node or an ancestor
  };
  // Uses the default scene, else the first; without scenes, all nodes are shown.
  Result<std::vector<Placed>> PlacedMeshes() const;

  // Element `index` of the document's array `key`.
  Result<JsonValue> Element(const char* key, const JsonValue& index) const;

 private:
  struct Buffer {
    std::optional<InputFile> own;  // none: the binary chunk of the file itself
    uint64_t begin = 0, size = 0;
  };
  GltfDocument(const InputFile& file, JsonFile json) : file_(&file), json_(std::move(json)) {}
  Result<std::vector<char>> RootsOfScene(size_t nodes, const std::vector<char>& is_child) const;
  std::vector<char> AnimatedNodes(size_t nodes) const;
  Status OpenBuffers(uint64_t binary_begin, uint64_t binary_size);

  const InputFile* file_;
  JsonFile json_;
  std::vector<Buffer> buffers_;
  uint64_t bytes_beside_ = 0;
};

}  // namespace anchorsplat
