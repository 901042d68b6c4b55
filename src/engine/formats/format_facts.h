#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/text.h"

namespace anchorsplat {

// How much a file holds, as its header says: known before anything else of it is read, and not checked yet.
struct CloudExtent {
  int64_t gaussians = 0;
  int sh_degree = 0;
};

// What a file says about itself beside its Gaussians, for `info`: version, bits, flags. Name and value, in an order for
// people; text from the file is escaped.
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
