#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "core/result.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

// Readers behind TensorFile for what torch.save writes; entries point into `bytes`, `file` begins every message.
// Rules for names and the list of errors stand at TensorFile.

bool LooksLikeTorchZip(std::span<const std::byte> beginning);     // "PK…"
bool LooksLikeTorchLegacy(std::span<const std::byte> beginning);  // a pickle

// The zip container: `<root>/data.pkl` and one entry `<root>/data/<key>` per storage.
Result<TensorFileContents> ReadTorchZip(std::span<const std::byte> bytes, const std::string& file);

// The container before PyTorch 1.6: five pickles one after the other (magic number, version, facts about the machine,
// the object, the storages' keys), then per key the number of elements (int64) and the elements.
Result<TensorFileContents> ReadTorchLegacy(std::span<const std::byte> bytes, const std::string& file);

}  // namespace anchorsplat
