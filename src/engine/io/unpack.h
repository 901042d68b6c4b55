#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/result.h"
#include "io/input_file.h"

namespace anchorsplat {

// What lies around a whole file: servers and people compress files that know nothing of it.
enum class Packing { kNone, kGzip, kZstd };

// By the first bytes of a file; ten are enough.
Packing PackingOf(std::string_view head);
std::string_view NameOf(Packing packing);  // "gzip"

// The first bytes of what a packed file holds, at most `size`. Errors (kBadFile): damaged, cut off.
Result<std::string> HeadInside(const InputFile& file, Packing packing, size_t size);

// All that a packed file holds. `paid`: the size of the file that it comes from, to which what comes out is compared
// (compression_ratio.h) as it comes: nothing is allocated for what the data promises. Bytes behind the data are not
// read, which a warning says unless they are zeros. Errors (kBadFile): damaged, cut off, a decompression bomb.
Result<InputFile> Unpack(const InputFile& file, Packing packing, uint64_t paid);

// The name that a gzip file says its content had; empty where it says none. `head`: its first bytes.
std::string NameInGzip(std::string_view head);

}  // namespace anchorsplat
