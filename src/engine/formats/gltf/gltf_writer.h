#pragma once

#include <cstdint>
#include <filesystem>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"

namespace anchorsplat {

// Writes a binary glTF file (.glb): one point primitive with KHR_gaussian_splatting, kernel "ellipse", colour space
// "srgb_rec709_display", all attributes as floats (ROTATION xyzw of norm 1, SCALE as lengths, OPACITY 0–1,
// SH_DEGREE_d_COEF_n). COLOR_0, for viewers of plain points, is f_dc as linear colour with opacity in 16 bits. Axes are
// LUF (y up, as glTF requires), so x and y change sign. Only exp and sigmoid round. Credits go to "asset.copyright";
// render mode and other comments are lost. Note that the extension's kernel lacks the usual dilation of 0.3 px²: a
// viewer that follows it shows a classic splat thinner and dimmer than it was fitted. Errors: kExists, kIo,
// kBadArgument (inconsistent arrays, no Gaussians, above the format's 4 GiB).
Status WriteGlb(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});

// The same as JSON with a buffer file beside it: scan.gltf and scan.bin. Both appear when both are complete. Errors:
// those of WriteGlb, without its size limit; kExists for each file.
Status WriteGltf(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});
std::filesystem::path GltfFileBeside(const std::filesystem::path& path);

uint64_t EstimatedGltfSize(int64_t count, int sh_degree);  // both files
uint64_t PredictedGlbSize(int64_t count, int sh_degree);

}  // namespace anchorsplat
