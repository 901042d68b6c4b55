#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/region.h"
#include "core/result.h"
#include "formats/registry.h"

namespace anchorsplat {

// Option values with a form of their own. Errors (kBadArgument) name the option and show the form.
bool IsPngName(const std::string& path);      // *.png in any case
bool IsPictureName(const std::string& path);  // the extension of some picture format, ours or not
struct SizeOption {
  int width = 0;
  int height = 0;
};
Result<SizeOption> ParseSize(const std::string& option, const std::string& text);              // "1024x768"
Result<std::array<float, 3>> ParseColor(const std::string& option, const std::string& text);   // "R,G,B", each 0–1
Result<std::array<double, 3>> ParsePoint(const std::string& option, const std::string& text);  // "X,Y,Z"
// A box "X0,Y0,Z0,X1,Y1,Z1" by any two corners across, or a sphere "X,Y,Z,RADIUS".
Result<Region> ParseRegion(const std::string& option, const std::string& text);
// "X,Y,Z", not all 0, or "x", "-z" and the like.
Result<std::array<double, 3>> ParseDirection(const std::string& option, const std::string& text);
// A format that is read, by an extension of it with or without its dot; null for "".
Result<const SplatFormat*> ParseInputFormat(const std::string& option, const std::string& text);
inline constexpr const char* kInputFormatHelp =
    "Format of the input, by its extension, if neither name nor content shows it (.splat from a pipe)";
// "2G", "500M", "0.5G", "1GiB" or bytes as a number. kBadArgument: none, or less than kLeastMemory.
Result<uint64_t> ParseMemory(const std::string& text);
inline constexpr uint64_t kLeastMemory = 64'000'000;  // bytes
// A whole number of at least 1, or nothing for "auto".
Result<std::optional<int64_t>> ParseCopies(const std::string& option, const std::string& text);
// A positive number, or nothing for "auto".
Result<std::optional<double>> ParsePixelSize(const std::string& option, const std::string& text);

}  // namespace anchorsplat
