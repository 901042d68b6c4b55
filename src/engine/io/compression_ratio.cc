#include "io/compression_ratio.h"

#include "core/text.h"

namespace anchorsplat {

Status CheckCompressionRatio(const std::string& where, uint64_t compressed, uint64_t raw) {
  constexpr uint64_t kMaxRatio = 200;
  constexpr uint64_t kAlwaysFine = uint64_t{64} << 20;  // bytes: harmless, and parts of real splats may be constant
  if (raw <= kAlwaysFine || raw / kMaxRatio <= compressed) return {};
  return Error{ErrorCode::kBadFile,
               Cat(where, ": claims to expand to ", HumanBytes(raw), " from ", HumanBytes(compressed),
                   " of compressed data; more than 200 times is refused as a decompression bomb")};
}

}  // namespace anchorsplat
