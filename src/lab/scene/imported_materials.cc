#include "scene/imported_materials.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "core/finite.h"
#include "core/text.h"
#include "scene/texture_decoder.h"

namespace anchorsplat {

namespace {

// Formats that define colour × picture. In OBJ files, black materials with a picture are common.
bool MultipliesPicture(const std::string& ending) { return ending == ".gltf" || ending == ".glb" || ending == ".ac"; }

// A picture as a material needs it; equal needs share one texture.
struct PictureKey {
  std::string path;
  std::array<uint8_t, 3> factor;  // 255: unchanged
  bool opaque;
  auto operator<=>(const PictureKey&) const = default;
};

class PictureCollector {
 public:
  PictureCollector(const RawScene& scene, const AssetSource& source, const MeshLimits& limits)
      : scene_(scene), source_(source), limits_(limits), pixels_left_(limits.max_textures_pixels) {}

  // Index in textures(), or the error.
  Result<int> Get(const PictureKey& key) {
    if (const auto known = index_.find(key); known != index_.end()) return known->second;
    Result<int> index = Load(key);
    index_.emplace(key, index);
    return index;
  }

  std::vector<Texture> Take() { return std::move(textures_); }

 private:
  Result<int> Load(const PictureKey& key) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(Texture texture, Decode(key.path));
    const int64_t pixels = int64_t{texture.width} * texture.height;
    if (pixels > pixels_left_) return Error{ErrorCode::kBadFile, "the pictures together have too many pixels"};
    pixels_left_ -= pixels;
    if (key.opaque && texture.has_alpha) {
      for (size_t i = 3; i < texture.rgba.size(); i += 4) texture.rgba[i] = 255;
      texture.has_alpha = false;
    }
    if (key.factor != std::array<uint8_t, 3>{255, 255, 255}) {
      for (size_t i = 0; i < texture.rgba.size(); ++i) {
        if (i % 4 != 3) texture.rgba[i] = static_cast<uint8_t>((texture.rgba[i] * key.factor[i % 4] + 127) / 255);
      }
    }
    textures_.push_back(std::move(texture));
    return static_cast<int>(textures_.size()) - 1;
  }

  Result<Texture> Decode(const std::string& path) const {
    const int64_t most = std::min(limits_.max_texture_pixels, pixels_left_);
    const EmbeddedPicture* embedded = Embedded(path);
    if (embedded == nullptr) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string bytes, source_.Read(path, limits_.max_file_bytes));
      return DecodeTexture(path, bytes, most);
    }
    if (embedded->height == 0) return DecodeTexture(path, embedded->bytes, most);
    const int64_t pixels = static_cast<int64_t>(embedded->bytes.size() / 4);
    if (pixels > most || pixels == 0) {
      return Error{ErrorCode::kBadFile, Cat(Printable(path), ": ", pixels, " pixels cannot be used")};
    }
    Texture texture;
    texture.name = path;
    texture.width = static_cast<int>(embedded->width);
    texture.height = static_cast<int>(embedded->height);
    texture.rgba.assign(embedded->bytes.begin(), embedded->bytes.end());
    for (size_t i = 3; i < texture.rgba.size(); i += 4) texture.has_alpha |= texture.rgba[i] < 255;
    return texture;
  }

  // "*3" is the fourth embedded picture; others are found by name.
  const EmbeddedPicture* Embedded(const std::string& path) const {
    for (size_t i = 0; i < scene_.pictures.size(); ++i) {
      const EmbeddedPicture& picture = scene_.pictures[i];
      if (picture.bytes.empty()) continue;
      if (path == Cat("*", i) || (!picture.name.empty() && path == picture.name)) return &picture;
    }
    return nullptr;
  }

  const RawScene& scene_;
  const AssetSource& source_;
  const MeshLimits& limits_;
  int64_t pixels_left_;
  std::map<PictureKey, Result<int>> index_;
  std::vector<Texture> textures_;
};

}  // namespace

void LoadMaterials(const RawScene& scene, const AssetSource& source, const std::string& ending,
                   const MeshLimits& limits, Mesh& mesh, std::vector<std::string>& warnings) {
  PictureCollector pictures(scene, source, limits);
  std::set<std::string> said;
  for (const RawMaterial& raw : scene.materials) {
    Material material;
    material.name = raw.name;
    // AC3D exports a material per pair of colour and picture, all with the same name.
    const auto warn = [&](const auto&... words) {
      std::string warning = Cat("material \"", Printable(material.name), "\": ", words...);
      if (said.insert(warning).second) warnings.push_back(std::move(warning));
    };
    if (raw.has_color) {
      for (size_t k = 0; k < 3; ++k) material.diffuse[k] = UnitOr(raw.color[k], material.diffuse[k]);
    }
    material.opacity = UnitOr(raw.opacity, 1);
    material.two_sided = raw.two_sided;
    if (!raw.picture.empty()) {
      PictureKey key{raw.picture, {255, 255, 255}, raw.opaque};
      if (raw.has_color && MultipliesPicture(ending)) {
        for (size_t k = 0; k < 3; ++k) key.factor[k] = static_cast<uint8_t>(std::lround(material.diffuse[k] * 255));
      }
      const Result<int> texture = pictures.Get(key);
      if (texture.ok()) {
        material.texture = *texture;
      } else if (texture.error().code == ErrorCode::kNotFound) {
        warn("picture \"", Printable(raw.picture), "\" is missing");
      } else {
        warn("picture ignored: ", texture.error().message);
      }
    }
    if (!raw.mask.empty() && raw.mask != raw.picture) {
      warn("separate opacity picture \"", Printable(raw.mask), "\" ignored");
    }
    mesh.materials.push_back(std::move(material));
  }
  mesh.textures = pictures.Take();
}

}  // namespace anchorsplat
