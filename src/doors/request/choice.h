#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace anchorsplat {

// For paths: an empty one is an unset shell variable, not a request for the default.
inline CLI::Validator NotEmpty() {
  return CLI::Validator([](const std::string& text) { return text.empty() ? "must not be empty" : ""; }, "");
}

// For counts.
inline CLI::Validator AtLeastOne() {
  return CLI::Validator(
      [](const std::string& text) {
        int64_t value = 0;
        const bool number = CLI::detail::lexical_cast(text, value);
        return number && value >= 1 ? "" : "must be 1 or more, found '" + text + "'";
      },
      "");
}

// Open bounds. CLI11's own checks print the largest double (309 digits) and accept "nan".
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

// For fractions. CLI11's own range check accepts "nan".
inline CLI::Validator Fraction() {
  return CLI::Validator(
      [](const std::string& text) {
        double value = 0;
        const bool number = CLI::detail::lexical_cast(text, value);
        return number && value >= 0 && value <= 1 ? "" : "must be a number from 0 to 1, found '" + text + "'";
      },
      "");
}

// Number of letters to change, add, remove or swap with their neighbour to turn `a` into `b`.
size_t EditDistance(std::string_view a, std::string_view b);
// The known word that `word` may stand for; empty if none is near: half of the letters may differ.
std::string Nearest(const std::string& word, const std::vector<std::string>& known);

// For words. CLI11's own check names no near one.
CLI::Validator OneOf(const std::vector<std::string>& words);

// For an amount of memory: turns "2G" into bytes (ParseMemory in request/parse.h).
CLI::Validator MemorySize();

// Checks all numbers of `verb` and its subcommands: floats must be finite in single precision, integers must fit 64
// bits. CLI11 alone accepts "inf" and "nan" and clamps integers. Called once for all verbs (verb.cc).
void CheckNumbers(CLI::App& verb);

// Adds an option whose words stand for the values of an enumeration. Help shows words and default; numbers are refused.
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
  return verb.add_option_function<std::string>(name, assign, help)->check(OneOf(words))->default_str(now);
}

}  // namespace anchorsplat
