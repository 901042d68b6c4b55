#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/text.h"

namespace anchorsplat {

// Size of a splat as its header states, unchecked; known before the rest is read.
struct CloudExtent {
  int64_t gaussians = 0;
  int sh_degree = 0;
};

// Properties of a file besides its Gaussians, for `info`: version, bits, flags. Names and values in display order; text
// from the file is escaped.
class FormatFacts {
 public:
  template <typename... Parts>
  void Add(std::string name, const Parts&... value) {
    facts_.emplace_back(std::move(name), Cat(value...));
  }
  const std::vector<std::pair<std::string, std::string>>& all() const { return facts_; }

 private:
  std::vector<std::pair<std::string, std::string>> facts_;
};

}  // namespace anchorsplat
