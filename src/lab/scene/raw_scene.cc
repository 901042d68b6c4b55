#include "scene/raw_scene.h"

#include <cstring>
#include <type_traits>

#include "core/finite.h"

namespace anchorsplat {

namespace {

class Packer {
 public:
  template <typename T>
  void Number(T value) {
    static_assert(std::is_arithmetic_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void Text(const std::string& text) {
    Number(uint64_t{text.size()});
    bytes_ += text;
  }
  template <typename T>
  void Array(const std::vector<T>& values) {
    Number(uint64_t{values.size()});
    if (!values.empty()) bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  }
  std::string Take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

// Reads a packed scene. Past the end, reads give zero or empty and ok() is false.
class Unpacker {
 public:
  explicit Unpacker(std::string_view bytes) : bytes_(bytes) {}

  template <typename T>
  void Number(T& value) {
    static_assert(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>);
    value = {};
    if (!Has(sizeof value)) return;
    std::memcpy(&value, bytes_.data(), sizeof value);
    bytes_.remove_prefix(sizeof value);
  }
  void Flag(bool& value) {
    uint8_t byte = 0;
    Number(byte);
    value = byte != 0;  // another value in a bool would be undefined behaviour
  }
  void Text(std::string& text) {
    uint64_t size = 0;
    Number(size);
    if (!Has(size)) return;
    text = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
  }
  template <typename T>
  void Array(std::vector<T>& values) {
    uint64_t size = 0;
    Number(size);
    if (size > bytes_.size() / sizeof(T)) ok_ = false;
    if (!ok_ || size == 0) return;
    values.resize(size);
    std::memcpy(values.data(), bytes_.data(), size * sizeof(T));
    bytes_.remove_prefix(size * sizeof(T));
  }
  // A count of elements of at least one byte each.
  uint64_t Count() {
    uint64_t count = 0;
    Number(count);
    return Has(count) ? count : 0;
  }
  bool AtEnd() const { return ok_ && bytes_.empty(); }
  bool ok() const { return ok_; }

 private:
  bool Has(uint64_t size) { return ok_ = ok_ && size <= bytes_.size(); }

  std::string_view bytes_;
  bool ok_ = true;
};

bool KeepsItsPromises(const RawScene& scene) {
  const MeshCorners& c = scene.corners;
  const size_t corners = c.positions.size();
  if (scene.materials.empty() || corners != 3 * c.materials.size() || c.normals.size() != corners ||
      c.uvs.size() != (c.has_uvs ? corners : 0) || c.colors.size() != (c.has_colors ? corners : 0)) {
    return false;
  }
  for (const int32_t m : c.materials) {
    if (m < 0 || static_cast<size_t>(m) >= scene.materials.size()) return false;
  }
  for (size_t i = 0; i < corners; ++i) {
    if (!AllFinite(c.positions[i]) || !AllFinite(c.normals[i])) return false;
  }
  for (const EmbeddedPicture& picture : scene.pictures) {
    // Both factors have 32 bits, so the product fits, even times four.
    const uint64_t pixels = uint64_t{picture.width} * picture.height;
    if (picture.height > 0 && (picture.bytes.size() % 4 != 0 || picture.bytes.size() / 4 != pixels)) return false;
  }
  return true;
}

}  // namespace

std::string Pack(const RawScene& scene) {
  Packer out;
  const MeshCorners& c = scene.corners;
  out.Array(c.positions);
  out.Array(c.normals);
  out.Number(uint8_t{c.has_uvs});
  out.Number(uint8_t{c.has_colors});
  out.Array(c.uvs);
  out.Array(c.colors);
  out.Array(c.materials);
  out.Number(uint64_t{scene.materials.size()});
  for (const RawMaterial& m : scene.materials) {
    out.Text(m.name);
    out.Number(uint8_t{m.has_color});
    for (const float v : m.color) out.Number(v);
    out.Number(m.opacity);
    out.Number(uint8_t{m.two_sided});
    out.Number(uint8_t{m.opaque});
    out.Text(m.picture);
    out.Text(m.mask);
  }
  out.Number(uint64_t{scene.pictures.size()});
  for (const EmbeddedPicture& p : scene.pictures) {
    out.Text(p.name);
    out.Number(p.width);
    out.Number(p.height);
    out.Text(p.bytes);
  }
  out.Number(scene.degenerate);
  out.Number(scene.not_finite);
  out.Number(scene.not_triangles);
  out.Number(uint8_t{scene.has_normals});
  return out.Take();
}

Result<RawScene> Unpack(std::string_view bytes) {
  RawScene scene;
  Unpacker in(bytes);
  MeshCorners& c = scene.corners;
  in.Array(c.positions);
  in.Array(c.normals);
  in.Flag(c.has_uvs);
  in.Flag(c.has_colors);
  in.Array(c.uvs);
  in.Array(c.colors);
  in.Array(c.materials);
  for (uint64_t left = in.Count(); left > 0 && in.ok(); --left) {
    RawMaterial& m = scene.materials.emplace_back();
    in.Text(m.name);
    in.Flag(m.has_color);
    for (float& v : m.color) in.Number(v);
    in.Number(m.opacity);
    in.Flag(m.two_sided);
    in.Flag(m.opaque);
    in.Text(m.picture);
    in.Text(m.mask);
  }
  for (uint64_t left = in.Count(); left > 0 && in.ok(); --left) {
    EmbeddedPicture& p = scene.pictures.emplace_back();
    in.Text(p.name);
    in.Number(p.width);
    in.Number(p.height);
    in.Text(p.bytes);
  }
  in.Number(scene.degenerate);
  in.Number(scene.not_finite);
  in.Number(scene.not_triangles);
  in.Flag(scene.has_normals);
  if (!in.AtEnd() || !KeepsItsPromises(scene)) {
    return Error{ErrorCode::kBadFile, "is so damaged that its reader failed"};
  }
  return scene;
}

}  // namespace anchorsplat
