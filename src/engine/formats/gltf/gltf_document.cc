#include "formats/gltf/gltf_document.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "core/rotation.h"
#include "core/text.h"
#include "io/size_limit.h"

namespace anchorsplat {

namespace {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie in the file");

constexpr uint64_t kMaxJson = uint64_t{256} << 20;
constexpr int kMost = std::numeric_limits<int>::max();
constexpr std::string_view kBase64 = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

std::optional<std::string> FromBase64(std::string_view text) {
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  std::string bytes;
  uint32_t bits = 0;
  int held = 0;
  for (const char c : text) {
    const size_t digit = kBase64.find(c);
    if (digit == kBase64.npos) return std::nullopt;
    bits = bits << 6 | static_cast<uint32_t>(digit);
    held += 6;
    if (held >= 8) {
      held -= 8;
      bytes += static_cast<char>(bits >> held & 255);
    }
  }
  return bytes;
}

// The file of a relative URI, with percent-decoding. None if it leads to another folder or has a scheme, for safety.
std::optional<std::string> FileBeside(std::string_view uri) {
  if (uri.find(':') != uri.npos) return std::nullopt;
  std::string name;
  for (size_t k = 0; k < uri.size(); ++k) {
    unsigned char byte = static_cast<unsigned char>(uri[k]);
    if (uri[k] == '%') {
      const std::string_view digits = uri.substr(k + 1, 2);
      const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), byte, 16);
      if (digits.size() != 2 || code != std::errc() || end != digits.data() + 2) return std::nullopt;
      k += 2;
    }
    if (byte == '/' || byte == '\\' || byte == 0) return std::nullopt;
    name += static_cast<char>(byte);
  }
  if (name.empty() || name == "." || name == "..") return std::nullopt;
  return name;
}

// glTF integers may exceed an int: offsets and lengths.
Result<uint64_t> Offset(const JsonValue& object, const char* key, std::optional<uint64_t> otherwise) {
  const std::optional<JsonValue> value = object.Find(key);
  if (!value) {
    if (otherwise) return *otherwise;
    return object.Get(key).error();
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const double number, value->Number());
  if (number < 0 || number > 9e15 || number != std::floor(number)) {
    return value->Complain("expected a whole number of bytes");
  }
  return static_cast<uint64_t>(number);
}

using Matrix = std::array<double, 9>;
using Vector = std::array<double, 3>;

Vector Apply(const Matrix& m, const Vector& x) {
  return {m[0] * x[0] + m[1] * x[1] + m[2] * x[2], m[3] * x[0] + m[4] * x[1] + m[5] * x[2],
          m[6] * x[0] + m[7] * x[1] + m[8] * x[2]};
}

Matrix Product(const Matrix& a, const Matrix& b) {
  Matrix out{};
  for (size_t r = 0; r < 3; ++r) {
    for (size_t c = 0; c < 3; ++c) out[3 * r + c] = a[3 * r] * b[c] + a[3 * r + 1] * b[3 + c] + a[3 * r + 2] * b[6 + c];
  }
  return out;
}

struct Motion {
  Matrix matrix = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  Vector translation = {0, 0, 0};
};

// The transform of `node`, followed by `outer`.
Result<Motion> MotionOf(const JsonValue& node, const Motion& outer) {
  Motion own;
  if (const std::optional<JsonValue> matrix = node.Find("matrix")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> m, matrix->Numbers(16));  // column-major
    if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1) {
      return matrix->Complain("has a last row other than 0 0 0 1");
    }
    for (size_t r = 0; r < 3; ++r) {
      for (size_t c = 0; c < 3; ++c) own.matrix[3 * r + c] = m[4 * c + r];
      own.translation[r] = m[12 + r];
    }
  }
  if (const std::optional<JsonValue> translation = node.Find("translation")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> t, translation->Numbers(3));
    for (size_t k = 0; k < 3; ++k) own.translation[k] += t[k];
  }
  if (const std::optional<JsonValue> rotation = node.Find("rotation")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> q, rotation->Numbers(4));  // xyzw
    if (!(std::hypot(q[0], q[1], std::hypot(q[2], q[3])) > 0)) return rotation->Complain("is zero, not a rotation");
    own.matrix = Product(own.matrix, RotationFromQuaternion(q[3], q[0], q[1], q[2]));
  }
  if (const std::optional<JsonValue> scale = node.Find("scale")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> s, scale->Numbers(3));
    own.matrix = Product(own.matrix, {s[0], 0, 0, 0, s[1], 0, 0, 0, s[2]});
  }
  const Vector moved = Apply(outer.matrix, own.translation);
  for (size_t k = 0; k < 3; ++k) own.translation[k] = outer.translation[k] + moved[k];
  own.matrix = Product(outer.matrix, own.matrix);
  return own;
}

// KHR_node_visibility: hides a node and its descendants.
bool IsHidden(const JsonValue& node) {
  const std::optional<JsonValue> extensions = node.Find("extensions");
  const std::optional<JsonValue> visibility = extensions ? extensions->Find("KHR_node_visibility") : std::nullopt;
  const std::optional<JsonValue> visible = visibility ? visibility->Find("visible") : std::nullopt;
  return visible && visible->raw().is_boolean() && !visible->raw().get<bool>();
}

int ComponentSize(int type) { return type <= 5121 ? 1 : type <= 5123 ? 2 : 4; }

}  // namespace

Result<GltfDocument> GltfDocument::Open(const InputFile& file) {
  uint32_t words[5] = {0, 0, 0, 0, 0};  // "glTF", version, length; length of the JSON, "JSON"
  ANCHORSPLAT_RETURN_IF_ERROR(
      file.ReadAt(0, words, static_cast<size_t>(std::min<uint64_t>(file.size(), sizeof words))));
  uint64_t json_begin = 0, json_size = file.size(), binary_begin = 0, binary_size = 0;
  if (words[0] == 0x46546c67) {
    json_begin = sizeof words;
    json_size = words[3];
    if (file.size() < json_begin || words[1] != 2 || words[4] != 0x4e4f534a || json_size > file.size() - json_begin) {
      return Error{
          ErrorCode::kBadFile,
          Cat(file.name(), ": byte 4: is not a GLB file of version 2 with a JSON chunk of ", words[3], " bytes")};
    }
    if (words[2] != file.size()) {
      return Error{ErrorCode::kBadFile,
                   Cat(file.name(), ": byte 8: the header says ", words[2], " bytes, but the file has ", file.size(),
                       ": it was truncated or extended")};
    }
    const uint64_t chunk = json_begin + json_size;
    if (file.size() - chunk >= 8) {
      uint32_t binary[2];
      ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(chunk, binary, sizeof binary));
      if (binary[1] == 0x004e4942) {
        binary_begin = chunk + 8;
        binary_size = binary[0];
        if (binary_size > file.size() - binary_begin) {
          return Error{ErrorCode::kBadFile, Cat(file.name(), ": byte ", chunk, ": a binary chunk of ", binary[0],
                                                " bytes, but only ", file.size() - binary_begin, " are left")};
        }
      }
    }
  }
  if (json_size > kMaxJson) {
    return Error{ErrorCode::kBadFile, Cat(file.name(), ": has ", MoreThanLimit(json_size, kMaxJson, " of JSON"))};
  }
  std::string text(static_cast<size_t>(json_size), '\0');
  ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(json_begin, text.data(), text.size()));
  ANCHORSPLAT_ASSIGN_OR_RETURN(JsonFile json, JsonFile::Parse(file.name(), text));
  GltfDocument document(file, std::move(json));
  ANCHORSPLAT_RETURN_IF_ERROR(document.OpenBuffers(binary_begin, binary_size));
  return document;
}

Status GltfDocument::OpenBuffers(uint64_t binary_begin, uint64_t binary_size) {
  const std::optional<JsonValue> list = root().Find("buffers");
  if (!list) return {};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> buffers, list->Elements());
  for (const JsonValue& value : buffers) {
    Buffer buffer;
    ANCHORSPLAT_ASSIGN_OR_RETURN(const uint64_t length, Offset(value, "byteLength", {}));
    if (const std::optional<JsonValue> uri = value.Find("uri")) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string name, uri->Text());
      if (name.starts_with("data:")) {
        const size_t comma = name.find(";base64,");
        std::optional<std::string> bytes;
        if (comma != name.npos) bytes = FromBase64(std::string_view(name).substr(comma + 8));
        if (!bytes) return uri->Complain("expected data in base64");
        buffer.own = InputFile::FromBytes(Cat(file_->name(), ": a buffer inside"), std::move(*bytes));
      } else {
        const std::optional<std::string> beside = FileBeside(name);
        if (!beside) {
          return uri->Complain(Cat("expected the name of a file beside it, found \"", Printable(name), "\""));
        }
        Result<InputFile> opened = file_->OpenBeside(*beside);
        if (!opened.ok()) return Error{opened.error().code, uri->Complain(opened.error().message).message};
        buffer.own = *std::move(opened);
        bytes_beside_ += buffer.own->size();
      }
      buffer.size = buffer.own->size();
    } else {
      buffer.begin = binary_begin;
      buffer.size = binary_size;
    }
    if (length > buffer.size) {
      return value.Complain(Cat("has a byteLength of ", length, ", but there are ", buffer.size, " bytes"));
    }
    buffer.size = length;
    buffers_.push_back(std::move(buffer));
  }
  return {};
}

Result<JsonValue> GltfDocument::Element(const char* key, const JsonValue& index) const {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue list, root().Get(key));
  if (!list.raw().is_array()) return list.Complain("expected an array");
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int at, index.WholeNumber(0, kMost));
  if (static_cast<size_t>(at) >= list.raw().size()) {
    return index.Complain(Cat("is ", at, ", but there are ", list.raw().size(), " ", key));
  }
  return list.Element(static_cast<size_t>(at));
}

Result<GltfDocument::Accessor> GltfDocument::FindAccessor(const JsonValue& index) const {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue value, Element("accessors", index));
  Accessor accessor;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue count, value.Get("count"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(accessor.count, count.WholeNumber(1, kMost));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue type, value.Get("type"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string name, type.Text());
  accessor.components = name == "SCALAR" ? 1 : name == "VEC3" ? 3 : name == "VEC4" ? 4 : 0;
  if (accessor.components == 0) return type.Complain("expected SCALAR, VEC3 or VEC4");
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue component, value.Get("componentType"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(accessor.component_type, component.WholeNumber(5120, 5126));
  const std::optional<JsonValue> normalized = value.Find("normalized");
  accessor.normalized = normalized && normalized->raw().is_boolean() && normalized->raw().get<bool>();
  if (value.has("sparse")) return value.Complain("is sparse, which is not supported");
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue view_index, value.Get("bufferView"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue view, Element("bufferViews", view_index));
  if (const std::optional<JsonValue> extensions = view.Find("extensions");
      extensions && extensions->raw().is_object() && !extensions->raw().empty()) {
    return extensions->Complain(Cat("uses ", Printable(extensions->raw().begin().key()), ", which is not supported"));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonValue buffer_index, view.Get("buffer"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int at, buffer_index.WholeNumber(0, kMost));
  if (static_cast<size_t>(at) >= buffers_.size()) {
    return buffer_index.Complain(Cat("is ", at, ", but there are ", buffers_.size(), " buffers"));
  }
  const Buffer& buffer = buffers_[static_cast<size_t>(at)];
  ANCHORSPLAT_ASSIGN_OR_RETURN(const uint64_t view_begin, Offset(view, "byteOffset", 0));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const uint64_t view_size, Offset(view, "byteLength", {}));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const uint64_t begin, Offset(value, "byteOffset", 0));
  const uint64_t record = static_cast<uint64_t>(accessor.components * ComponentSize(accessor.component_type));
  ANCHORSPLAT_ASSIGN_OR_RETURN(accessor.stride, Offset(view, "byteStride", record));
  // All values are below 2^53 and the stride below 2^8: no overflow.
  if (accessor.stride < record || accessor.stride > 252) return view.Complain("has an impossible byteStride");
  const uint64_t end = begin + accessor.stride * static_cast<uint64_t>(accessor.count - 1) + record;
  if (end > view_size || view_begin > buffer.size || view_size > buffer.size - view_begin) {
    return value.Complain(Cat("needs ", end, " bytes of a view of ", view_size, " at byte ", view_begin,
                              " of a buffer of ", buffer.size));
  }
  accessor.file = buffer.own ? &*buffer.own : file_;
  accessor.begin = buffer.begin + view_begin + begin;
  return accessor;
}

// Per node: whether it is a root of the shown scene.
Result<std::vector<char>> GltfDocument::RootsOfScene(size_t nodes, const std::vector<char>& is_child) const {
  const std::optional<JsonValue> scenes = root().Find("scenes");
  if (!scenes || !scenes->raw().is_array() || scenes->raw().empty()) return std::vector<char>(nodes, 1);
  std::vector<char> roots(nodes, 0);
  JsonValue scene = scenes->Element(0);
  if (const std::optional<JsonValue> index = root().Find("scene")) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(scene, Element("scenes", *index));
  }
  const std::optional<JsonValue> list = scene.Find("nodes");
  if (!list) return roots;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> indices, list->Elements());
  for (const JsonValue& index : indices) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const int at, index.WholeNumber(0, kMost));
    if (static_cast<size_t>(at) >= nodes) return index.Complain("is not a node");
    if (is_child[static_cast<size_t>(at)] != 0) return index.Complain("is a child of another node, not a root");
    roots[static_cast<size_t>(at)] = 1;
  }
  return roots;
}

// Per node: whether an animation moves it. Invalid animations are ignored.
std::vector<char> GltfDocument::AnimatedNodes(size_t nodes) const {
  std::vector<char> moved(nodes, 0);
  const nlohmann::json none = nlohmann::json::array();
  const auto array_of = [&none](const nlohmann::json& json, const char* key) -> const nlohmann::json& {
    return json.is_object() && json.contains(key) && json[key].is_array() ? json[key] : none;
  };
  for (const nlohmann::json& animation : array_of(root().raw(), "animations")) {
    for (const nlohmann::json& channel : array_of(animation, "channels")) {
      if (!channel.is_object() || !channel.contains("target") || !channel["target"].is_object()) continue;
      const auto node = channel["target"].find("node");
      if (node == channel["target"].end() || !node->is_number_unsigned() || node->get<size_t>() >= nodes) continue;
      moved[node->get<size_t>()] = 1;
    }
  }
  return moved;
}

Result<std::vector<GltfDocument::Placed>> GltfDocument::PlacedMeshes() const {
  std::vector<Placed> out;
  const std::optional<JsonValue> list = root().Find("nodes");
  if (!list) return out;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> nodes, list->Elements());
  // Each node has at most one parent, so traversal reaches it once; a second time means a cycle.
  std::vector<char> is_child(nodes.size(), 0);
  const auto children_of = [&](const JsonValue& node) -> Result<std::vector<size_t>> {
    std::vector<size_t> children;
    const std::optional<JsonValue> value = node.Find("children");
    if (!value) return children;
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> indices, value->Elements());
    for (const JsonValue& index : indices) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const int at, index.WholeNumber(0, kMost));
      if (static_cast<size_t>(at) >= nodes.size()) return index.Complain("is not a node");
      children.push_back(static_cast<size_t>(at));
    }
    return children;
  };
  for (const JsonValue& node : nodes) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<size_t> children, children_of(node));
    for (const size_t child : children) {
      if (std::exchange(is_child[child], 1) != 0) return node.Complain("shares a child with another node");
    }
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<char> in_scene, RootsOfScene(nodes.size(), is_child));
  const std::vector<char> moved = AnimatedNodes(nodes.size());
  struct Visit {
    size_t node;
    Motion motion;
    bool shown, animated;
  };
  std::vector<Visit> stack;
  for (size_t k = nodes.size(); k-- > 0;) {
    if (is_child[k] == 0) stack.push_back({k, {}, in_scene[k] != 0, false});
  }
  size_t visited = 0;
  while (!stack.empty()) {
    Visit visit = stack.back();
    stack.pop_back();
    ++visited;
    const JsonValue& node = nodes[visit.node];
    ANCHORSPLAT_ASSIGN_OR_RETURN(visit.motion, MotionOf(node, visit.motion));
    visit.shown &= !IsHidden(node);
    visit.animated |= moved[visit.node] != 0;
    if (const std::optional<JsonValue> mesh = node.Find("mesh")) {
      out.push_back({node, *mesh, visit.motion.matrix, visit.motion.translation, visit.shown, visit.animated});
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<size_t> children, children_of(node));
    for (auto child = children.rbegin(); child != children.rend(); ++child) {
      stack.push_back({*child, visit.motion, visit.shown, visit.animated});
    }
  }
  if (visited != nodes.size()) return list->Complain("has nodes that are their own ancestors");
  return out;
}

}  // namespace anchorsplat
