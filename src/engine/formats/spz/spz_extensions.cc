#include "formats/spz/spz_extensions.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <numbers>
#include <utility>

#include "core/log.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

static_assert(std::endian::native == std::endian::little, "records are copied as they lie in the file");

constexpr uint32_t kSafeOrbit = 0xADBE0002, kCoordinateSystem = 0xADBE0003, kGeoreference = 0x4E530001;
constexpr size_t kSafeOrbitBytes = 12, kGeoreferenceBytes = 76;
constexpr size_t kMostKeptBytes = 4096;  // a PLY header has room for a mebibyte of comments in total

// By code; 0 means unspecified.
constexpr std::array<const char*, 17> kSystems = {"",    "LDB", "RDB", "LUB", "RUB", "LDF", "RDF", "LUF", "RUF",
                                                  "LBD", "RBD", "LBU", "RBU", "LFD", "RFD", "LFU", "RFU"};

constexpr std::string_view kSpzRecordMark = "SPZ extension ";

template <typename T>
T ValueAt(std::string_view bytes, size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

std::string Hex(uint32_t id) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%08X", id);
  return text;
}

// "SPZ_ADOBE_safe_orbit_camera (0xADBE0002)".
std::string NameAndNumber(uint32_t id) { return Cat(NameOfSpzExtension(id), " (", Hex(id), ")"); }

std::string FullRecordName(const SpzExtension& extension) {
  return Cat("extension record ", Hex(extension.id), " of ", WithThousands(std::ssize(extension.payload)), " bytes");
}

bool IsKept(const SpzExtension& extension, const Axes& axes) {
  if (extension.id == kSafeOrbit) return extension.payload.size() == kSafeOrbitBytes;
  return extension.id == kGeoreference && axes == kRub && extension.payload.size() >= kGeoreferenceBytes &&
         extension.payload.size() <= kMostKeptBytes;
}

std::string DegreesOf(float radians) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", static_cast<double>(radians) * 180 / std::numbers::pi);
  return text;
}

std::string Fact(const SpzExtension& extension) {
  const std::string_view payload = extension.payload;
  if (extension.id == kSafeOrbit && payload.size() == kSafeOrbitBytes) {
    return Cat("elevations of ", DegreesOf(ValueAt<float>(payload, 0)), " to ", DegreesOf(ValueAt<float>(payload, 4)),
               " degrees, no nearer than ", ValueAt<float>(payload, 8));
  }
  if (extension.id == kCoordinateSystem && payload.size() == sizeof(uint32_t)) {
    const auto number = ValueAt<uint32_t>(payload, 0);
    return number == 0 ? "not stated (0): read as RUB" : kSystems[number];
  }
  return Cat(WithThousands(std::ssize(payload)), " bytes",
             extension.id == kGeoreference ? ": its place on a planet; positions stay in local coordinates" : "");
}

}  // namespace

Result<std::vector<SpzExtension>> ParseSpzExtensions(const std::string& where, uint64_t begin, std::string_view bytes) {
  constexpr size_t kHead = 2 * sizeof(uint32_t);
  std::vector<SpzExtension> out;
  for (size_t at = 0; at < bytes.size();) {
    const size_t left = bytes.size() - at;
    const size_t size = left < kHead ? 0 : ValueAt<uint32_t>(bytes, at + sizeof(uint32_t));
    if (left < kHead || size > left - kHead) {
      return Error{ErrorCode::kBadFile, Cat(where, ": byte ", WithThousands(static_cast<int64_t>(begin + at)),
                                            ": an extension record of SPZ ends beyond its ",
                                            WithThousands(static_cast<int64_t>(left)), " bytes")};
    }
    out.push_back({ValueAt<uint32_t>(bytes, at), std::string(bytes.substr(at + kHead, size))});
    at += kHead + size;
  }
  return out;
}

Result<std::string> ReadSpzExtensionBytes(const std::string& where, CopyableReader& reader) {
  constexpr size_t kHead = 2 * sizeof(uint32_t);
  std::string bytes;
  while (!reader.Copy()->ExpectEnd().ok()) {
    const size_t begin = bytes.size();
    bytes.resize(begin + kHead);
    ANCHORSPLAT_RETURN_IF_ERROR(reader.Read(bytes.data() + begin, kHead));
    uint64_t left = ValueAt<uint32_t>(bytes, begin + sizeof(uint32_t));
    if (bytes.size() + left > kMaxSpzExtensionBytes) {
      return Error{ErrorCode::kBadFile, Cat(where, ": has extension records of more than ",
                                            HumanBytes(kMaxSpzExtensionBytes), " behind its Gaussians")};
    }
    while (left > 0) {  // in pieces, as the claimed size may exceed the data
      const size_t piece = static_cast<size_t>(std::min<uint64_t>(left, 1 << 16)), end = bytes.size();
      bytes.resize(end + piece);
      ANCHORSPLAT_RETURN_IF_ERROR(reader.Read(bytes.data() + end, piece));
      left -= piece;
    }
  }
  return bytes;
}

Result<std::optional<Axes>> AxesOfSpz(const std::string& where, std::span<const SpzExtension> extensions) {
  std::optional<Axes> axes;
  for (const SpzExtension& extension : extensions) {
    if (extension.id != kCoordinateSystem) continue;
    const std::string name = Cat(where, ": ", NameAndNumber(extension.id));
    if (extension.payload.size() != sizeof(uint32_t)) {
      return Error{ErrorCode::kBadFile, Cat(name, " has ", extension.payload.size(), " bytes, expected 4")};
    }
    const auto number = ValueAt<uint32_t>(extension.payload, 0);
    if (number >= kSystems.size()) {
      return Error{ErrorCode::kBadFile, Cat(name, " is ", number, ", expected 1 to 16: unknown axes")};
    }
    const Axes said = number == 0 ? kRub : AxesFromName(kSystems[number]).value();
    if (axes && *axes != said) {
      return Error{ErrorCode::kBadFile, Cat(name, " says ", NameOfAxes(*axes), " and ", NameOfAxes(said))};
    }
    axes = said;
  }
  return axes;
}

std::vector<std::string> CommentsOfSpzExtensions(std::span<const SpzExtension> extensions, const Axes& axes) {
  std::vector<std::string> comments;
  for (const SpzExtension& extension : extensions) {
    if (!IsKept(extension, axes)) continue;
    std::string text = Cat(kSpzRecordMark, NameAndNumber(extension.id), ": ");
    for (const char c : extension.payload) {
      constexpr std::string_view kDigits = "0123456789abcdef";
      const auto byte = static_cast<unsigned char>(c);
      text += {kDigits[byte >> 4], kDigits[byte & 15]};
    }
    comments.push_back(std::move(text));
  }
  return comments;
}

std::vector<SpzExtension> SpzExtensionsOf(std::span<const std::string> comments) {
  std::vector<SpzExtension> out;
  for (const uint32_t id : {kSafeOrbit, kGeoreference}) {
    const std::string beginning = Cat(kSpzRecordMark, NameAndNumber(id), ": ");
    for (const std::string& comment : comments) {
      if (!comment.starts_with(beginning)) continue;
      const std::string_view digits = std::string_view(comment).substr(beginning.size());
      SpzExtension extension{id, std::string(digits.size() / 2, '\0')};
      bool good = digits.size() % 2 == 0;
      for (size_t k = 0; good && k < extension.payload.size(); ++k) {
        const char* const begin = digits.data() + 2 * k;
        unsigned value = 0;
        const auto [end, error] = std::from_chars(begin, begin + 2, value, 16);
        good = error == std::errc() && end == begin + 2;
        extension.payload[k] = static_cast<char>(value);
      }
      const bool fresh = out.empty() || out.back().id != id;  // one per id
      if (good && fresh && IsKept(extension, kRub)) out.push_back(std::move(extension));
    }
  }
  return out;
}

void DropSpzGeoreference(const std::string& where, std::vector<std::string>& comments) {
  const std::string beginning = Cat(kSpzRecordMark, NameAndNumber(kGeoreference));
  const auto is_place = [&](const std::string& comment) { return comment.starts_with(beginning); };
  if (std::erase_if(comments, is_place) == 0) return;
  LogWarning(
      Cat(where, ": ", NameOfSpzExtension(kGeoreference), " is dropped, as --coords changes the axes it refers to"));
}

std::string NamesOfSpzExtensions(std::span<const std::string> comments) {
  std::string names;
  for (const SpzExtension& extension : SpzExtensionsOf(comments)) {
    names += Cat(names.empty() ? "" : " and ", NameOfSpzExtension(extension.id));
  }
  return names;
}

std::string BytesOfSpzExtensions(std::span<const SpzExtension> extensions) {
  std::string bytes;
  for (const SpzExtension& extension : extensions) {
    const uint32_t head[2] = {extension.id, static_cast<uint32_t>(extension.payload.size())};
    bytes.append(reinterpret_cast<const char*>(head), sizeof head);
    bytes += extension.payload;
  }
  return bytes;
}

std::string_view NameOfSpzExtension(uint32_t id) {
  return id == kSafeOrbit          ? "SPZ_ADOBE_safe_orbit_camera"
         : id == kCoordinateSystem ? "SPZ_ADOBE_coordinate_system"
         : id == kGeoreference     ? "SPZ_NIANTIC_georeference"
                                   : "unknown";
}

void DescribeSpzExtensions(std::span<const SpzExtension> extensions, FormatFacts& facts) {
  for (const SpzExtension& extension : extensions) {
    facts.Add(Cat("extension ", NameAndNumber(extension.id)), Fact(extension));
  }
}

void WarnOfSpzExtensions(const std::string& where, std::span<const SpzExtension> extensions, const Axes& axes) {
  constexpr size_t kMostSaid = 4;
  size_t said = 0;
  for (const SpzExtension& extension : extensions) {
    if (extension.id == kCoordinateSystem || IsKept(extension, axes)) continue;
    if (said++ == kMostSaid) return LogWarning(Cat(where, ": further extension records are dropped"));
    const std::string_view name = NameOfSpzExtension(extension.id);
    const bool known = name != "unknown";
    LogWarning(Cat(where, ": ", FullRecordName(extension), known ? Cat(" (", name, ")") : "",
                   known ? " is not used: dropped" : " is unknown: dropped"));
  }
}

}  // namespace anchorsplat
