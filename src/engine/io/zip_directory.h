#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// A file in a zip archive; name and data point into the archive's bytes.
struct ZipEntry {
  std::string_view name;
  std::span<const std::byte> data;  // compressed
  int method = 0;                   // 0 stored, 8 deflated
  uint64_t size = 0;                // of the decompressed contents
  uint32_t crc = 0;                 // of the decompressed contents
};

// Reads the entries of a zip archive in the order of the central directory. Handles zip64 and data descriptors: sizes
// come from the central directory, as local headers may have zeros. All ranges lie within `archive` and do not overlap.
//
// Errors (kBadFile, starting with `file` and the byte): no end record, as in a truncated file; multiple disks; a
// directory with fewer entries than its count; an entry that is encrypted, outside the file, overlaps or has the name
// of another, or is stored in fewer bytes than its size.
Result<std::vector<ZipEntry>> ReadZipDirectory(std::span<const std::byte> archive, const std::string& file);

}  // namespace anchorsplat
