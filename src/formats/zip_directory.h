#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// One uncompressed file inside a zip archive; both members are views into the archive's bytes.
struct ZipEntry {
  std::string_view name;
  std::span<const std::byte> data;
};

// The entries of a zip archive that only *stores* its files, as torch.save writes it, in the order of the central
// directory. zip64 and data descriptors are understood: sizes come from the central directory, because local headers
// may say zero there. Every range lies within `archive`, and no two entries share bytes.
//
// Errors (kBadFile, beginning with `file` and the byte): no end record, which is what a truncated file looks like;
// several disks; a directory that does not hold what its count promises; an entry that is compressed, encrypted,
// outside the file, overlapping another or of the same name.
Result<std::vector<ZipEntry>> ReadStoredZip(std::span<const std::byte> archive, const std::string& file);

}  // namespace anchorsplat
