#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>
#include <unordered_set>

#include "core/text.h"
#include "core/utf8.h"
#include "io/atomic_file.h"
#include "tensors/safetensors.h"

namespace anchorsplat {

namespace {

constexpr size_t kAlignment = 64;

const char* DtypeOf(TensorType type) {
  switch (type) {
    case TensorType::kFloat64:
      return "F64";
    case TensorType::kFloat32:
      return "F32";
    case TensorType::kFloat16:
      return "F16";
    case TensorType::kBFloat16:
      return "BF16";
    case TensorType::kInt64:
      return "I64";
    case TensorType::kInt32:
      return "I32";
    case TensorType::kInt16:
      return "I16";
    case TensorType::kInt8:
      return "I8";
    case TensorType::kUint64:
      return "U64";
    case TensorType::kUint32:
      return "U32";
    case TensorType::kUint16:
      return "U16";
    case TensorType::kUint8:
      return "U8";
    case TensorType::kBool:
      return "BOOL";
  }
  return "";
}

Error BadArgument(const std::filesystem::path& path, const std::string& what) {
  return {ErrorCode::kBadArgument, Cat(path.string(), ": cannot be written: ", what)};
}

Status Check(const std::filesystem::path& path, std::span<const TensorEntry> tensors,
             const std::map<std::string, std::string>& metadata) {
  std::unordered_set<std::string_view> names;
  for (const TensorEntry& tensor : tensors) {
    const std::string quoted = Cat("tensor \"", Printable(tensor.name), "\" ");
    if (!IsUtf8(tensor.name)) return BadArgument(path, quoted + "has a name that is not UTF-8");
    if (tensor.name == "__metadata__") return BadArgument(path, quoted + "has the name that safetensors reserves");
    if (!names.insert(tensor.name).second) return BadArgument(path, quoted + "is there twice");
    if (!CountElements(tensor.shape)) return BadArgument(path, quoted + "has an impossible shape");
  }
  for (const auto& [key, value] : metadata) {
    if (!IsUtf8(key) || !IsUtf8(value)) return BadArgument(path, Cat("metadata \"", Printable(key), "\" is not UTF-8"));
  }
  return {};
}

}  // namespace

Status WriteSafetensors(const std::filesystem::path& path, std::span<const TensorEntry> tensors,
                        const std::map<std::string, std::string>& metadata, const WriteOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(Check(path, tensors, metadata));

  // Sorted by decreasing element size, each tensor starts at a multiple of its element size.
  std::vector<size_t> layout(tensors.size());
  std::iota(layout.begin(), layout.end(), size_t{0});
  std::stable_sort(layout.begin(), layout.end(),
                   [&](size_t a, size_t b) { return ItemSize(tensors[a].type) > ItemSize(tensors[b].type); });
  std::vector<int64_t> begins(tensors.size());
  int64_t size = 0;
  for (const size_t i : layout) {
    begins[i] = size;
    if (__builtin_add_overflow(size, tensors[i].bytes(), &size)) return BadArgument(path, "the tensors are too large");
  }

  const auto quoted = [](const std::string& name) { return nlohmann::json(name).dump(); };
  std::string text = "{";
  if (!metadata.empty()) text += "\"__metadata__\":" + nlohmann::json(metadata).dump();
  for (size_t i = 0; i < tensors.size(); ++i) {
    if (text.size() > 1) text += ',';
    text += Cat(quoted(tensors[i].name), ":{\"dtype\":\"", DtypeOf(tensors[i].type),
                "\",\"shape\":", nlohmann::json(tensors[i].shape).dump(), ",\"data_offsets\":[", begins[i], ",",
                begins[i] + tensors[i].bytes(), "]}");
  }
  text += '}';
  text.resize((8 + text.size() + kAlignment - 1) / kAlignment * kAlignment - 8, ' ');
  const uint64_t length = text.size();

  ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, options.overwrite));
  ANCHORSPLAT_RETURN_IF_ERROR(file.Reserve(8 + length + static_cast<uint64_t>(size)));
  ANCHORSPLAT_RETURN_IF_ERROR(file.Write(&length, sizeof length));
  ANCHORSPLAT_RETURN_IF_ERROR(file.Write(text));
  for (const size_t i : layout) {
    if (tensors[i].contiguous()) {
      ANCHORSPLAT_RETURN_IF_ERROR(file.Write(tensors[i].data, static_cast<size_t>(tensors[i].bytes())));
    } else {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const Buffer<std::byte> copy, CopyContiguous(tensors[i]));
      ANCHORSPLAT_RETURN_IF_ERROR(file.Write(copy.data(), copy.size()));
    }
  }
  return file.Commit();
}

}  // namespace anchorsplat
