#include "request/parse.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <set>

#include "core/image.h"
#include "core/number_text.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

// The whole of `text` as a finite number.
std::optional<double> ParseNumber(std::string_view text) {
  double value = 0;
  const auto [end, code] = FromChars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

Result<std::array<double, 3>> ParseTriple(const std::string& option, const std::string& text, const char* form) {
  const Error error{ErrorCode::kBadArgument, Cat(option, ": '", Printable(text), "' is not ", form)};
  std::array<double, 3> out{};
  std::string_view rest = text;
  for (size_t k = 0; k < 3; ++k) {
    const size_t comma = rest.find(',');
    if ((comma == std::string_view::npos) != (k == 2)) return error;
    const auto number = ParseNumber(rest.substr(0, comma));
    if (!number) return error;
    out[k] = *number;
    if (k < 2) rest.remove_prefix(comma + 1);
  }
  return out;
}

// Lower case, with the dot.
std::string Extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

}  // namespace

bool IsPngName(const std::string& path) { return Extension(path) == ".png"; }

bool IsPictureName(const std::string& path) {
  static const std::set<std::string> known = {".png",  ".jpg", ".jpeg", ".webp", ".tif",
                                              ".tiff", ".bmp", ".gif",  ".exr",  ".ppm"};
  return known.contains(Extension(path));
}

Result<SizeOption> ParseSize(const std::string& option, const std::string& text) {
  const Error error{
      ErrorCode::kBadArgument,
      Cat(option, ": '", Printable(text), "' is not WIDTHxHEIGHT in pixels, such as 1024x768, at most 32768 each")};
  const size_t x = text.find('x');
  if (x == std::string::npos) return error;
  const auto width = ParseNumber(std::string_view(text).substr(0, x));
  const auto height = ParseNumber(std::string_view(text).substr(x + 1));
  if (!width || !height) return error;
  const auto fits = [](double v) { return v >= 1 && v <= 32768 && v == std::floor(v); };
  if (!fits(*width) || !fits(*height)) return error;
  if (*width * *height > static_cast<double>(kMaxImagePixels)) {
    return Error{ErrorCode::kBadArgument, Cat(option, " ", text, ": more than ", kMaxImagePixels, " pixels")};
  }
  return SizeOption{static_cast<int>(*width), static_cast<int>(*height)};
}

Result<std::array<float, 3>> ParseColor(const std::string& option, const std::string& text) {
  constexpr const char* kForm = "R,G,B with numbers from 0 to 1, such as 1,1,1 for white";
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto triple, ParseTriple(option, text, kForm));
  for (const double c : triple) {
    if (c < 0 || c > 1) return Error{ErrorCode::kBadArgument, Cat(option, ": '", Printable(text), "' is not ", kForm)};
  }
  return std::array<float, 3>{static_cast<float>(triple[0]), static_cast<float>(triple[1]),
                              static_cast<float>(triple[2])};
}

Result<std::array<double, 3>> ParsePoint(const std::string& option, const std::string& text) {
  return ParseTriple(option, text, "X,Y,Z in world units, such as 0,0.5,0");
}

Result<Region> ParseRegion(const std::string& option, const std::string& text) {
  std::vector<double> numbers;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    const auto number = ParseNumber(std::string_view(text).substr(begin, end - begin));
    if (!number || !std::isfinite(*number)) break;
    numbers.push_back(*number);
    begin = end + 1;
    if (end == text.size()) {
      if (const std::optional<Region> region = RegionOf(numbers)) return *region;
    }
  }
  return Error{ErrorCode::kBadArgument, Cat(option, ": '", Printable(text), "'", kNoRegion)};
}

Result<std::array<double, 3>> ParseDirection(const std::string& option, const std::string& text) {
  constexpr const char* kForm = "a direction: X,Y,Z such as 0,0,1, or an axis such as z or -y";
  const bool negative = text.starts_with('-');
  const std::string_view axis = std::string_view(text).substr(negative || text.starts_with('+') ? 1 : 0);
  std::array<double, 3> out{};
  if (axis == "x" || axis == "y" || axis == "z") {
    out[static_cast<size_t>(axis[0] - 'x')] = negative ? -1 : 1;
    return out;
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(out, ParseTriple(option, text, kForm));
  const double length = std::hypot(out[0], out[1], out[2]);
  if (length > 0 && std::isfinite(length)) return out;
  return Error{ErrorCode::kBadArgument, Cat(option, ": '", Printable(text), "' is not ", kForm)};
}

Result<std::optional<double>> ParsePixelSize(const std::string& option, const std::string& text) {
  if (text == "auto") return std::optional<double>();
  const auto number = ParseNumber(text);
  if (!number || !(*number > 0)) {
    return Error{ErrorCode::kBadArgument,
                 Cat(option, ": '", Printable(text), "' is neither 'auto' nor a positive length in world units")};
  }
  return number;
}

Result<uint64_t> ParseMemory(const std::string& text) {
  const Error bad{ErrorCode::kBadArgument, Cat("'", Printable(text), "' is not a size such as 2G, 500M or 0.5G")};
  double number = 0;
  const char* const last = text.data() + text.size();
  const auto [end, code] = FromChars(text.data(), last, number);
  if (code != std::errc() || !std::isfinite(number)) return bad;
  std::string unit(end, last);
  std::ranges::transform(unit, unit.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  unit.erase(0, unit.find_first_not_of(' '));
  const bool binary = unit.size() == 3 && unit.ends_with("ib");
  if (unit.ends_with('b')) unit.resize(unit.size() - (binary ? 2 : 1));
  constexpr std::string_view kUnits = "kmgt";
  const size_t power = unit.empty() ? 0 : kUnits.find(unit) + 1;
  if (unit.size() > 1 || (power == 0 && !unit.empty())) return bad;
  const double bytes = number * std::pow(binary ? 1024.0 : 1000.0, static_cast<double>(power));
  if (!(bytes >= static_cast<double>(kLeastMemory))) {
    return Error{ErrorCode::kBadArgument,
                 Cat(Printable(text), " is less than the minimum of ", HumanBytes(kLeastMemory))};
  }
  if (!(bytes < 1e18)) return bad;
  return static_cast<uint64_t>(bytes);
}

Result<const SplatFormat*> ParseInputFormat(const std::string& option, const std::string& text) {
  const SplatFormat* const none = nullptr;
  if (text.empty()) return none;
  const SplatFormat* const format = FormatOfName(text);
  if (format != nullptr && format->read != nullptr) return format;
  std::string known;
  for (const SplatFormat& f : Formats()) {
    if (f.read != nullptr) known += Cat(" ", f.extensions.front());
  }
  return Error{ErrorCode::kBadArgument,
               Cat(option, ": '", Printable(text), "' is not a readable format; readable are", known)};
}

}  // namespace anchorsplat
