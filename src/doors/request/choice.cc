#include "request/choice.h"

#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>

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
