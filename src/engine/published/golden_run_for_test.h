#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "core/buffer.h"
#include "core/source_dir_for_test.h"
#include "core/text.h"
#include "published/published_config.h"

namespace anchorsplat {

// A recorded run of the published network: 1,500 points with shared voxels and a padded patch, K = 2, HashWeights.
// Holds inputs, outputs, statistics per stage and the five shuffles that were drawn.
struct GoldenRun {
  nlohmann::json manifest;
  int64_t count = 0;
  PublishedConfig config;
  Buffer<float> features;  // [N,59]
  Buffer<float> expected;  // [K,N,59]
  Shuffles shuffles = kNoShuffles;

  GoldenRun() {
    const std::filesystem::path folder = SourceDirForTest() / "testdata" / "golden";
    std::ifstream(folder / "manifest.json") >> manifest;
    count = manifest["N"].get<int64_t>();
    config.copies = manifest["K"].get<int64_t>();
    features = ReadColumns(folder, "in_", count);
    expected = ReadColumns(folder, "out_fp32_", count * config.copies);
    for (size_t i = 0; i < shuffles.size(); ++i) {
      for (size_t j = 0; j < kCurves; ++j) shuffles[i][j] = manifest["perms_in_call_order"][i][j].get<uint8_t>();
    }
  }

  std::vector<Level> Levels() const {
    auto levels = BuildHierarchy(GridVoxels(features.data(), count, kFeatures), HierarchyOptionsFor(config, shuffles));
    return *std::move(levels);
  }

 private:
  static Buffer<float> ReadColumns(const std::filesystem::path& folder, const std::string& prefix, int64_t rows) {
    Buffer<float> table(static_cast<size_t>(rows * kFeatures));
    for (const Attribute& a : kAttributes) {
      std::ifstream file(folder / Cat(prefix, a.name, ".f32"), std::ios::binary);
      for (int64_t i = 0; i < rows; ++i) {
        file.read(reinterpret_cast<char*>(table.data() + i * kFeatures + a.offset),
                  static_cast<std::streamsize>(a.channels * 4));
      }
      if (!file) throw std::runtime_error(Cat("cannot read ", prefix, a.name));
    }
    return table;
  }
};

}  // namespace anchorsplat
