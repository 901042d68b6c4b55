#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/buffer.h"
#include "core/result.h"

namespace anchorsplat {

// Element types of network and splat checkpoints. Readers refuse complex, quantised and 8-bit float tensors.
enum class TensorType {
  kFloat64,
  kFloat32,
  kFloat16,
  kBFloat16,
  kInt64,
  kInt32,
  kInt16,
  kInt8,
  kUint64,
  kUint32,
  kUint16,
  kUint8,
  kBool,  // one byte, 0 or 1
};

int64_t ItemSize(TensorType type);      // bytes per element
const char* TypeName(TensorType type);  // PyTorch's name: "float32", "bfloat16", …

// A named array in memory it does not own; for arrays of a file, in its mapping.
struct TensorEntry {
  std::string name;
  TensorType type = TensorType::kFloat32;
  std::vector<int64_t> shape;       // empty: a scalar
  std::vector<int64_t> strides;     // elements, one per dimension, ≥ 0
  const std::byte* data = nullptr;  // element (0, …, 0), any alignment, little-endian

  int64_t elements() const;  // product of the shape
  int64_t bytes() const { return elements() * ItemSize(type); }
  bool contiguous() const;        // row-major without gaps (strides of dimensions of length 1 are ignored)
  std::string ShapeText() const;  // "[64, 59]"
};

// A row-major entry that borrows `values`; the product of `shape` must be their number (checked by the writers).
TensorEntry MakeEntry(std::string name, std::vector<int64_t> shape, std::span<const float> values);
TensorEntry MakeEntry(std::string name, std::vector<int64_t> shape, std::span<const int64_t> values);

// Row-major strides of a shape.
std::vector<int64_t> RowMajorStrides(std::span<const int64_t> shape);

// Product of a shape; none if a dimension is negative or the product overflows.
std::optional<int64_t> CountElements(std::span<const int64_t> shape);

// The values in place; none unless float32, contiguous and aligned.
std::optional<std::span<const float>> ViewFloat32(const TensorEntry& entry);

// A row-major float32 copy, converted from float64 (rounded to nearest), float16 or bfloat16 (exact). Errors (kBadFile,
// naming the tensor): not a floating-point type; out of memory.
Result<Buffer<float>> CopyFloat32(const TensorEntry& entry);

// A row-major int64 copy, converted from any integer type or bool. Errors (kBadFile): a floating-point type, a uint64
// out of range, out of memory.
Result<Buffer<int64_t>> CopyInt64(const TensorEntry& entry);

// A row-major copy of the bytes. Errors (kBadFile): out of memory.
Result<Buffer<std::byte>> CopyContiguous(const TensorEntry& entry);

// kBadFile with `name` and the first index at which a value is NaN or infinite.
Status CheckFinite(std::string_view name, std::span<const float> values);

}  // namespace anchorsplat
