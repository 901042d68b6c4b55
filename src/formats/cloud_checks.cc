#include "formats/cloud_checks.h"

#include "core/text.h"

namespace anchorsplat {

Status CheckWritable(const std::filesystem::path& path, const GaussianCloud& cloud) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  if (!cloud.empty()) return {};
  return Error{ErrorCode::kBadArgument, Cat(path.string(), ": there are no Gaussians to write")};
}

Status CheckCount(const std::string& where, uint64_t count, const ReadLimits& limits) {
  if (count == 0) return Error{ErrorCode::kBadFile, Cat(where, ": has no Gaussians")};
  if (count <= static_cast<uint64_t>(limits.max_gaussians)) return {};
  return Error{ErrorCode::kBadFile, Cat(where, ": has ", WithThousands(static_cast<int64_t>(count)),
                                        " Gaussians, more than the limit of ", WithThousands(limits.max_gaussians))};
}

Status CheckRatio(const std::string& where, uint64_t compressed, uint64_t raw) {
  constexpr uint64_t kMaxRatio = 200;
  constexpr uint64_t kAlwaysFine = uint64_t{64} << 20;  // bytes: harmless, and parts of real clouds may be constant
  if (raw <= kAlwaysFine || raw / kMaxRatio <= compressed) return {};
  return Error{ErrorCode::kBadFile, Cat(where, ": promises ", HumanBytes(raw), " in ", HumanBytes(compressed),
                                        " of compressed data; more than 200 times is taken for a decompression bomb")};
}

}  // namespace anchorsplat
