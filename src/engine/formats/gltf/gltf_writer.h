#pragma once

#include <cstdint>
#include <filesystem>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"

namespace anchorsplat {

// Writes a binary glTF file (.glb) of one point primitive with KHR_gaussian_splatting: kernel "ellipse", colour space
// "srgb_rec709_display", all attributes as floats (ROTATION xyzw of norm 1, SCALE as lengths, OPACITY 0–1,
// SH_DEGREE_d_COEF_n), and COLOR_0 for viewers that only know points: f_dc as a linear colour, as glTF has them, with
// the opacity, in 16 bits. Axes are LUF (y up, as glTF wants it), so x and y change sign.
// Nothing is rounded but by exp and sigmoid. Credits are "asset.copyright"; render mode and other comments have no
// place. Mind that the kernel of the extension is without the 0.3 px² by which the usual rasterizers widen every
// Gaussian: a viewer that takes it at its word shows a classic splat thinner and dimmer than it was fitted.
// Errors: kExists, kIo, kBadArgument (arrays that disagree, no Gaussians, more than the format's 4 GiB).
Status WriteGlb(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});

// The same as JSON with its numbers in a file of their own beside it: scan.gltf and scan.bin. Both appear when both are
// complete. Errors: as WriteGlb, without its bound; kExists for each of the two.
Status WriteGltf(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});
std::filesystem::path GltfFileBeside(const std::filesystem::path& path);

uint64_t EstimatedGltfSize(int64_t count, int sh_degree);  // of both
uint64_t PredictedGlbSize(int64_t count, int sh_degree);

}  // namespace anchorsplat
