#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "core/result.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

// Readers of torch.save's formats for TensorFile, which documents names and errors. Entries point into `bytes`; `file`
// starts every message.

bool LooksLikeTorchZip(std::span<const std::byte> beginning);     // "PK…"
bool LooksLikeTorchLegacy(std::span<const std::byte> beginning);  // a pickle

// The zip container: `<root>/data.pkl` and one entry `<root>/data/<key>` per storage.
Result<TensorFileContents> ReadTorchZip(std::span<const std::byte> bytes, const std::string& file);

// The container before PyTorch 1.6: five consecutive pickles (magic number, version, machine properties, the object,
// storage keys), then per key the number of elements (int64) and the elements.
Result<TensorFileContents> ReadTorchLegacy(std::span<const std::byte> bytes, const std::string& file);

}  // namespace anchorsplat
