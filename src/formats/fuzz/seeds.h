#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Small good files to start the damage from.
GaussianCloud SeedCloud(int64_t count, int sh_degree);

std::vector<std::string> PlySeeds();  // both byte orders and ASCII, with doubles, lists, extra elements, CR LF
std::vector<std::string_view> PlyWords();

std::vector<std::string> TransformsSeeds();
std::vector<std::string> InriaCamerasSeeds();
std::vector<std::string_view> JsonWords();

struct ColmapSeeds {
  std::string cameras;
  std::string images;
};
ColmapSeeds ColmapBinarySeeds();
ColmapSeeds ColmapTextSeeds();

std::vector<std::string> PngSeeds(const std::filesystem::path& folder);  // 1, 3 and 4 channels
std::vector<std::string> JpegSeeds();                                    // baseline and progressive

}  // namespace anchorsplat
