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

// Element types that checkpoints of networks and splats hold. Complex, quantised and 8-bit floating-point tensors are
// refused by the readers.
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
const char* TypeName(TensorType type);  // PyTorch's word: "float32", "bfloat16", …

// A named array somewhere in memory that it does not own: for arrays of a file, in the file's mapping.
struct TensorEntry {
  std::string name;
  TensorType type = TensorType::kFloat32;
  std::vector<int64_t> shape;       // empty = one number
  std::vector<int64_t> strides;     // elements, one per dimension, ≥ 0
  const std::byte* data = nullptr;  // element (0, …, 0), of any alignment, little-endian

  int64_t elements() const;  // product of the shape
  int64_t bytes() const { return elements() * ItemSize(type); }
  bool contiguous() const;        // row-major without gaps (strides of dimensions of length 1 do not matter)
  std::string ShapeText() const;  // "[64, 59]"
};

// An entry that views `values`, row-major; the product of `shape` must be their number (checked by the writers).
TensorEntry MakeEntry(std::string name, std::vector<int64_t> shape, std::span<const float> values);
TensorEntry MakeEntry(std::string name, std::vector<int64_t> shape, std::span<const int64_t> values);

// Row-major strides of a shape.
std::vector<int64_t> RowMajorStrides(std::span<const int64_t> shape);

// Product of a shape; nothing when a dimension is negative or the product does not fit.
std::optional<int64_t> CountElements(std::span<const int64_t> shape);

// The values where they lie; nothing unless they are float32, contiguous and aligned.
std::optional<std::span<const float>> ViewFloat32(const TensorEntry& entry);

// The values as row-major float32, converted from float64 (rounded to nearest), float16 or bfloat16 (both exact).
// Errors (kBadFile, naming the tensor): the type is not a floating-point one; out of memory.
Result<Buffer<float>> CopyFloat32(const TensorEntry& entry);

// The values as row-major int64, converted from any integer type or bool. Errors (kBadFile): a floating-point type, a
// uint64 above the range, out of memory.
Result<Buffer<int64_t>> CopyInt64(const TensorEntry& entry);

// The elements' bytes, row-major. Errors (kBadFile): out of memory.
Result<Buffer<std::byte>> CopyContiguous(const TensorEntry& entry);

// kBadFile with the tensor's name and the first offending index when a value is NaN or infinite.
Status CheckFinite(std::string_view name, std::span<const float> values);

}  // namespace anchorsplat
