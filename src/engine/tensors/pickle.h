#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "tensors/tensor_entry.h"

namespace anchorsplat {

// Reads pickles of torch.save as *data*: nothing is imported or called. The only Python objects are None, bools,
// numbers, strings, tuples, lists, dictionaries, PyTorch tensors and NumPy numbers.

enum class PickleKind : uint8_t {
  kNone,
  kBool,     // integer: 0 or 1
  kInt,      // integer
  kBigInt,   // more than 64 bits; text: its little-endian bytes
  kFloat,    // real
  kText,     // text
  kTuple,    // items
  kList,     // items
  kDict,     // items: key, value, key, value … in insertion order; also OrderedDict
  kGlobal,   // a reference to an allowed class, function or dtype
  kStorage,  // integer: index in PickleDocument::storages
  kTensor,   // integer: index in PickleDocument::tensors
  kNumpy,    // a NumPy number, type or their bytes (learning rates, for example); weights never depend on it
};

struct PickleValue {
  PickleKind kind = PickleKind::kNone;
  int64_t integer = 0;
  double real = 0;
  std::string_view text;       // points into the pickle
  std::vector<int32_t> items;  // indices in PickleDocument::values, which may be shared or cyclic
};

// Storage of tensors, elsewhere in the file.
struct PickleStorage {
  std::string_view key;
  TensorType type = TensorType::kUint8;
  bool untyped = false;  // torch.storage.UntypedStorage: `elements` are bytes, and each tensor has its own type
  int64_t elements = 0;  // ≥ 0
};

// `shape` and `strides` have equal length (≤ kMaxTensorRank) and no negative values. Whether they fit the storage is
// not checked here.
struct PickleTensor {
  int32_t storage = 0;
  TensorType type = TensorType::kFloat32;
  int64_t offset = 0;  // elements, ≥ 0
  std::vector<int64_t> shape;
  std::vector<int64_t> strides;
};

inline constexpr size_t kMaxTensorRank = 32;

struct PickleDocument {
  std::vector<PickleValue> values;
  std::vector<PickleStorage> storages;
  std::vector<PickleTensor> tensors;
  int32_t root = 0;  // index in values
  size_t size = 0;   // bytes up to and including STOP
};

// Runs the pickle at the start of `bytes` (protocols 2 to 5, binary opcodes). `where` starts every message ("x.pth:
// data.pkl"); `base` is added to byte positions in messages.
//
// Errors (kBadFile): a global that is not allowed (named); an opcode that torch.save does not write; a stack or memo
// entry that does not fit its opcode; invalid UTF-8; more than a million values or 131,072 tensors.
Result<PickleDocument> ReadPickle(std::span<const std::byte> bytes, const std::string& where, size_t base = 0);

}  // namespace anchorsplat
