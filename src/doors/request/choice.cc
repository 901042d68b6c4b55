#include "request/choice.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>

#include "core/text.h"
#include "enhance/method_option.h"
#include "request/parse.h"

namespace anchorsplat {

namespace {

// CLI11 reports what is not a number.
CLI::Validator Finite() {
  return CLI::Validator(
      [](const std::string& text) {
        double value = 0;
        const bool bad =
            CLI::detail::lexical_cast(text, value) && !(std::abs(value) <= double{std::numeric_limits<float>::max()});
        return bad ? "must be a finite number of at most 3.4e38, found '" + text + "'" : "";
      },
      "");
}

// CLI11 reports what is not a number.
CLI::Validator Whole(bool negative_too) {
  return CLI::Validator(
      [negative_too](const std::string& text) {
        double value = 0;
        int64_t whole = 0;
        if (!CLI::detail::lexical_cast(text, whole) && CLI::detail::lexical_cast(text, value) &&
            std::abs(value) < 9e18) {
          return "must be a whole number, found '" + text + "'";
        }
        errno = 0;
        if (negative_too) {
          static_cast<void>(std::strtoll(text.c_str(), nullptr, 0));
        } else {
          static_cast<void>(std::strtoull(text.c_str(), nullptr, 0));
        }
        return errno == ERANGE ? "must fit into 64 bits, found '" + text + "'" : std::string();
      },
      "");
}

}  // namespace

size_t EditDistance(std::string_view a, std::string_view b) {
  // Optimal string alignment: rows of the table for the last two letters of `a` are enough.
  std::vector<size_t> before, last, now(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) now[j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    before = std::move(last);
    last = std::move(now);
    now.assign(b.size() + 1, i);
    for (size_t j = 1; j <= b.size(); ++j) {
      now[j] = std::min({last[j] + 1, now[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) now[j] = std::min(now[j], before[j - 2] + 1);
    }
  }
  return now[b.size()];
}

std::string Nearest(const std::string& word, const std::vector<std::string>& known) {
  std::string best;
  size_t least = std::string::npos;
  for (const std::string& one : known) {
    const size_t distance = EditDistance(word, one);
    if (2 * distance > std::max(word.size(), one.size()) + 1 || distance >= least) continue;
    best = one;
    least = distance;
  }
  return best;
}

CLI::Validator OneOf(const std::vector<std::string>& words) {
  return CLI::Validator(
      [words](const std::string& text) {
        if (std::ranges::find(words, text) != words.end()) return std::string();
        const std::string nearest = Nearest(text, words);
        return Cat("must be ", OrList(words), ", found '", Printable(text), "'",
                   !nearest.empty() ? Cat("; did you mean '", nearest, "'?") : "");
      },
      "{" + CLI::detail::join(words, ",") + "}");
}

CLI::Validator MemorySize() {
  return CLI::Validator(
      [](std::string& text) {
        const Result<uint64_t> bytes = ParseMemory(text);
        if (bytes.ok()) text = std::to_string(*bytes);
        return bytes.ok() ? std::string() : bytes.error().message;
      },
      "SIZE");
}

void CheckNumbers(CLI::App& verb) {
  for (CLI::Option* option : verb.get_options([](const CLI::Option*) { return true; })) {
    const std::string type = option->get_type_name();  // "FLOAT:POSITIVE"
    if (type.starts_with("FLOAT")) option->check(Finite());
    if (type.starts_with("INT")) option->check(Whole(true));
    if (type.starts_with("UINT")) option->check(Whole(false));
  }
  for (CLI::App* part : verb.get_subcommands([](const CLI::App*) { return true; })) CheckNumbers(*part);
}

}  // namespace anchorsplat
