#include "web/addresses.h"

#include <algorithm>
#include <cstdint>

#include "core/text.h"

namespace anchorsplat::web {

Status CheckAddresses(const GaussianCloud& cloud, const EnhanceOptions& options) {
  if constexpr (sizeof(void*) > 4) return {};
  // The input exists twice; later the result exists twice beside the input, in the engine that receives it.
  const double before = static_cast<double>(cloud.size());
  const double after = static_cast<double>(ExpectedGaussians(cloud.size(), options));
  const double floats = std::max(2 * before + after, before + 2 * after) * (11 + 3 * ShCoefficients(cloud.sh_degree));
  const auto bytes = static_cast<uint64_t>(floats * sizeof(float));
  constexpr uint64_t kMost = 3'900'000'000;
  if (bytes <= kMost) return {};
  return Error{ErrorCode::kIo,
               Cat("enhancing ", WithThousands(cloud.size()), " Gaussians needs about ", HumanBytes(bytes),
                   ", but WebAssembly has 4 GB: choose the method 'filter', open a part of "
                   "the splat, or use the command line")};
}

}  // namespace anchorsplat::web
