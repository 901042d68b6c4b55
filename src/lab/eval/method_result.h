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

// A fact as a number: 0 or 1 for flags.
inline double NumberOf(const FactValue& value) {
  return std::visit([](auto told) { return static_cast<double>(told); }, value);
}

// Result of a method on one object.
struct MethodResult {
  std::string object;
  std::string method;
  std::vector<ViewScore> views;  // PSNR is infinite for identical pictures
  double seconds = 0;            // of the method
  double render_seconds = 0;     // all views
  int64_t gaussians = 0;         // 0: no splat
  std::map<std::string, FactValue> facts;

  // Means over the views; LPIPS only if every view has it.
  double MeanPsnr() const;
  double MeanSsim() const;
  std::optional<double> MeanLpips() const;
};

// Results are stored in one file each, so that an evaluation can resume. `key`: everything the result depends on.
// Reading returns nothing for another key or an invalid file; the result is then computed again.
std::optional<MethodResult> ReadMethodResult(const std::filesystem::path& path, const std::string& key);
Status WriteMethodResult(const std::filesystem::path& path, const std::string& key, const MethodResult& result);

}  // namespace anchorsplat
