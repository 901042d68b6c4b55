#include "tensors/tensor_entry.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <utility>

#include "core/half.h"
#include "core/parallel.h"
#include "core/text.h"
#include "io/little_endian.h"

namespace anchorsplat {

namespace {

struct TypeFacts {
  const char* name;
  int64_t size;
};

TypeFacts Facts(TensorType type) {
  switch (type) {
    case TensorType::kFloat64:
      return {"float64", 8};
    case TensorType::kFloat32:
      return {"float32", 4};
    case TensorType::kFloat16:
      return {"float16", 2};
    case TensorType::kBFloat16:
      return {"bfloat16", 2};
    case TensorType::kInt64:
      return {"int64", 8};
    case TensorType::kInt32:
      return {"int32", 4};
    case TensorType::kInt16:
      return {"int16", 2};
    case TensorType::kInt8:
      return {"int8", 1};
    case TensorType::kUint64:
      return {"uint64", 8};
    case TensorType::kUint32:
      return {"uint32", 4};
    case TensorType::kUint16:
      return {"uint16", 2};
    case TensorType::kUint8:
      return {"uint8", 1};
    case TensorType::kBool:
      return {"bool", 1};
  }
  return {"", 0};
}

constexpr int64_t kTensorGrain = int64_t{1} << 18;

// Calls put(i, address) for the row-major indices i in [begin, end).
template <typename Put>
void ForElements(const TensorEntry& entry, int64_t begin, int64_t end, Put&& put) {
  const int64_t item = ItemSize(entry.type);
  if (entry.contiguous()) {
    for (int64_t i = begin; i < end; ++i) put(i, entry.data + i * item);
    return;
  }
  const size_t rank = entry.shape.size();
  std::vector<int64_t> index(rank);
  int64_t offset = 0;  // elements from (0, …, 0)
  int64_t rest = begin;
  for (size_t d = rank; d-- > 0;) {
    index[d] = rest % entry.shape[d];
    rest /= entry.shape[d];
    offset += index[d] * entry.strides[d];
  }
  for (int64_t i = begin; i < end; ++i) {
    put(i, entry.data + offset * item);
    for (size_t d = rank; d-- > 0;) {
      offset += entry.strides[d];
      if (++index[d] < entry.shape[d]) break;
      offset -= index[d] * entry.strides[d];
      index[d] = 0;
    }
  }
}

template <typename T>
Result<Buffer<T>> Allocate(const TensorEntry& entry, int64_t count) {
  Buffer<T> out;
  try {
    out.resize(static_cast<size_t>(count));
  } catch (const std::exception&) {  // bad_alloc or length_error
    return Error{ErrorCode::kBadFile,
                 Cat("tensor \"", Printable(entry.name), "\" ", entry.ShapeText(), " does not fit into memory")};
  }
  return out;
}

// out[i] = convert(element i) for all elements.
template <typename Stored, typename T, typename Convert>
void ConvertAll(const TensorEntry& entry, Buffer<T>& out, Convert&& convert) {
  ParallelFor(0, static_cast<int64_t>(out.size()), kTensorGrain, [&](int64_t begin, int64_t end) {
    ForElements(entry, begin, end, [&](int64_t i, const std::byte* at) {
      out[static_cast<size_t>(i)] = convert(LoadLittleEndian<Stored>(at));
    });
  });
}

template <size_t kItem>
void GatherBytes(const TensorEntry& entry, Buffer<std::byte>& out) {
  ParallelFor(0, entry.elements(), kTensorGrain, [&](int64_t begin, int64_t end) {
    ForElements(entry, begin, end, [&](int64_t i, const std::byte* at) {
      std::memcpy(out.data() + static_cast<size_t>(i) * kItem, at, kItem);
    });
  });
}

TensorEntry MakeEntryOf(std::string name, TensorType type, std::vector<int64_t> shape, const void* data) {
  TensorEntry entry;
  entry.name = std::move(name);
  entry.type = type;
  entry.strides = RowMajorStrides(shape);
  entry.shape = std::move(shape);
  entry.data = static_cast<const std::byte*>(data);
  return entry;
}

}  // namespace

int64_t ItemSize(TensorType type) { return Facts(type).size; }
const char* TypeName(TensorType type) { return Facts(type).name; }

int64_t TensorEntry::elements() const {
  int64_t count = 1;
  for (const int64_t extent : shape) count *= extent;
  return count;
}

bool TensorEntry::contiguous() const {
  int64_t expected = 1;
  for (size_t d = shape.size(); d-- > 0;) {
    if (shape[d] == 0) return true;
    if (shape[d] != 1 && strides[d] != expected) return false;
    expected *= shape[d];
  }
  return true;
}

std::string TensorEntry::ShapeText() const {
  std::string text = "[";
  for (size_t d = 0; d < shape.size(); ++d) text += (d == 0 ? "" : ", ") + std::to_string(shape[d]);
  return text + "]";
}

TensorEntry MakeEntry(std::string name, std::vector<int64_t> shape, std::span<const float> values) {
  return MakeEntryOf(std::move(name), TensorType::kFloat32, std::move(shape), values.data());
}

TensorEntry MakeEntry(std::string name, std::vector<int64_t> shape, std::span<const int64_t> values) {
  return MakeEntryOf(std::move(name), TensorType::kInt64, std::move(shape), values.data());
}

std::vector<int64_t> RowMajorStrides(std::span<const int64_t> shape) {
  std::vector<int64_t> strides(shape.size());
  int64_t stride = 1;
  for (size_t d = shape.size(); d-- > 0;) {
    strides[d] = stride;
    stride *= std::max<int64_t>(shape[d], 1);
  }
  return strides;
}

std::optional<int64_t> CountElements(std::span<const int64_t> shape) {
  // The product of non-zero dimensions must fit too, or strides of an empty tensor could overflow.
  int64_t count = 1;
  bool is_empty = false;
  for (const int64_t extent : shape) {
    if (extent < 0) return std::nullopt;
    if (extent == 0) is_empty = true;
    if (extent > 1 && count > std::numeric_limits<int64_t>::max() / 8 / extent) return std::nullopt;
    count *= std::max<int64_t>(extent, 1);
  }
  return is_empty ? 0 : count;
}

std::optional<std::span<const float>> ViewFloat32(const TensorEntry& entry) {
  if (entry.type != TensorType::kFloat32 || !entry.contiguous()) return std::nullopt;
  if (reinterpret_cast<uintptr_t>(entry.data) % alignof(float) != 0) return std::nullopt;
  return std::span(reinterpret_cast<const float*>(entry.data), static_cast<size_t>(entry.elements()));
}

Result<Buffer<float>> CopyFloat32(const TensorEntry& entry) {
  const TensorType type = entry.type;
  if (type != TensorType::kFloat32 && type != TensorType::kFloat64 && type != TensorType::kFloat16 &&
      type != TensorType::kBFloat16) {
    return Error{ErrorCode::kBadFile, Cat("tensor \"", Printable(entry.name), "\" holds ", TypeName(type),
                                          ", a floating-point type was expected")};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(Buffer<float> out, Allocate<float>(entry, entry.elements()));
  if (type == TensorType::kFloat32) {
    ConvertAll<float>(entry, out, [](float x) { return x; });
  } else if (type == TensorType::kFloat64) {
    ConvertAll<double>(entry, out, [](double x) { return static_cast<float>(x); });
  } else if (type == TensorType::kFloat16) {
    ConvertAll<uint16_t>(entry, out, FloatFromHalf);
  } else {
    ConvertAll<uint16_t>(entry, out, FloatFromBFloat16);
  }
  return out;
}

Result<Buffer<int64_t>> CopyInt64(const TensorEntry& entry) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(Buffer<int64_t> out, Allocate<int64_t>(entry, entry.elements()));
  const auto widen = [](auto x) { return static_cast<int64_t>(x); };
  switch (entry.type) {
    case TensorType::kInt64:
      ConvertAll<int64_t>(entry, out, widen);
      return out;
    case TensorType::kInt32:
      ConvertAll<int32_t>(entry, out, widen);
      return out;
    case TensorType::kInt16:
      ConvertAll<int16_t>(entry, out, widen);
      return out;
    case TensorType::kInt8:
      ConvertAll<int8_t>(entry, out, widen);
      return out;
    case TensorType::kUint64:
      ConvertAll<uint64_t>(entry, out, widen);
      if (std::any_of(out.begin(), out.end(), [](int64_t x) { return x < 0; })) break;
      return out;
    case TensorType::kUint32:
      ConvertAll<uint32_t>(entry, out, widen);
      return out;
    case TensorType::kUint16:
      ConvertAll<uint16_t>(entry, out, widen);
      return out;
    case TensorType::kUint8:
    case TensorType::kBool:
      ConvertAll<uint8_t>(entry, out, widen);
      return out;
    default:
      break;
  }
  return Error{ErrorCode::kBadFile, Cat("tensor \"", Printable(entry.name), "\" holds ", TypeName(entry.type),
                                        ", whole numbers of at most 64 bits with sign were expected")};
}

Result<Buffer<std::byte>> CopyContiguous(const TensorEntry& entry) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(Buffer<std::byte> out, Allocate<std::byte>(entry, entry.bytes()));
  if (entry.contiguous()) {
    if (!out.empty()) std::memcpy(out.data(), entry.data, out.size());
    return out;
  }
  switch (ItemSize(entry.type)) {
    case 8:
      GatherBytes<8>(entry, out);
      break;
    case 4:
      GatherBytes<4>(entry, out);
      break;
    case 2:
      GatherBytes<2>(entry, out);
      break;
    default:
      GatherBytes<1>(entry, out);
  }
  return out;
}

Status CheckFinite(std::string_view name, std::span<const float> values) {
  for (size_t block = 0; block < values.size(); block += 4096) {
    const size_t end = std::min(values.size(), block + 4096);
    // Branch-free integer code, which the compiler vectorises: every weight can be checked at start.
    bool all_finite = true;
    for (size_t i = block; i < end; ++i) {
      all_finite &= (std::bit_cast<uint32_t>(values[i]) & 0x7f800000u) != 0x7f800000u;
    }
    if (all_finite) continue;
    for (size_t i = block; i < end; ++i) {
      if (std::isfinite(values[i])) continue;
      return Error{ErrorCode::kBadFile, Cat("tensor \"", Printable(std::string(name)), "\" holds ",
                                            std::isnan(values[i]) ? "NaN" : "infinity", " at index ", i)};
    }
  }
  return {};
}

}  // namespace anchorsplat
