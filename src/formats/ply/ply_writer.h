#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "core/cloud_view.h"
#include "core/result.h"
#include "formats/cloud_io.h"
#include "formats/extra_properties.h"

namespace anchorsplat {

// Writes a Gaussian splat as the INRIA code does: binary little-endian floats in the order x y z, nx ny nz (zeros),
// f_dc_0..2, f_rest_* (channel-major), opacity, scale_0..2, rot_0..3. The values are the stored ones, bit by bit, but
// for a cloud of `double_means`, whose x y z are world coordinates in double; otherwise a comment says the origin. The
// render mode and the comments go to the header (control bytes in comments become blanks, so that they stay comments).
// Streamed in blocks: needs no second copy of the cloud.
// Errors: kExists, kIo, kBadArgument (arrays that disagree, no Gaussians, comments longer than a header may be).
Status WritePly(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options = {});

// The same with the normals of `extras`, and its properties behind ours. kBadArgument too: it has not a row for each
// Gaussian; names longer than a header may be.
Status WritePlyWithExtras(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options,
                          const ExtraProperties& extras);

// Bytes of the file WritePly makes of `count` Gaussians.
uint64_t PredictedPlySize(int64_t count, int sh_degree, std::optional<RenderMode> render_mode = {},
                          std::span<const std::string> comments = {});

// Bytes that WritePlyWithExtras writes beyond those, but for the names of properties and the comments.
uint64_t ExtraPlyBytes(const CloudView& cloud, const ExtraProperties& extras);

}  // namespace anchorsplat
