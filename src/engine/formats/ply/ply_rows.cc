#include "formats/ply/ply_rows.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstring>
#include <vector>

#include "core/parallel.h"
#include "core/text.h"
#include "formats/first_failure.h"

namespace anchorsplat {

namespace {

template <typename T>
T Load(const char* from, bool swap) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, from, sizeof(T));
  if (swap) std::reverse(bytes, bytes + sizeof(T));
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

bool NeedsSwap(PlyEncoding encoding) {
  return (encoding == PlyEncoding::kBigEndian) != (std::endian::native == std::endian::big);
}

// The value of a property as a double. Gaussians have floats or doubles; points and normals may have any type.
template <typename Number>
Number LoadNumber(PlyType type, const char* from, bool swap) {
  switch (type) {
    case PlyType::kInt8:
      return Load<int8_t>(from, swap);
    case PlyType::kUint8:
      return Load<uint8_t>(from, swap);
    case PlyType::kInt16:
      return Load<int16_t>(from, swap);
    case PlyType::kUint16:
      return Load<uint16_t>(from, swap);
    case PlyType::kInt32:
      return static_cast<Number>(Load<int32_t>(from, swap));
    case PlyType::kUint32:
      return static_cast<Number>(Load<uint32_t>(from, swap));
    case PlyType::kFloat:
      return static_cast<Number>(Load<float>(from, swap));
    case PlyType::kDouble:
      return static_cast<Number>(Load<double>(from, swap));
  }
  return 0;
}

// Extra values are stored little-endian, like the program's numbers.
void Store(PlyType type, const char* from, bool swap, const PlyDestination& to, int64_t row) {
  if (to.number != nullptr) {
    to.number[row * to.stride] = LoadNumber<float>(type, from, swap);
  } else if (to.wide != nullptr) {
    to.wide[row * to.stride] = LoadNumber<double>(type, from, swap);
  } else if (to.bytes != nullptr) {
    const auto size = static_cast<size_t>(PlyTypeSize(type));
    auto* const out = reinterpret_cast<char*>(to.bytes + row * to.stride);
    swap ? std::reverse_copy(from, from + size, out) : std::copy_n(from, size, out);
  }
}

// A property to read.
struct Column {
  size_t offset;  // bytes from the row's begin
  PlyType type;
  PlyDestination to;
};

std::vector<Column> Columns(const PlyElement& vertex, const std::vector<PlyDestination>& to) {
  std::vector<Column> columns;
  size_t offset = 0;
  for (size_t p = 0; p < to.size(); ++p) {
    const PlyType type = vertex.properties[p].type;
    if (!to[p].skipped()) columns.push_back({offset, type, to[p]});
    offset += static_cast<size_t>(PlyTypeSize(type));
  }
  return columns;
}

// Floats in our byte order are copied, so that NaNs keep their bits. Row by row, so that source and destination are
// accessed sequentially.
void CopyFloats(const char* rows, size_t row_size, const std::vector<Column>& columns, int64_t first, int64_t last) {
  for (int64_t i = first; i < last; ++i, rows += row_size) {
    for (const Column& c : columns) std::memcpy(c.to.number + i * c.to.stride, rows + c.offset, sizeof(float));
  }
}

void Convert(const char* rows, size_t row_size, const std::vector<Column>& columns, bool swap, int64_t first,
             int64_t last) {
  for (const Column& c : columns) {
    const char* from = rows + c.offset;
    if (c.to.number != nullptr && c.type == PlyType::kFloat) {
      float* out = c.to.number + first * c.to.stride;
      for (int64_t i = first; i < last; ++i, from += row_size, out += c.to.stride) *out = Load<float>(from, swap);
    } else {
      for (int64_t i = first; i < last; ++i, from += row_size) Store(c.type, from, swap, c.to, i);
    }
  }
}

}  // namespace

Status ReadFixedRows(const InputFile& file, const PlyElement& vertex, PlyEncoding encoding, uint64_t begin,
                     int64_t first_row, int64_t last_row, const std::vector<PlyDestination>& to) {
  const auto row_size = static_cast<size_t>(vertex.row_size());
  begin += static_cast<uint64_t>(first_row) * row_size;
  const std::vector<Column> columns = Columns(vertex, to);
  const bool swap = NeedsSwap(encoding);
  const bool copy = !swap && std::all_of(columns.begin(), columns.end(), [](const Column& c) {
    return c.type == PlyType::kFloat && c.to.number != nullptr;
  });
  // A block and its rows fit in the L2 cache together; a task has many blocks and one buffer.
  const auto block = static_cast<int64_t>(std::max<size_t>(1, (size_t{128} << 10) / row_size));
  FirstFailure failure;
  ParallelFor(0, last_row - first_row, 32 * block, [&](int64_t first, int64_t last) {
    Buffer<char> rows(static_cast<size_t>(std::min(block, last - first)) * row_size);
    for (int64_t i = first; i < last; i += block) {
      const int64_t end = std::min(last, i + block);
      const Status status = file.ReadAt(begin + static_cast<uint64_t>(i) * row_size, rows.data(),
                                        static_cast<size_t>(end - i) * row_size);
      if (!status.ok()) return failure.Report(i, status);
      if (copy) {
        CopyFloats(rows.data(), row_size, columns, i, end);
      } else {
        Convert(rows.data(), row_size, columns, swap, i, end);
      }
    }
  });
  return failure.status();
}

namespace {

// Length of the list that starts here.
Result<uint64_t> ReadListCount(SequentialReader& reader, const InputFile& file, const PlyProperty& property,
                               bool swap) {
  const uint64_t at = reader.position();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const char* bytes, reader.View(static_cast<size_t>(PlyTypeSize(*property.list_count))));
  int64_t count = 0;
  switch (*property.list_count) {
    case PlyType::kInt8:
      count = std::bit_cast<int8_t>(*bytes);
      break;
    case PlyType::kUint8:
      count = Load<uint8_t>(bytes, false);
      break;
    case PlyType::kInt16:
      count = Load<int16_t>(bytes, swap);
      break;
    case PlyType::kUint16:
      count = Load<uint16_t>(bytes, swap);
      break;
    case PlyType::kInt32:
      count = Load<int32_t>(bytes, swap);
      break;
    default:  // the header rejects float and double
      count = Load<uint32_t>(bytes, swap);
      break;
  }
  if (count < 0) {
    return Error{ErrorCode::kBadFile, Cat(file.name(), ": byte ", WithThousands(static_cast<int64_t>(at)),
                                          ": list property \"", Printable(property.name), "\" has ", count, " items")};
  }
  return static_cast<uint64_t>(count);
}

Status SkipList(SequentialReader& reader, const InputFile& file, const PlyProperty& property, bool swap) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const uint64_t count, ReadListCount(reader, file, property, swap));
  return reader.Skip(count * static_cast<uint64_t>(PlyTypeSize(property.type)));  // 2³² × 8 at most
}

}  // namespace

Status ReadRowsWithLists(SequentialReader& reader, const InputFile& file, const PlyElement& vertex,
                         PlyEncoding encoding, const std::vector<PlyDestination>& to) {
  const bool swap = NeedsSwap(encoding);
  const auto& properties = vertex.properties;
  for (int64_t i = 0; i < vertex.count; ++i) {
    for (size_t p = 0; p < properties.size(); ++p) {
      if (properties[p].list_count) {
        ANCHORSPLAT_RETURN_IF_ERROR(SkipList(reader, file, properties[p], swap));
        continue;
      }
      ANCHORSPLAT_ASSIGN_OR_RETURN(const char* bytes,
                                   reader.View(static_cast<size_t>(PlyTypeSize(properties[p].type))));
      Store(properties[p].type, bytes, swap, to[p], i);
    }
  }
  return {};
}

Status SkipRowsWithLists(SequentialReader& reader, const InputFile& file, const PlyElement& element,
                         PlyEncoding encoding) {
  const bool swap = NeedsSwap(encoding);
  for (int64_t i = 0; i < element.count; ++i) {
    for (const PlyProperty& property : element.properties) {
      ANCHORSPLAT_RETURN_IF_ERROR(property.list_count ? SkipList(reader, file, property, swap)
                                                      : reader.Skip(static_cast<uint64_t>(PlyTypeSize(property.type))));
    }
  }
  return {};
}

}  // namespace anchorsplat
