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

// A value in a JSON file with its path, so that errors name file and JSON path ("views.json: frames[3].w: expected a
// whole number, found a string"). Refers to the JsonFile it came from.
class JsonValue {
 public:
  JsonValue(const std::string& file, const nlohmann::json& value, std::string path)
      : file_(&file), value_(&value), path_(std::move(path)) {}

  const nlohmann::json& raw() const { return *value_; }
  bool has(const char* key) const { return value_->is_object() && value_->contains(key); }

  std::optional<JsonValue> Find(const char* key) const;  // member of an object; none if absent
  Result<JsonValue> Get(const char* key) const;          // the same; error if absent
  Result<std::vector<JsonValue>> Elements() const;       // of an array
  JsonValue Element(size_t index) const;                 // of an array; `index` in range
  Result<double> Number() const;                         // finite: JSON has no other numbers
  Result<std::vector<double>> Numbers(size_t count) const;
  Result<int> WholeNumber(int min, int max) const;  // accepts 800.0
  Result<std::string> Text() const;

  Error Complain(const std::string& sentence) const;  // kBadFile
  // Appends the text of this object's member `key` to the error, if present: "frames[117]" alone is hard to find in a
  // file of matrices.
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

// A parsed JSON file. Errors: those of ReadFileBytes; kBadFile: a syntax error (with line and column), more than 256
// MiB, nesting deeper than 64, or more than 2^24 values (bounds on the memory a hostile file can claim).
class JsonFile {
 public:
  static Result<JsonFile> Read(const std::filesystem::path& path);
  // The same for bytes in memory; `name` is used in messages.
  static Result<JsonFile> Parse(std::string name, std::string_view bytes);
  JsonValue root() const { return {name_, value_, ""}; }

 private:
  std::string name_;
  nlohmann::json value_;
};

}  // namespace anchorsplat
