#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "compare/comparison.h"
#include "core/result.h"
#include "enhance/enhance.h"

namespace anchorsplat {

// A fact to calculate with: 0 or 1 for what was so or not.
inline double NumberOf(const FactValue& value) {
  return std::visit([](auto told) { return static_cast<double>(told); }, value);
}

// What a method reached on one object.
struct MethodResult {
  std::string object;
  std::string method;
  std::vector<ViewScore> views;  // PSNR infinite for identical pictures
  double seconds = 0;            // of the method
  double render_seconds = 0;     // of all views
  int64_t gaussians = 0;         // 0: there is no splat
  std::map<std::string, FactValue> facts;

  // Over the views; LPIPS only where every view has it.
  double MeanPsnr() const;
  double MeanSsim() const;
  std::optional<double> MeanLpips() const;
};

// Results are kept in a file each, so that an evaluation can go on where it was stopped. `key` says what the result
// depends on; a file with another key counts as none. A file that cannot be understood counts as none, too: it is made
// again.
std::optional<MethodResult> ReadMethodResult(const std::filesystem::path& path, const std::string& key);
Status WriteMethodResult(const std::filesystem::path& path, const std::string& key, const MethodResult& result);

}  // namespace anchorsplat
