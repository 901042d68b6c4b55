#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "formats/both_ways_for_test.h"
#include "formats/gltf/gltf_blocks.h"
#include "formats/gltf/gltf_reader.h"
#include "formats/gltf/gltf_writer.h"
#include "formats/random_cloud_for_test.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"

// For glTF tests: a small file with editable JSON and numbers.

namespace anchorsplat {

using Json = nlohmann::json;

inline Result<GaussianCloud> Read(std::string bytes, const ReadLimits& limits = {}) {
  return ReadBothWays(ReadGltf, BlocksOfGltf, InputFile::FromBytes("a.glb", std::move(bytes)), limits);
}

struct Glb {
  Json json;
  std::string binary;

  static Glb Of(const std::string& bytes) {
    uint32_t size;
    std::memcpy(&size, bytes.data() + 12, 4);
    return {Json::parse(bytes.substr(20, size)), bytes.substr(20 + size + 8)};
  }
  std::string bytes() const {
    std::string text = json.dump();
    text.append((4 - text.size() % 4) % 4, ' ');
    const uint32_t head[5] = {0x46546c67, 2, static_cast<uint32_t>(28 + text.size() + binary.size()),
                              static_cast<uint32_t>(text.size()), 0x4e4f534a};
    const uint32_t chunk[2] = {static_cast<uint32_t>(binary.size()), 0x004e4942};
    return std::string(reinterpret_cast<const char*>(head), sizeof head) + text +
           std::string(reinterpret_cast<const char*>(chunk), sizeof chunk) + binary;
  }
};

// Shown whatever its nodes become, as it has no scenes.
inline Glb Example(int64_t n, int degree) {
  const TestFolder folder;
  EXPECT_TRUE(WriteGlb(folder / "a.glb", RandomCloud(n, degree, 3)).ok());
  Glb glb = Glb::Of(FileBytes(folder / "a.glb"));
  glb.json.erase("scenes");
  glb.json.erase("scene");
  return glb;
}

// Sets all values of a float attribute.
inline void SetAttribute(Glb& glb, const char* name, const std::vector<float>& values) {
  const int accessor = glb.json["meshes"][0]["primitives"][0]["attributes"][name];
  const auto at = glb.json["bufferViews"][accessor]["byteOffset"].get<size_t>();
  std::memcpy(glb.binary.data() + at, values.data(), values.size() * sizeof(float));
}

inline constexpr const char* kGltfScales = "KHR_gaussian_splatting:SCALE";
inline constexpr const char* kGltfOpacities = "KHR_gaussian_splatting:OPACITY";

}  // namespace anchorsplat
