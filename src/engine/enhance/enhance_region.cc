#include "enhance/enhance_region.h"

#include <utility>
#include <vector>

#include "core/log.h"
#include "core/row_arrays.h"
#include "core/text.h"
#include "enhance/gaussian_budget.h"

namespace anchorsplat {

void KeepOnlyRegion(EnhanceInput& input) {
  if (input.in_region.empty()) return;
  KeepMarked(input.in_region, input.cloud);
  if (input.pixel_sizes.size() > 1) KeepRows(input.pixel_sizes, 1, input.in_region);
  input.in_region = {};
}

Result<GaussianCloud> SplitOffOutside(const EnhanceOptions& options, EnhanceInput& input, EnhanceOptions& within,
                                      EnhanceReport& report) {
  if (!options.region) return GaussianCloud();
  const int64_t n = input.cloud.size();
  std::vector<int64_t> outside;
  input.in_region.resize(static_cast<size_t>(n));
  for (int64_t i = 0; i < n; ++i) {
    const bool holds = options.region->Contains(input.cloud.means.data() + 3 * i);
    input.in_region[static_cast<size_t>(i)] = holds ? 1 : 0;
    if (!holds) outside.push_back(i);
  }
  const int64_t kept = std::ssize(outside);
  report.region_in = n - kept;
  report.kept_outside = kept;
  if (kept == n) {
    const Bounds box = *ComputeBounds(input.cloud);
    const auto corner = [&](const std::array<float, 3>& c) {
      std::string world = TextOf(ToWorld(c.data(), options.refine.origin));  // in the region's coordinates
      std::ranges::replace(world, ' ', ',');
      return world;
    };
    return Error{ErrorCode::kBadArgument,
                 Cat("--region: no Gaussian lies in it; the splat spans ", corner(box.min), " to ", corner(box.max))};
  }
  if (options.max_gaussians > 0) {
    if (options.max_gaussians <= kept) {
      return Error{ErrorCode::kBadArgument,
                   Cat("--max-gaussians ", WithThousands(options.max_gaussians),
                       " leaves nothing for the region: ", WithThousands(kept), " Gaussians outside of it are kept")};
    }
    SetBudget(within, options.max_gaussians - kept);
  }
  LogInfo(Cat(WithThousands(n - kept), " of ", WithThousands(n), " Gaussians lie in the region"));
  return Subset(input.cloud, outside);
}

}  // namespace anchorsplat
