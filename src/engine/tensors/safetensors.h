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
// tensors' bytes, little-endian and row-major, without holes. Reading goes through TensorFile.

bool LooksLikeSafetensors(std::span<const std::byte> beginning);

// The reader behind TensorFile; entries point into `bytes`, `file` begins every message. The tensors come in the order
// of the header. Errors (kBadFile): a header longer than the file or than the format's 100 MB; broken JSON (with its
// byte); a member missing or twice; an unknown dtype; a shape whose size differs from its data_offsets; tensors that
// overlap, leave holes or reach past the end.
Result<TensorFileContents> ReadSafetensors(std::span<const std::byte> bytes, const std::string& file);

// Writes `tensors` (of any strides) and the string map `metadata` as __metadata__. The header lists the tensors in the
// given order; their bytes are laid out by falling element size behind a header padded to 64 bytes, so that every
// tensor of a mapped file is aligned. The file appears whole or not at all. Errors: kBadArgument (two tensors of one
// name, a name or metadata that is not UTF-8, "__metadata__" as a name, a shape with a negative or overflowing size);
// kExists; kIo.
Status WriteSafetensors(const std::filesystem::path& path, std::span<const TensorEntry> tensors,
                        const std::map<std::string, std::string>& metadata, const WriteOptions& options = {});

}  // namespace anchorsplat
