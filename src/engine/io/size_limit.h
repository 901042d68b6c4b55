#pragma once

#include <cstdint>
#include <string>

#include "core/text.h"

namespace anchorsplat {

// "300 MB, more than the limit of 268 MB", in bytes where rounding hides the difference.
inline std::string MoreThanLimit(uint64_t size, uint64_t limit, const char* what = "") {
  const bool differ = HumanBytes(size) != HumanBytes(limit);
  const auto text = [&](uint64_t bytes) {
    return differ ? HumanBytes(bytes) : WithThousands(static_cast<int64_t>(bytes)) + " bytes";
  };
  return Cat(text(size), what, ", more than the limit of ", text(limit));
}

}  // namespace anchorsplat
