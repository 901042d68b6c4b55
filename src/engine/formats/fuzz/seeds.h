#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Small valid files as a start for mutations.
GaussianCloud SeedCloud(int64_t count, int sh_degree);

std::vector<std::string> PlySeeds();  // both byte orders and ASCII, with doubles, lists, extra elements, CR LF
std::vector<std::string_view> PlyWords();

// An SPZ file of version 3 without its gzip, and gzip compression.
std::string SpzContentSeed(const std::filesystem::path& folder, int sh_degree);
std::string Gzip(const std::string& content);

// A splat in gzip with two members, in zstd and in a ZIP archive.
std::vector<std::string> PackedSeeds(const std::filesystem::path& folder);

std::vector<std::string> TorchSeeds();       // the valid checkpoints of testdata/
std::vector<std::string> GsplatSeeds();      // those with Gaussians
std::vector<std::string_view> TorchWords();  // names in pickles, and opcodes

// KSPLAT files of every compression level (we do not write them): a section of three Gaussians in two buckets.
std::vector<std::string> KsplatSeeds();

std::vector<std::string> SafetensorsSeeds(const std::filesystem::path& folder);

std::vector<std::string> TransformsSeeds();
std::vector<std::string> InriaCamerasSeeds();
std::string PosesBoundsSeed();              // LLFF's, with one view
std::vector<std::string> MetashapeSeeds();  // a component, and groups with a chunk's transform
std::vector<std::string_view> XmlWords();
std::vector<std::string> OpenSfmSeeds();
std::string BundlerSeed();          // two cameras, whose list names a.png twice
std::string NerfstudioFrameSeed();  // a dataparser_transforms.json
std::vector<std::string_view> JsonWords();

struct ColmapSeeds {
  std::string cameras;
  std::string images;
  std::string points;
};
ColmapSeeds ColmapBinarySeeds();
ColmapSeeds ColmapTextSeeds();

std::vector<std::string> PngSeeds(const std::filesystem::path& folder);  // 1, 3 and 4 channels
std::vector<std::string> WebpSeeds();                                    // opaque and with alpha
std::vector<std::string> TiffSeeds();                                    // in strips and in tiles
std::vector<std::string> JpegSeeds();                                    // baseline and progressive

}  // namespace anchorsplat
