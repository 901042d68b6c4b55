#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// Options of a network as a table of a configuration file gives them. Whole numbers are doubles too.
using NetworkOptionValue = std::variant<bool, double, std::string, std::vector<double>>;
using NetworkOptions = std::map<std::string, NetworkOptionValue>;

// Takes options out one by one; an absent one leaves its default in place. The first complaint is kept, so that a
// network reads all of its options and asks once:
//
//   OptionReader reader(options);
//   reader.Whole("copies", 1, 64, config.copies);
//   reader.Number("drop_path", 0, 1, config.drop_path);
//   ANCHORSPLAT_RETURN_IF_ERROR(reader.Finish());
//
// Messages begin with the option's name and a colon ("copies: expected a whole number from 1 to 64"), so that whoever
// read the file can put file and line before them.
class OptionReader {
 public:
  explicit OptionReader(NetworkOptions options) : options_(std::move(options)) {}

  void Flag(const std::string& key, bool& value);
  void Number(const std::string& key, double low, double high, double& value);
  void Whole(const std::string& key, int64_t low, int64_t high, int64_t& value);
  void Whole(const std::string& key, int64_t low, int64_t high, int& value);
  void Text(const std::string& key, const std::vector<std::string>& choices, std::string& value);
  void Wholes(const std::string& key, int64_t low, int64_t high, std::vector<int64_t>& value);

  // kBadArgument: the first option of a wrong type or out of its range; else one that nobody asked for.
  Status Finish() const;

 private:
  template <typename T>
  const T* Take(const std::string& key, const char* expected);
  void Complain(const std::string& key, const std::string& expected);

  NetworkOptions options_;  // not yet taken
  Status first_;
};

}  // namespace anchorsplat
