#include "network/torch/network_options.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "core/text.h"

namespace anchorsplat {

namespace {

std::optional<int64_t> AsInteger(double value, int64_t low, int64_t high) {
  // Compared as double first: converting an unrepresentable value is undefined.
  if (!(value >= static_cast<double>(low) && value <= static_cast<double>(high)) || value != std::floor(value)) {
    return std::nullopt;
  }
  return static_cast<int64_t>(value);
}

}  // namespace

void OptionReader::Complain(const std::string& key, const std::string& expected) {
  if (first_.ok()) first_ = Error{ErrorCode::kBadArgument, Cat(key, ": expected ", expected)};
}

template <typename T>
const T* OptionReader::Take(const std::string& key, const char* expected) {
  const auto found = options_.find(key);
  if (found == options_.end()) return nullptr;
  const T* value = std::get_if<T>(&found->second);
  if (value == nullptr) Complain(key, expected);
  return value;
}

void OptionReader::Flag(const std::string& key, bool& value) {
  if (const bool* given = Take<bool>(key, "true or false")) value = *given;
  options_.erase(key);
}

void OptionReader::Number(const std::string& key, double low, double high, double& value) {
  if (const double* given = Take<double>(key, "a number")) {
    if (*given >= low && *given <= high) {
      value = *given;
    } else {
      Complain(key, Cat("a number from ", low, " to ", high));
    }
  }
  options_.erase(key);
}

void OptionReader::Integer(const std::string& key, int64_t low, int64_t high, int64_t& value) {
  if (const double* given = Take<double>(key, "a whole number")) {
    if (const auto whole = AsInteger(*given, low, high)) {
      value = *whole;
    } else {
      Complain(key, Cat("a whole number from ", low, " to ", high));
    }
  }
  options_.erase(key);
}

void OptionReader::Integer(const std::string& key, int64_t low, int64_t high, int& value) {
  int64_t wide = value;
  Integer(key, low, high, wide);
  value = static_cast<int>(wide);
}

void OptionReader::Text(const std::string& key, const std::vector<std::string>& choices, std::string& value) {
  std::string list;
  for (const std::string& choice : choices) list += (list.empty() ? "\"" : ", \"") + choice + "\"";
  if (const std::string* given = Take<std::string>(key, "a string")) {
    if (std::find(choices.begin(), choices.end(), *given) != choices.end()) {
      value = *given;
    } else {
      Complain(key, Cat("one of ", list));
    }
  }
  options_.erase(key);
}

void OptionReader::Integers(const std::string& key, int64_t low, int64_t high, std::vector<int64_t>& value) {
  if (const auto* given = Take<std::vector<double>>(key, "a list of whole numbers")) {
    std::vector<int64_t> list;
    for (const double number : *given) {
      const auto whole = AsInteger(number, low, high);
      if (!whole) {
        Complain(key, Cat("a list of whole numbers from ", low, " to ", high));
        break;
      }
      list.push_back(*whole);
    }
    if (list.size() == given->size()) value = std::move(list);
  }
  options_.erase(key);
}

Status OptionReader::Finish() const {
  if (!first_.ok()) return first_;
  if (options_.empty()) return {};
  return Error{ErrorCode::kBadArgument, Cat(options_.begin()->first, ": unknown option")};
}

}  // namespace anchorsplat
