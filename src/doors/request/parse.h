#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/region.h"
#include "core/result.h"
#include "formats/registry.h"

namespace anchorsplat {

// Parsers of option values. Errors (kBadArgument) name the option and show the form.
bool IsPngName(const std::string& path);      // *.png in any case
bool IsPictureName(const std::string& path);  // extension of a picture format, supported or not
struct SizeOption {
  int width = 0;
  int height = 0;
};
Result<SizeOption> ParseSize(const std::string& option, const std::string& text);              // "1024x768"
Result<std::array<float, 3>> ParseColor(const std::string& option, const std::string& text);   // "R,G,B", each 0–1
Result<std::array<double, 3>> ParsePoint(const std::string& option, const std::string& text);  // "X,Y,Z"
// A box "X0,Y0,Z0,X1,Y1,Z1", by two opposite corners, or a sphere "X,Y,Z,RADIUS".
Result<Region> ParseRegion(const std::string& option, const std::string& text);
// "X,Y,Z", not all 0, or an axis such as "x" or "-z".
Result<std::array<double, 3>> ParseDirection(const std::string& option, const std::string& text);
// A readable format by its extension, with or without dot; null for "".
Result<const SplatFormat*> ParseInputFormat(const std::string& option, const std::string& text);
inline constexpr const char* kInputFormatHelp =
    "Extension of the input's format, if neither name nor content shows it (.splat from a pipe)";
// "2G", "500M", "0.5G", "1GiB" or a number of bytes. kBadArgument: invalid, or below kLeastMemory.
Result<uint64_t> ParseMemory(const std::string& text);
inline constexpr uint64_t kLeastMemory = 64'000'000;  // bytes
// A positive number; unset for "auto".
Result<std::optional<double>> ParsePixelSize(const std::string& option, const std::string& text);

}  // namespace anchorsplat
