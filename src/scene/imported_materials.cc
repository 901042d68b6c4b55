#include "scene/imported_materials.h"

#include <assimp/GltfMaterial.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "core/text.h"
#include "scene/texture_decoder.h"

namespace anchorsplat {

namespace {

// Black materials with a picture are common in OBJ files, so only formats that define the product get it.
bool MultipliesPicture(const std::string& ending) { return ending == ".gltf" || ending == ".glb" || ending == ".ac"; }

float Unit(float value, float otherwise) { return std::isfinite(value) ? std::clamp(value, 0.0f, 1.0f) : otherwise; }

// IEC 61966-2-1.
float SrgbFromLinear(float v) { return v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1 / 2.4f) - 0.055f; }

// How one material wants its picture; materials that want the same share it.
struct PictureKey {
  std::string path;
  std::array<uint8_t, 3> factor;  // 255: as it is
  bool opaque;
  auto operator<=>(const PictureKey&) const = default;
};

class PictureCollector {
 public:
  PictureCollector(const aiScene& scene, const AssetSource& source, const MeshLimits& limits)
      : scene_(scene), source_(source), limits_(limits), pixels_left_(limits.max_textures_pixels) {}

  // Index in textures(), or why there is none.
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
    const aiTexture* embedded = Embedded(path);
    if (embedded == nullptr) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string bytes, source_.Read(path, limits_.max_file_bytes));
      return DecodeTexture(path, bytes, most);
    }
    if (embedded->mHeight == 0) {  // a picture file of mWidth bytes
      const char* bytes = reinterpret_cast<const char*>(embedded->pcData);
      return DecodeTexture(path, std::string(bytes, bytes + embedded->mWidth), most);
    }
    if (int64_t{embedded->mWidth} * embedded->mHeight > most) {
      return Error{ErrorCode::kBadFile, Cat(Printable(path), ": too many pixels")};
    }
    Texture texture;
    texture.name = path;
    texture.width = static_cast<int>(embedded->mWidth);
    texture.height = static_cast<int>(embedded->mHeight);
    const size_t pixels = size_t{embedded->mWidth} * embedded->mHeight;
    texture.rgba.reserve(pixels * 4);
    for (size_t i = 0; i < pixels; ++i) {
      const aiTexel& t = embedded->pcData[i];
      texture.rgba.insert(texture.rgba.end(), {t.r, t.g, t.b, t.a});
      texture.has_alpha |= t.a < 255;
    }
    return texture;
  }

  // "*3" is the fourth embedded picture; others have names. Not assimp's own look-up: that one trusts the number.
  const aiTexture* Embedded(const std::string& path) const {
    for (unsigned i = 0; i < scene_.mNumTextures; ++i) {
      const aiTexture* texture = scene_.mTextures[i];
      if (texture == nullptr || texture->pcData == nullptr) continue;
      if (path == Cat("*", i) || (texture->mFilename.length > 0 && path == texture->mFilename.C_Str())) return texture;
    }
    return nullptr;
  }

  const aiScene& scene_;
  const AssetSource& source_;
  const MeshLimits& limits_;
  int64_t pixels_left_;
  std::map<PictureKey, Result<int>> index_;
  std::vector<Texture> textures_;
};

// The colour picture's path and texture coordinates; false when the material has none.
bool ColorPicture(const aiMaterial& material, std::string& path, unsigned& channel) {
  for (const aiTextureType type : {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}) {
    aiString name;
    if (material.GetTexture(type, 0, &name) != aiReturn_SUCCESS || name.length == 0) continue;
    path = name.C_Str();
    int source = 0;
    if (material.Get(AI_MATKEY_UVWSRC(type, 0), source) == aiReturn_SUCCESS && source >= 0) {
      channel = static_cast<unsigned>(source);
    }
    return true;
  }
  return false;
}

}  // namespace

std::array<float, 4> ImportedMaterials::ToSrgb(const aiColor4D& color) const {
  std::array<float, 4> out = {Unit(color.r, 1), Unit(color.g, 1), Unit(color.b, 1), Unit(color.a, 1)};
  if (linear) std::transform(out.begin(), out.begin() + 3, out.begin(), SrgbFromLinear);
  return out;
}

ImportedMaterials ImportMaterials(const aiScene& scene, const AssetSource& source, const std::string& ending,
                                  const MeshLimits& limits, std::vector<std::string>& warnings) {
  ImportedMaterials out;
  out.linear = ending == ".gltf" || ending == ".glb";
  PictureCollector pictures(scene, source, limits);
  std::set<std::string> said;
  for (unsigned m = 0; m < scene.mNumMaterials; ++m) {
    const aiMaterial& from = *scene.mMaterials[m];
    Material material;
    aiString text;
    if (from.Get(AI_MATKEY_NAME, text) == aiReturn_SUCCESS) material.name = text.C_Str();
    // AC3D makes a material of every pair of colour and picture, all of one name.
    const auto warn = [&](const auto&... words) {
      std::string warning = Cat("material \"", Printable(material.name), "\": ", words...);
      if (said.insert(warning).second) warnings.push_back(std::move(warning));
    };
    aiColor4D color;
    const bool has_color = from.Get(AI_MATKEY_BASE_COLOR, color) == aiReturn_SUCCESS ||
                           from.Get(AI_MATKEY_COLOR_DIFFUSE, color) == aiReturn_SUCCESS;
    if (has_color) {
      const std::array<float, 4> srgb = out.ToSrgb(color);
      material.diffuse = {srgb[0], srgb[1], srgb[2]};
    }
    float opacity = 1;
    if (from.Get(AI_MATKEY_OPACITY, opacity) == aiReturn_SUCCESS) {
      material.opacity = Unit(opacity, 1);
    } else if (has_color) {
      material.opacity = Unit(color.a, 1);
    }
    int two_sided = 0;
    if (from.Get(AI_MATKEY_TWOSIDED, two_sided) == aiReturn_SUCCESS) material.two_sided = two_sided != 0;
    const bool opaque = out.linear && from.Get(AI_MATKEY_GLTF_ALPHAMODE, text) == aiReturn_SUCCESS &&
                        std::string_view(text.C_Str()) == "OPAQUE";
    if (opaque) material.opacity = 1;

    unsigned channel = 0;
    PictureKey key{{}, {255, 255, 255}, opaque};
    if (ColorPicture(from, key.path, channel)) {
      if (has_color && MultipliesPicture(ending)) {
        for (size_t k = 0; k < 3; ++k) key.factor[k] = static_cast<uint8_t>(std::lround(material.diffuse[k] * 255));
      }
      const Result<int> texture = pictures.Get(key);
      if (texture.ok()) {
        material.texture = *texture;
      } else if (texture.error().code == ErrorCode::kNotFound) {
        warn("picture \"", Printable(key.path), "\" is missing");
      } else {
        warn("picture is left out: ", texture.error().message);
      }
    }
    aiString mask;
    if (from.GetTexture(aiTextureType_OPACITY, 0, &mask) == aiReturn_SUCCESS && key.path != mask.C_Str()) {
      warn("separate opacity picture \"", Printable(mask.C_Str()), "\" is left out");
    }
    out.list.push_back(std::move(material));
    out.uv_channel.push_back(channel);
  }
  if (out.list.empty()) {
    warnings.emplace_back("no materials: everything is grey");
    out.list.emplace_back();
    out.uv_channel.push_back(0);
  }
  out.textures = pictures.Take();
  return out;
}

}  // namespace anchorsplat
