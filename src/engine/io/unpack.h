#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/result.h"
#include "io/input_file.h"

namespace anchorsplat {

// Compression around a whole file, added by servers and users to formats that do not specify it.
enum class Packing { kNone, kGzip, kZstd };

// Detects the compression from the first ten or more bytes of a file.
Packing PackingOf(std::string_view head);
std::string_view NameOf(Packing packing);  // "gzip"

// The first `size` decompressed bytes at most. Errors (kBadFile): damaged, truncated.
Result<std::string> HeadInside(const InputFile& file, Packing packing, size_t size);

// Decompresses a whole file. `compressed_size`: size of the original file, against which the output is checked while it
// grows (compression_ratio.h), so claimed sizes never cause allocations. Trailing bytes are ignored, with a warning
// unless they are zeros. Errors (kBadFile): damaged, truncated, a decompression bomb.
Result<InputFile> Unpack(const InputFile& file, Packing packing, uint64_t compressed_size);

// The original file name in a gzip header; empty if there is none. `head`: the file's first bytes.
std::string NameInGzip(std::string_view head);

}  // namespace anchorsplat
