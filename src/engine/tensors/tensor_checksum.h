#pragma once

#include <map>
#include <span>
#include <string>

#include "core/result.h"
#include "tensors/tensor_entry.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

// States that a run goes on from say what their bytes add up to: a flipped bit in them would otherwise be optimised
// into the result. The sum is a Fingerprint (core/fingerprint.h) of all tensors, with names, types and shapes, and of
// the metadata but for the sum itself.
inline constexpr const char* kChecksumKey = "checksum";

// `metadata` with the checksum of it and of `tensors`, for WriteSafetensors, which has to get the tensors in this
// order. Errors (kBadFile): out of memory for a tensor that is not contiguous.
Result<std::map<std::string, std::string>> WithChecksum(std::map<std::string, std::string> metadata,
                                                        std::span<const TensorEntry> tensors);

// Reads the whole file. Errors (kBadFile): it has no checksum, or another one than its contents: it is damaged.
Status VerifyChecksum(const TensorFile& file);

}  // namespace anchorsplat
