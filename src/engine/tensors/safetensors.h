#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <span>
#include <string>

#include "core/result.h"
#include "io/write_options.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

// safetensors (https://huggingface.co/docs/safetensors): 8 bytes with the length of a JSON header, the header, then the
// tensors' bytes, little-endian, row-major and without gaps. Read through TensorFile.

bool LooksLikeSafetensors(std::span<const std::byte> beginning);

// Reader for TensorFile. Entries, in header order, point into `bytes`; `file` starts every message. Errors (kBadFile):
// a header longer than the file or the format's 100 MB; invalid JSON (with its byte); a missing or duplicate member; an
// unknown dtype; a shape that does not match its data_offsets; tensors that overlap, leave gaps or exceed the file.
Result<TensorFileContents> ReadSafetensors(std::span<const std::byte> bytes, const std::string& file);

// Writes `tensors` (of any strides), and `metadata` as __metadata__. The header keeps the given order; data is sorted
// by decreasing element size after a header padded to 64 bytes, so that all tensors of a mapped file are aligned. All
// or nothing. Errors: kBadArgument: duplicate names, invalid UTF-8 in a name or metadata, a tensor named
// "__metadata__", a negative or overflowing size; kExists; kIo.
Status WriteSafetensors(const std::filesystem::path& path, std::span<const TensorEntry> tensors,
                        const std::map<std::string, std::string>& metadata, const WriteOptions& options = {});

}  // namespace anchorsplat
