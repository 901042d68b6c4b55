#include "formats/ply/ply_filter.h"

#include <cmath>

#include "core/log.h"
#include "core/smoothing_filter.h"
#include "core/text.h"
#include "formats/ply/ply_layout.h"

namespace anchorsplat {

Status FuseFilter(const InputFile& file, std::span<const float> sizes, int64_t first, GaussianCloud& rows) {
  for (size_t i = 0; i < sizes.size(); ++i) {
    if (sizes[i] >= 0 && std::isfinite(sizes[i])) continue;
    return Error{ErrorCode::kBadFile,
                 Cat(file.name(), ": row ", WithThousands(first + static_cast<int64_t>(i) + 1), ": property \"",
                     kFilter3d, "\" is ", sizes[i], " (expected the size of Mip-Splatting's 3-D filter, 0 or more)")};
  }
  Smooth(rows, sizes, rows.log_scales.data(), rows.opacity_logits.data());
  return {};
}

void ReportFusedFilter(const InputFile& file, RenderMode mode) {
  LogInfo(Cat(file.name(), ": applied Mip-Splatting's 3-D filter (", kFilter3d,
              ") to scales and opacities; the render mode is ", NameOf(mode)));
}

}  // namespace anchorsplat
