#include "core/credit.h"

#include <string_view>

namespace anchorsplat {

std::vector<std::string> CreditsOf(const std::vector<std::string>& comments) {
  constexpr std::string_view kMark = "credit: ";
  std::vector<std::string> credits;
  for (const std::string& comment : comments) {
    if (comment.starts_with(kMark) && comment.size() > kMark.size()) credits.push_back(comment.substr(kMark.size()));
  }
  return credits;
}

}  // namespace anchorsplat
