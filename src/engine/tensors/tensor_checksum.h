#pragma once

#include <map>
#include <span>
#include <string>

#include "core/result.h"
#include "tensors/tensor_entry.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

// Checksum of saved state, without which a flipped bit would be optimised into the result. It is a Fingerprint
// (core/fingerprint.h) of all tensors with names, types and shapes, and of the metadata except the checksum.
inline constexpr const char* kChecksumKey = "checksum";

// Adds the checksum of `metadata` and `tensors`, for WriteSafetensors with the tensors in the same order. Errors
// (kBadFile): out of memory for a tensor that is not contiguous.
Result<std::map<std::string, std::string>> WithChecksum(std::map<std::string, std::string> metadata,
                                                        std::span<const TensorEntry> tensors);

// Verifies the checksum by reading the whole file. Errors (kBadFile): no checksum, or damaged contents.
Status VerifyChecksum(const TensorFile& file);

}  // namespace anchorsplat
