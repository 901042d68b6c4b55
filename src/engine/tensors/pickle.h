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

// A pickle as torch.save writes it, read as *data*: nothing is imported and nothing is called. Of Python's objects only
// None, bools, numbers, strings, tuples, lists, dictionaries, PyTorch's tensors and NumPy's numbers exist here.

enum class PickleKind : uint8_t {
  kNone,
  kBool,     // integer: 0 or 1
  kInt,      // integer
  kBigInt,   // more than 64 bits; text: its little-endian bytes
  kFloat,    // real
  kText,     // text
  kTuple,    // items
  kList,     // items
  kDict,     // items: key, value, key, value … in order of insertion; OrderedDict too
  kGlobal,   // an allowed class, function or dtype that is mentioned, not used
  kStorage,  // integer: index in PickleDocument::storages
  kTensor,   // integer: index in PickleDocument::tensors
  kNumpy,    // a number or a type of NumPy, or their bytes, as learning rates are: nothing that weights depend on
};

struct PickleValue {
  PickleKind kind = PickleKind::kNone;
  int64_t integer = 0;
  double real = 0;
  std::string_view text;       // points into the pickle's bytes
  std::vector<int32_t> items;  // indices in PickleDocument::values; the graph may share values and even have cycles
};

// The bytes that a tensor looks at, stored elsewhere in the file.
struct PickleStorage {
  std::string_view key;
  TensorType type = TensorType::kUint8;
  bool untyped = false;  // torch.storage.UntypedStorage: `elements` are bytes, each tensor says its own type
  int64_t elements = 0;  // ≥ 0
};

// Shape and strides have the same length (at most kMaxTensorRank) and no negative number; whether they fit into the
// storage is not checked here.
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

// Runs the pickle at the start of `bytes` (protocols 2 to 5, binary opcodes). `where` begins every message ("x.pth:
// data.pkl"), `base` is added to the byte positions in them.
//
// Errors (kBadFile): a global that is not on the list of tensor parts, by name; an opcode that torch.save does not
// write; a stack or memo that does not hold what an opcode needs; text that is not UTF-8; more than a million values or
// 131,072 tensors.
Result<PickleDocument> ReadPickle(std::span<const std::byte> bytes, const std::string& where, size_t base = 0);

}  // namespace anchorsplat
