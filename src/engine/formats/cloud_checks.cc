#include "formats/cloud_checks.h"

#include "core/text.h"

namespace anchorsplat {

Status CheckWritable(const std::filesystem::path& path, const CloudView& cloud) {
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

}  // namespace anchorsplat
