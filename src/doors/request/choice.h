#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace anchorsplat {

// For paths: an empty one is a variable that was not set, not a wish for the default.
inline CLI::Validator NotEmpty() {
  return CLI::Validator([](const std::string& text) { return text.empty() ? "must not be empty" : ""; }, "");
}

// For counts of things to do or to keep.
inline CLI::Validator AtLeastOne() {
  return CLI::Validator(
      [](const std::string& text) {
        int64_t value = 0;
        const bool number = CLI::detail::lexical_cast(text, value);
        return number && value >= 1 ? "" : "must be 1 or more, found '" + text + "'";
      },
      "");
}

// Bounds without an end. The library's own print the end, which has 309 digits, and let "nan" through.
inline CLI::Validator Positive() {
  return CLI::Validator(
      [](const std::string& text) {
        double value = 0;
        const bool number = CLI::detail::lexical_cast(text, value);
        return number && value > 0 ? "" : "must be a number above 0, found '" + text + "'";
      },
      "POSITIVE");
}
inline CLI::Validator NotNegative() {
  return CLI::Validator(
      [](const std::string& text) {
        double value = 0;
        const bool number = CLI::detail::lexical_cast(text, value);
        return number && value >= 0 ? "" : "must be a number of 0 or more, found '" + text + "'";
      },
      "NONNEGATIVE");
}

// For shares of a whole. The library's own range lets "nan" through.
inline CLI::Validator Fraction() {
  return CLI::Validator(
      [](const std::string& text) {
        double value = 0;
        const bool number = CLI::detail::lexical_cast(text, value);
        return number && value >= 0 && value <= 1 ? "" : "must be a number from 0 to 1, found '" + text + "'";
      },
      "");
}

// For an amount of memory: turns "2G" into bytes (ParseMemory in request/parse.h).
CLI::Validator MemorySize();

// Gives every option of `verb` and of its subcommands that takes a number the check that the number is one: finite and
// of a size that single precision holds where it is real, within 64 bits where it is whole. The library alone takes
// "inf" and "nan", and the nearest number of 64 bits for what is beyond them. Done once for all verbs (verb.cc).
void CheckNumbers(CLI::App& verb);

// An option that takes one of several words for the values of an enumeration. Help shows the words and the default;
// numbers are not accepted.
template <typename Enum>
CLI::Option* AddChoice(CLI::App& verb, const std::string& name, Enum& value,
                       const std::vector<std::pair<std::string, Enum>>& choices, const std::string& help) {
  std::vector<std::string> words;
  std::string now;
  for (const auto& [word, meaning] : choices) {
    words.push_back(word);
    if (meaning == value) now = word;
  }
  const auto assign = [&value, choices](const std::string& word) {
    for (const auto& [known, meaning] : choices) {
      if (known == word) value = meaning;
    }
  };
  return verb.add_option_function<std::string>(name, assign, help)->check(CLI::IsMember(words))->default_str(now);
}

}  // namespace anchorsplat
