#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// Network options as a table of a configuration file gives them. Integers are stored as double.
using NetworkOptionValue = std::variant<bool, double, std::string, std::vector<double>>;
using NetworkOptions = std::map<std::string, NetworkOptionValue>;

// Consumes options one by one; an absent option keeps its default. Remembers the first error, so a network reads all
// its options and checks once:
//
//   OptionReader reader(options);
//   reader.Integer("copies", 1, 64, config.copies);
//   reader.Number("drop_path", 0, 1, config.drop_path);
//   ANCHORSPLAT_RETURN_IF_ERROR(reader.Finish());
//
// Messages start with the option's name ("copies: expected a whole number from 1 to 64"); the caller prepends file and
// line.
class OptionReader {
 public:
  explicit OptionReader(NetworkOptions options) : options_(std::move(options)) {}

  void Flag(const std::string& key, bool& value);
  void Number(const std::string& key, double low, double high, double& value);
  void Integer(const std::string& key, int64_t low, int64_t high, int64_t& value);
  void Integer(const std::string& key, int64_t low, int64_t high, int& value);
  void Text(const std::string& key, const std::vector<std::string>& choices, std::string& value);
  void Integers(const std::string& key, int64_t low, int64_t high, std::vector<int64_t>& value);

  // kBadArgument: the first option of wrong type or range, else the first unknown one.
  Status Finish() const;

 private:
  template <typename T>
  const T* Take(const std::string& key, const char* expected);
  void Complain(const std::string& key, const std::string& expected);

  NetworkOptions options_;  // not consumed yet
  Status first_;
};

}  // namespace anchorsplat
