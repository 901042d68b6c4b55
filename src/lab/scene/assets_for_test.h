#pragma once

#include <cstdint>
#include <initializer_list>
#include <map>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/text.h"
#include "images/png_file.h"
#include "scene/asset_source.h"

namespace anchorsplat {

// Files that exist only in memory, and small contents for them.

class MapAssets : public AssetSource {
 public:
  std::map<std::string, std::string> files;

 protected:
  std::string Find(const std::string& relative) const override { return files.count(relative) != 0 ? relative : ""; }
  Result<std::string> ReadFound(const std::string& found, uint64_t max_bytes) const override {
    const std::string& bytes = files.at(found);
    if (bytes.size() > max_bytes) return Error{ErrorCode::kBadFile, found + ": too long"};
    return bytes;
  }
};

inline std::string PngBytes(const Image& image) { return EncodePng(image).value(); }

inline std::string Base64(const std::string& bytes) {
  constexpr const char* kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t three = 0;
    for (size_t k = 0; k < 3; ++k) three = three << 8 | (i + k < bytes.size() ? static_cast<uint8_t>(bytes[i + k]) : 0);
    for (size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : kLetters[three >> (18 - 6 * k) & 63];
  }
  return out;
}

// An uncompressed SGI picture: `values` channel by channel, rows from the bottom.
inline std::string SgiBytes(int width, int height, int channels, const std::vector<uint8_t>& values) {
  std::string out(512, '\0');
  const auto put = [&](size_t at, int value) {
    out[at] = static_cast<char>(value >> 8);
    out[at + 1] = static_cast<char>(value & 255);
  };
  put(0, 474);
  out[3] = 1;
  put(4, 3);
  put(6, width);
  put(8, height);
  put(10, channels);
  out.append(reinterpret_cast<const char*>(values.data()), values.size());
  return out;
}

inline std::string GreyPng(float value) {
  Image image(1, 1, 3);
  for (float& v : image.pixels) v = value;
  return PngBytes(image);
}

// A triangle as glTF with embedded buffer and picture.
inline std::string TriangleGltf(const std::string& material) {
  std::string buffer;
  const auto put = [&](std::initializer_list<float> values) {
    for (const float v : values) buffer.append(reinterpret_cast<const char*>(&v), 4);
  };
  put({0, 0, 0, 1, 0, 0, 0, 1, 0});  // positions
  put({0, 1, 1, 1, 0, 0});           // texture coordinates, from the top
  return Cat(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
    "nodes":[{"mesh":0,"translation":[10,0,0],"scale":[-2,2,2]}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0}]}],
    "materials":[)",
             material, R"(],"textures":[{"source":0}],"images":[{"uri":"data:image/png;base64,)", Base64(GreyPng(0.8f)),
             R"("}],"buffers":[{"byteLength":60,"uri":"data:application/octet-stream;base64,)", Base64(buffer),
             R"("}],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},
    {"buffer":0,"byteOffset":36,"byteLength":24}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
    {"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"}]})");
}

}  // namespace anchorsplat
