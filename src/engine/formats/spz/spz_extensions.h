#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "formats/axes.h"
#include "formats/format_facts.h"
#include "io/inflating_reader.h"

namespace anchorsplat {

// Extension records of SPZ: vendor and record id (32 bits), payload length (32 bits), payload. Three are known:
//
//   0xADBE0002  SPZ_ADOBE_safe_orbit_camera  min and max elevation (radians) and min distance, floats
//   0xADBE0003  SPZ_ADOBE_coordinate_system  axes of the file's numbers, a 32-bit code
//   0x4E530001  SPZ_NIANTIC_georeference     location of the splat on a planet
struct SpzExtension {
  uint32_t id = 0;
  std::string payload;
};

inline constexpr uint64_t kMaxSpzExtensionBytes = uint64_t{16} << 20;  // limit for all records of a file

// Parses the records in `bytes`. `where`: the file, for messages; `begin`: their offset in the file or stream.
// kBadFile: a record longer than the rest.
Result<std::vector<SpzExtension>> ParseSpzExtensions(const std::string& where, uint64_t begin, std::string_view bytes);
// The rest of a gzip stream after its sections. Errors: reading; more than kMaxSpzExtensionBytes.
Result<std::string> ReadSpzExtensionBytes(const std::string& where, CopyableReader& reader);

// Axes declared by a record; none without one. kBadFile: an unknown code, an invalid length, two conflicting records.
Result<std::optional<Axes>> AxesOfSpz(const std::string& where, std::span<const SpzExtension> extensions);

// Records that remain valid in another SPZ of these Gaussians, as comments of the cloud, which PLY keeps; and the
// inverse, for writing. The georeference is kept only if the numbers are in the axes that we write.
std::vector<std::string> CommentsOfSpzExtensions(std::span<const SpzExtension> extensions, const Axes& axes);
std::vector<SpzExtension> SpzExtensionsOf(std::span<const std::string> comments);
// Drops, with a warning, comments that are valid only in the cloud's previous axes.
void DropSpzGeoreference(const std::string& where, std::vector<std::string>& comments);
// Names of records in comments, "SPZ_ADOBE_safe_orbit_camera"; empty if there are none.
std::string NamesOfSpzExtensions(std::span<const std::string> comments);
// Serialised records.
std::string BytesOfSpzExtensions(std::span<const SpzExtension> extensions);

// "SPZ_ADOBE_safe_orbit_camera", or "unknown".
std::string_view NameOfSpzExtension(uint32_t id);
// Adds a fact per record.
void DescribeSpzExtensions(std::span<const SpzExtension> extensions, FormatFacts& facts);
// Warns of records that are neither used nor kept.
void WarnOfSpzExtensions(const std::string& where, std::span<const SpzExtension> extensions, const Axes& axes);

}  // namespace anchorsplat
