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

// A glTF file with its buffers, and what of it concerns numbers: accessors and the places of nodes.
class GltfDocument {
 public:
  // Errors as ReadGltf.
  static Result<GltfDocument> Open(const InputFile& file);

  JsonValue root() const { return json_.root(); }
  // Of the document and the files beside it that its buffers are.
  uint64_t bytes() const { return file_->size() + bytes_beside_; }

  // Where the values of an accessor lie. Its bytes have been checked to be there.
  struct Accessor {
    const InputFile* file = nullptr;
    uint64_t begin = 0, stride = 0;
    int64_t count = 0;
    int components = 0;      // 1 SCALAR, 3 VEC3, 4 VEC4
    int component_type = 0;  // glTF's number: 5120 byte … 5126 float
    bool normalized = false;
  };
  Result<Accessor> FindAccessor(const JsonValue& index) const;

  // A mesh as a node of the scene shows it: x' = matrix·x + translation (row-major).
  struct Placed {
    JsonValue node, mesh;
    std::array<double, 9> matrix = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    std::array<double, 3> translation = {0, 0, 0};
    bool shown = true;      // the scene has it, and nothing hides it
    bool animated = false;  // an animation moves the node, or one above it
  };
  // The scene is the document's default one, or the first; without scenes all nodes are shown.
  Result<std::vector<Placed>> PlacedMeshes() const;

  // Element `index` of the array `key` of the document.
  Result<JsonValue> Element(const char* key, const JsonValue& index) const;

 private:
  struct Buffer {
    std::optional<InputFile> own;  // nothing: the binary chunk of the file itself
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
