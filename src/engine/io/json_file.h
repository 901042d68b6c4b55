#pragma once

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// A value inside a JSON file that knows where it stands, so that every complaint names the file and the JSON path
// ("views.json: frames[3].w: expected a whole number, found a string"). Views into the JsonFile it came from.
class JsonValue {
 public:
  JsonValue(const std::string& file, const nlohmann::json& value, std::string path)
      : file_(&file), value_(&value), path_(std::move(path)) {}

  const nlohmann::json& raw() const { return *value_; }
  bool has(const char* key) const { return value_->is_object() && value_->contains(key); }

  std::optional<JsonValue> Find(const char* key) const;  // member of an object; empty when it has none
  Result<JsonValue> Get(const char* key) const;          // the same, or an error
  Result<std::vector<JsonValue>> Elements() const;       // of an array
  JsonValue Element(size_t index) const;                 // of an array that is known to be so long
  Result<double> Number() const;                         // always finite: JSON has no others
  Result<std::vector<double>> Numbers(size_t count) const;
  Result<int> WholeNumber(int min, int max) const;  // 800 and 800.0 alike
  Result<std::string> Text() const;

  Error Complain(const std::string& sentence) const;  // kBadFile
  // The error with the text of this object's member `key` behind it, where it has one: "frames[117]" alone is hard to
  // find in a file of matrices.
  Error Named(const Error& error, const char* key) const;

 private:
  const std::string* file_;
  const nlohmann::json* value_;
  std::string path_;  // "" for the root
};

// JSON has neither infinity nor NaN: null stands for both.
inline nlohmann::json FiniteOrNull(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json();
}

// A parsed JSON file. Errors: as ReadFileBytes; kBadFile with line and column of a syntax error, more than 256 MiB,
// nesting deeper than 64, more than 2^24 values (bounds on the memory a hostile file can claim).
class JsonFile {
 public:
  static Result<JsonFile> Read(const std::filesystem::path& path);
  // The same for bytes that are in memory; `name` is what messages call them.
  static Result<JsonFile> Parse(std::string name, std::string_view bytes);
  JsonValue root() const { return {name_, value_, ""}; }

 private:
  std::string name_;
  nlohmann::json value_;
};

}  // namespace anchorsplat
