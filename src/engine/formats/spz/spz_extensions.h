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

// The records by which programs add to SPZ: a number of the vendor and the record (32 bits), the length of what follows
// (32 bits), and so many bytes. Three are known:
//
//   0xADBE0002  SPZ_ADOBE_safe_orbit_camera  least and largest elevation (radians) and least distance, floats
//   0xADBE0003  SPZ_ADOBE_coordinate_system  the axes that the file's numbers are in, a number of 32 bits
//   0x4E530001  SPZ_NIANTIC_georeference     where on a planet the splat lies
struct SpzExtension {
  uint32_t id = 0;
  std::string payload;
};

inline constexpr uint64_t kMostSpzExtensionBytes = uint64_t{16} << 20;  // of all records of a file

// The records in `bytes`. `where`: the file, for messages; `begin`: where they are in it or its stream.
// kBadFile: a record that is longer than what is left.
Result<std::vector<SpzExtension>> ParseSpzExtensions(const std::string& where, uint64_t begin, std::string_view bytes);
// What is left of a gzip stream behind its sections. Errors: of reading; more than kMostSpzExtensionBytes.
Result<std::string> ReadSpzExtensionBytes(const std::string& where, CopyableReader& reader);

// The axes that a record declares; nothing where none does. kBadFile: a number that stands for no axes, a record of
// another length, two that disagree.
Result<std::optional<Axes>> AxesOfSpz(const std::string& where, std::span<const SpzExtension> extensions);

// Records that mean the same in any SPZ of these Gaussians, as comments of the cloud, which PLY keeps; and from
// comments for a file that is written. The place on a planet is one only where the numbers are in the axes that we
// write.
std::vector<std::string> CommentsOfSpzExtensions(std::span<const SpzExtension> extensions, const Axes& axes);
std::vector<SpzExtension> SpzExtensionsOf(std::span<const std::string> comments);
// Drops, with a warning, comments that hold only in the axes that the cloud had until now.
void DropSpzPlaces(const std::string& where, std::vector<std::string>& comments);
// "SPZ_ADOBE_safe_orbit_camera" of the records in comments; empty where there are none.
std::string NamesOfSpzExtensions(std::span<const std::string> comments);
// The bytes of records.
std::string BytesOfSpzExtensions(std::span<const SpzExtension> extensions);

// "SPZ_ADOBE_safe_orbit_camera", or "unknown".
std::string_view NameOfSpzExtension(uint32_t id);
// A line for each record.
void DescribeSpzExtensions(std::span<const SpzExtension> extensions, FormatFacts& facts);
// Says which records are neither used nor kept.
void WarnOfSpzExtensions(const std::string& where, std::span<const SpzExtension> extensions, const Axes& axes);

}  // namespace anchorsplat
