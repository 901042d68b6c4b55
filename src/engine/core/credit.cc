#include "core/credit.h"

#include <algorithm>

#include "core/text.h"
#include "core/words.h"

namespace anchorsplat {

namespace {

constexpr std::string_view kCreditMark = "credit: ";

}  // namespace

std::vector<std::string> CreditsOf(std::span<const std::string> comments) {
  std::vector<std::string> credits;
  for (const std::string& comment : comments) {
    if (comment.starts_with(kCreditMark) && comment.size() > kCreditMark.size()) {
      credits.push_back(comment.substr(kCreditMark.size()));
    }
  }
  return credits;
}

std::string CopyrightOf(std::span<const std::string> comments) {
  std::string text;
  for (const std::string& credit : CreditsOf(comments)) text += (text.empty() ? "" : "\n") + credit;
  return text;
}

std::vector<std::string> CommentsOfCopyright(std::string_view copyright) {
  std::vector<std::string> comments;
  while (!copyright.empty()) {
    const size_t end = std::min(copyright.find_first_of("\r\n"), copyright.size());
    const std::string_view line = Trimmed(copyright.substr(0, end));
    if (!line.empty()) comments.push_back(Cat(kCreditMark, line));
    copyright.remove_prefix(std::min(end + 1, copyright.size()));
  }
  return comments;
}

}  // namespace anchorsplat
