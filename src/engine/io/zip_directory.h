#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// One file inside a zip archive; name and data are views into the archive's bytes.
struct ZipEntry {
  std::string_view name;
  std::span<const std::byte> data;  // as they lie in the archive
  int method = 0;                   // 0 stored, 8 deflated
  uint64_t size = 0;                // of the contents
  uint32_t crc = 0;                 // of the contents
};

// The entries of a zip archive in the order of the central directory. zip64 and data descriptors are understood: sizes
// come from the central directory, because local headers may say zero there. Every range lies within `archive`, and no
// two entries share bytes.
//
// Errors (kBadFile, beginning with `file` and the byte): no end record, which is what a truncated file looks like;
// several disks; a directory that does not hold what its count promises; an entry that is encrypted, outside the file,
// overlapping another or of the same name, or stored in fewer bytes than it has.
Result<std::vector<ZipEntry>> ReadZipDirectory(std::span<const std::byte> archive, const std::string& file);

}  // namespace anchorsplat
