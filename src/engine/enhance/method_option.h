#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

struct EnhanceMethod;
struct EnhanceOptions;

// The context in which a method will run.
struct MethodUse {
  const EnhanceOptions& options;
  const EnhanceMethod* start = nullptr;  // the method before it, or null
};

struct OptionRange {
  double least = std::numeric_limits<double>::lowest(), greatest = std::numeric_limits<double>::max();
  bool above_least = false;  // excludes `least`
};
inline constexpr OptionRange kMoreThanZero = {.least = 0, .above_least = true}, kZeroOrMore = {.least = 0},
                             kZeroToOne = {.least = 0, .greatest = 1};
bool Contains(const OptionRange& range, double number);
std::string Describe(const OptionRange& range, bool whole);  // "a whole number from 1 to 64"

// An option whose value is a word.
struct WordOption {
  std::vector<std::string> choices = {};  // empty: any text
  std::string now = {};                   // the current one; empty: none
  std::function<Status(const std::string&)> set = {};
};

// Where an option is stored.
using OptionValue = std::variant<bool*, int*, int64_t*, float*, double*, std::optional<int>*, std::optional<int64_t>*,
                                 std::optional<double>*, std::filesystem::path*, WordOption>;

// An option that affects a method. Those of refinement and of networks are described in full, for the command line and
// SetOption; request/enhance_flags.h declares the others.
struct MethodOption {
  std::string name;                                        // as in EnhanceOptions::given
  std::function<OptionValue(EnhanceOptions&)> value = {};  // null: not described
  std::string help = {};
  OptionRange range = {};  // of numbers
  // What the option still requires, as the end of "it works only …": "with --images". Null or empty result: nothing.
  std::function<std::string(const MethodUse&)> lacks = {};
  std::string type = {};  // of files and words, for the help
};

// Sets the option `name` among `known` to `text`, 0 or 1 for switches, and adds it to `options.given`.
// Errors (kBadArgument): no such option (lists the known ones); a value of another type or out of range.
Status SetOption(const std::vector<MethodOption>& known, const std::string& name, const std::string& text,
                 EnhanceOptions& options);

// kBadArgument, naming the option, for numbers out of range.
Status CheckRanges(const std::vector<MethodOption>& known, EnhanceOptions& options);

std::string OrList(const std::vector<std::string>& words);  // "a, b or c"

// Words for the values of an enumeration.
template <class Enum>
WordOption ChoiceOf(Enum& value, const std::vector<std::pair<std::string, Enum>>& choices) {
  WordOption option{.set = [&value, choices](const std::string& text) -> Status {
    value = std::ranges::find(choices, text, &std::pair<std::string, Enum>::first)->second;
    return {};
  }};
  for (const auto& [word, meaning] : choices) {
    option.choices.push_back(word);
    if (meaning == value) option.now = word;
  }
  return option;
}

}  // namespace anchorsplat
