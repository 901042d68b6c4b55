#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <unordered_set>
#include <utility>

#include "core/text.h"
#include "io/little_endian.h"
#include "tensors/safetensors.h"

namespace anchorsplat {

namespace {

using nlohmann::json;

constexpr uint64_t kMaxHeaderBytes = 100'000'000;  // limit of the reference reader
constexpr size_t kMaxRank = 32;

struct DtypeName {
  std::string_view name;
  TensorType type;
};
constexpr DtypeName kDtypes[] = {
    {"F64", TensorType::kFloat64},   {"F32", TensorType::kFloat32}, {"F16", TensorType::kFloat16},
    {"BF16", TensorType::kBFloat16}, {"I64", TensorType::kInt64},   {"I32", TensorType::kInt32},
    {"I16", TensorType::kInt16},     {"I8", TensorType::kInt8},     {"U64", TensorType::kUint64},
    {"U32", TensorType::kUint32},    {"U16", TensorType::kUint16},  {"U8", TensorType::kUint8},
    {"BOOL", TensorType::kBool},
};

// One member of the JSON header.
struct HeaderTensor {
  std::string name;
  std::optional<TensorType> type;
  std::optional<std::vector<int64_t>> shape;
  std::optional<std::vector<int64_t>> data_offsets;
};

// Parses the header with SAX callbacks, so that memory grows with the number of tensors, not with hostile nesting.
// Depth and the last key determine what is expected:
// {"name": {"dtype": "F32", "shape": [..], "data_offsets": [b, e]}, "__metadata__": {"key": "text"}}.
class HeaderHandler : public nlohmann::json_sax<json> {
 public:
  std::vector<HeaderTensor> tensors;
  std::map<std::string, std::string> metadata;
  std::string problem;  // why a callback returned false
  size_t problem_at = 0;

  bool null() override { return Wrong("null"); }
  bool boolean(bool) override { return Wrong("true or false"); }
  bool number_float(number_float_t, const string_t&) override { return Wrong("a fraction"); }
  bool binary(binary_t&) override { return Wrong("binary data"); }
  bool number_integer(number_integer_t) override { return Wrong("a negative number"); }
  bool number_unsigned(number_unsigned_t value) override {
    if (list_ == nullptr || value > static_cast<uint64_t>(std::numeric_limits<int64_t>::max())) {
      return Wrong("a number");
    }
    if (list_->size() >= kMaxRank) return Fail(Cat("a list of more than ", kMaxRank, " numbers"));
    list_->push_back(static_cast<int64_t>(value));
    return true;
  }
  bool string(string_t& text) override {
    if (depth_ == 2 && in_metadata_) {
      metadata.emplace(key_, std::move(text));
      return true;
    }
    if (depth_ != 2 || list_ != nullptr || key_ != "dtype") return Wrong("text");
    for (const DtypeName& dtype : kDtypes) {
      if (dtype.name != text) continue;
      tensors.back().type = dtype.type;
      return true;
    }
    return Fail(Cat("tensor \"", Printable(tensors.back().name), "\" has the unknown dtype \"", Printable(text), "\""));
  }
  bool start_object(std::size_t) override {
    if (depth_ >= 2 || list_ != nullptr) return Wrong("an object");
    if (depth_ == 1) {
      members_.clear();
      in_metadata_ = key_ == "__metadata__";
      if (!in_metadata_) tensors.push_back({key_, {}, {}, {}});
    }
    ++depth_;
    return true;
  }
  bool key(string_t& text) override {
    key_ = std::move(text);
    if (!(depth_ == 1 ? names_ : members_).insert(key_).second) {
      return Fail(Cat("the member \"", Printable(key_), "\" stands there twice"));
    }
    return true;
  }
  bool end_object() override {
    --depth_;
    if (depth_ != 1 || in_metadata_) {
      in_metadata_ = false;
      return true;
    }
    const HeaderTensor& tensor = tensors.back();
    if (tensor.type && tensor.shape && tensor.data_offsets && tensor.data_offsets->size() == 2) return true;
    return Fail(Cat("tensor \"", Printable(tensor.name), "\" needs dtype, shape and two data_offsets"));
  }
  bool start_array(std::size_t) override {
    if (depth_ != 2 || in_metadata_ || list_ != nullptr || (key_ != "shape" && key_ != "data_offsets")) {
      return Wrong("a list");
    }
    auto& list = key_ == "shape" ? tensors.back().shape : tensors.back().data_offsets;
    list_ = &list.emplace();
    return true;
  }
  bool end_array() override {
    list_ = nullptr;
    return true;
  }
  bool parse_error(std::size_t position, const std::string&, const nlohmann::detail::exception&) override {
    problem_at = position;
    return Fail("broken JSON");
  }

 private:
  bool Fail(const std::string& what) {
    problem = what;
    return false;
  }
  bool Wrong(const char* what) { return Fail(Cat(what, " where \"", Printable(key_), "\" cannot have it")); }

  int depth_ = 0;
  bool in_metadata_ = false;
  std::string key_;
  std::unordered_set<std::string> names_;
  std::unordered_set<std::string> members_;
  std::vector<int64_t>* list_ = nullptr;  // the list being read
};

}  // namespace

bool LooksLikeSafetensors(std::span<const std::byte> beginning) {
  if (beginning.size() < 9 || beginning[8] != std::byte{'{'}) return false;
  return LoadLittleEndian<uint64_t>(beginning.data()) <= kMaxHeaderBytes;
}

Result<TensorFileContents> ReadSafetensors(std::span<const std::byte> bytes, const std::string& file) {
  const auto bad = [&](const std::string& what) { return Error{ErrorCode::kBadFile, Cat(file, ": ", what)}; };
  if (!LooksLikeSafetensors(bytes)) return bad("is not a safetensors file");
  const auto header_bytes = LoadLittleEndian<uint64_t>(bytes.data());
  if (header_bytes > bytes.size() - 8) {
    return bad(Cat("is cut off: its header has ", header_bytes, " bytes, the file ", bytes.size()));
  }
  const char* text = reinterpret_cast<const char*>(bytes.data()) + 8;
  HeaderHandler header;
  if (!json::sax_parse(text, text + header_bytes, &header)) {
    const std::string at =
        header.problem_at == 0 ? "" : Cat("byte ", WithThousands(static_cast<int64_t>(8 + header.problem_at)), ": ");
    return bad(Cat(at, "safetensors header: ", header.problem));
  }

  const std::span<const std::byte> data = bytes.subspan(8 + static_cast<size_t>(header_bytes));
  TensorFileContents contents;
  contents.metadata = std::move(header.metadata);
  std::vector<std::pair<int64_t, int64_t>> ranges;
  for (HeaderTensor& tensor : header.tensors) {
    TensorEntry entry;
    entry.name = std::move(tensor.name);
    entry.type = *tensor.type;
    entry.shape = *std::move(tensor.shape);
    const int64_t begin = (*tensor.data_offsets)[0];
    const int64_t end = (*tensor.data_offsets)[1];
    const auto bad_tensor = [&](const std::string& what) {
      return bad(Cat("tensor \"", Printable(entry.name), "\" ", entry.ShapeText(), " ", what));
    };
    if (begin > end || static_cast<uint64_t>(end) > data.size()) {
      return bad_tensor(Cat("lies at bytes ", begin, " to ", end, " of the ", data.size(),
                            " after the header: the file is cut off or damaged"));
    }
    const std::optional<int64_t> elements = CountElements(entry.shape);
    if (!elements || *elements * ItemSize(entry.type) != end - begin) {
      return bad_tensor(Cat("of ", TypeName(entry.type), " has ", end - begin, " bytes of data, which do not fit it"));
    }
    entry.strides = RowMajorStrides(entry.shape);
    entry.data = data.data() + begin;
    ranges.emplace_back(begin, end);
    contents.tensors.push_back(std::move(entry));
  }
  // The format requires tensors to tile the data; bytes in no tensor could hide anything.
  std::sort(ranges.begin(), ranges.end());
  int64_t expected = 0;
  for (const auto& [begin, end] : ranges) {
    if (begin != expected) return bad(Cat("tensors overlap or leave a hole at byte ", expected, " after the header"));
    expected = end;
  }
  if (static_cast<uint64_t>(expected) != data.size()) {
    return bad(Cat("has ", data.size() - static_cast<uint64_t>(expected), " bytes after its last tensor"));
  }
  return contents;
}

}  // namespace anchorsplat
