#include "tensors/torch_file.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/text.h"
#include "io/little_endian.h"
#include "io/zip_directory.h"
#include "tensors/pickle.h"

namespace anchorsplat {

namespace {

// Bounds against object graphs that refer to few bytes very often. A training checkpoint with optimiser state has some
// thousands of values, five levels deep.
constexpr int kMaxNesting = 32;
constexpr size_t kMaxVisits = size_t{1} << 18;
constexpr size_t kMaxNameBytes = 1024;
// Tensors with strides of 0 can have more elements than their storage; this many are allowed.
constexpr int64_t kMaxRepeatedElements = int64_t{1} << 20;
// Limit on all tensors together, relative to the file size: allows shared weights but no bombs.
constexpr uint64_t kMaxSharing = 16;

std::string_view Characters(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Bytes of each storage by key.
using StorageBytes = std::unordered_map<std::string_view, std::span<const std::byte>>;

// Converts the pickled object graph into named tensors and scalars.
class ContentsBuilder {
 public:
  ContentsBuilder(const PickleDocument& document, const StorageBytes& storages, size_t file_size,
                  const std::string& file)
      : document_(document),
        storages_(storages),
        bytes_allowed_(kMaxSharing * file_size + (uint64_t{64} << 20)),
        file_(file) {}

  Result<TensorFileContents> Build() {
    ANCHORSPLAT_RETURN_IF_ERROR(Visit(document_.root, "", 0));
    return std::move(contents_);
  }

 private:
  Error Bad(const std::string& what) const { return {ErrorCode::kBadFile, Cat(file_, ": ", what)}; }
  const PickleValue& Value(int32_t index) const { return document_.values[static_cast<size_t>(index)]; }

  Status Visit(int32_t index, const std::string& path, int depth) {
    if (++visits_ > kMaxVisits) return Bad(Cat("holds more than ", kMaxVisits, " values"));
    if (depth > kMaxNesting) return Bad(Cat("holds dictionaries or lists nested deeper than ", kMaxNesting));
    if (path.size() > kMaxNameBytes) return Bad(Cat("holds a name longer than ", kMaxNameBytes, " bytes"));
    const PickleValue& value = Value(index);
    switch (value.kind) {
      case PickleKind::kNone:
        return AddScalar(path, std::monostate());
      case PickleKind::kBool:
        return AddScalar(path, value.integer != 0);
      case PickleKind::kInt:
        return AddScalar(path, value.integer);
      case PickleKind::kFloat:
        return AddScalar(path, value.real);
      case PickleKind::kText:
        return AddScalar(path, std::string(value.text));
      case PickleKind::kTuple:
      case PickleKind::kList:
        for (size_t i = 0; i < value.items.size(); ++i) {
          ANCHORSPLAT_RETURN_IF_ERROR(Visit(value.items[i], Join(path, std::to_string(i)), depth + 1));
        }
        return {};
      case PickleKind::kDict:
        for (size_t i = 0; i + 1 < value.items.size(); i += 2) {
          ANCHORSPLAT_RETURN_IF_ERROR(VisitMember(value.items[i], value.items[i + 1], path, depth));
        }
        return {};
      case PickleKind::kTensor:
        return AddTensor(document_.tensors[static_cast<size_t>(value.integer)], path);
      case PickleKind::kBigInt:
      case PickleKind::kGlobal:
      case PickleKind::kStorage:
      case PickleKind::kNumpy:
        return {};  // nothing that readers of weights use
    }
    return {};
  }

  Status VisitMember(int32_t key_index, int32_t member, const std::string& path, int depth) {
    const PickleValue& key = Value(key_index);
    if (key.kind == PickleKind::kInt) return Visit(member, Join(path, std::to_string(key.integer)), depth + 1);
    if (key.kind != PickleKind::kText) {
      return Bad(Cat("the dictionary \"", Printable(path), "\" has a key that is neither text nor a whole number"));
    }
    // The usual wrapper of training scripts: {"state_dict": …, "epoch": …}.
    if (depth == 0 && key.text == "state_dict" && Value(member).kind == PickleKind::kDict) {
      return Visit(member, "", depth + 1);
    }
    return Visit(member, Join(path, std::string(key.text)), depth + 1);
  }

  static std::string Join(const std::string& path, const std::string& key) {
    return path.empty() ? key : path + "." + key;
  }

  static std::string WithoutModule(const std::string& path) {
    return path.starts_with("module.") ? path.substr(7) : path;
  }

  Status AddScalar(const std::string& path, TensorFileScalar value) {
    contents_.scalars[WithoutModule(path)] = std::move(value);
    return {};
  }

  Status AddTensor(const PickleTensor& tensor, const std::string& path) {
    TensorEntry entry;
    entry.name = WithoutModule(path);
    entry.type = tensor.type;
    entry.shape = tensor.shape;
    entry.strides = tensor.strides;
    const auto bad = [&](const std::string& what) {
      return Bad(Cat("tensor \"", Printable(entry.name), "\" ", entry.ShapeText(), " ", what));
    };

    const PickleStorage& storage = document_.storages[static_cast<size_t>(tensor.storage)];
    const auto found = storages_.find(storage.key);
    if (found == storages_.end())
      return bad(Cat("is stored nowhere (data \"", Printable(std::string(storage.key)), "\")"));
    const std::span<const std::byte> bytes = found->second;
    const auto storage_item = static_cast<uint64_t>(ItemSize(storage.type));
    if (bytes.size() % storage_item != 0 || bytes.size() / storage_item != static_cast<uint64_t>(storage.elements)) {
      return bad(Cat("needs a storage of ", storage.elements, " ", TypeName(storage.type),
                     " numbers, but the file has ", bytes.size(), " bytes for it"));
    }

    const std::optional<int64_t> elements = CountElements(tensor.shape);
    if (!elements) return bad("has too many elements");
    const auto item = static_cast<uint64_t>(ItemSize(tensor.type));
    const auto stored = static_cast<int64_t>(bytes.size() / item);
    entry.data = bytes.data();
    if (*elements > 0) {
      // The last element is the farthest, as strides are not negative. Every step is checked for overflow.
      int64_t last = tensor.offset;
      bool inside = last < stored;
      for (size_t d = 0; d < tensor.shape.size() && inside; ++d) {
        const int64_t steps = tensor.shape[d] - 1;
        inside = steps == 0 || tensor.strides[d] <= (stored - 1 - last) / steps;
        if (inside) last += steps * (steps == 0 ? 0 : tensor.strides[d]);
      }
      if (!inside) return bad(Cat("reaches outside its storage of ", stored, " numbers (offset ", tensor.offset, ")"));
      if (*elements > std::max(stored, kMaxRepeatedElements)) {
        return bad(Cat("repeats its ", stored, " stored numbers too often"));
      }
      entry.data += static_cast<uint64_t>(tensor.offset) * item;
    }
    const uint64_t size = static_cast<uint64_t>(*elements) * item;
    if (size > bytes_allowed_) return bad("shares its storage with too many others");
    bytes_allowed_ -= size;
    contents_.tensors.push_back(std::move(entry));
    return {};
  }

  const PickleDocument& document_;
  const StorageBytes& storages_;
  uint64_t bytes_allowed_;
  const std::string& file_;
  size_t visits_ = 0;
  TensorFileContents contents_;
};

bool StartsWith(std::span<const std::byte> bytes, std::string_view magic) {
  return Characters(bytes.first(std::min(bytes.size(), magic.size()))) == magic;
}

}  // namespace

bool LooksLikeTorchZip(std::span<const std::byte> beginning) {
  return StartsWith(beginning, "PK\x03\x04") || StartsWith(beginning, "PK\x05\x06");
}

bool LooksLikeTorchLegacy(std::span<const std::byte> beginning) {
  // PROTO and its version. The magic number that follows identifies PyTorch; the reader reports anything else.
  return beginning.size() >= 2 && beginning[0] == std::byte{0x80} && beginning[1] >= std::byte{2} &&
         beginning[1] <= std::byte{5};
}

Result<TensorFileContents> ReadTorchZip(std::span<const std::byte> bytes, const std::string& file) {
  const auto bad = [&](const std::string& what) { return Error{ErrorCode::kBadFile, Cat(file, ": ", what)}; };
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<ZipEntry> entries, ReadZipDirectory(bytes, file));
  for (const ZipEntry& entry : entries) {  // tensors are used in place
    if (entry.method != 0) {
      return Error{ErrorCode::kBadFile, Cat(file, ": zip entry \"", Printable(std::string(entry.name)),
                                            "\" is compressed (method ", entry.method, "), torch.save only stores")};
    }
  }

  // The root folder is named after the file as saved.
  std::string_view root;
  bool found_root = false;
  for (const ZipEntry& entry : entries) {
    const size_t slash = entry.name.find('/');
    if (slash == std::string_view::npos || entry.name.substr(slash) != "/data.pkl") continue;
    if (found_root) return bad("holds two checkpoints (two data.pkl)");
    root = entry.name.substr(0, slash + 1);
    found_root = true;
  }
  if (!found_root) return bad("is a zip archive, but no checkpoint of torch.save (no data.pkl inside)");

  std::span<const std::byte> pickle;
  StorageBytes storages;
  size_t pickle_at = 0;
  for (const ZipEntry& entry : entries) {
    if (!entry.name.starts_with(root)) continue;
    const std::string_view inner = entry.name.substr(root.size());
    if (inner == "data.pkl") {
      pickle = entry.data;
      pickle_at = static_cast<size_t>(entry.data.data() - bytes.data());
    } else if (inner == "byteorder") {
      if (Characters(entry.data) != "little")
        return bad("was saved on a big-endian machine; save it again on this one");
    } else if (inner == "constants.pkl") {
      return bad("is a TorchScript program, not a checkpoint; save its state_dict() with torch.save");
    } else if (inner.starts_with("data/")) {
      storages.emplace(inner.substr(5), entry.data);
    }
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PickleDocument document, ReadPickle(pickle, file + ": data.pkl", pickle_at));
  return ContentsBuilder(document, storages, bytes.size(), file).Build();
}

Result<TensorFileContents> ReadTorchLegacy(std::span<const std::byte> bytes, const std::string& file) {
  const auto bad = [&](size_t at, const std::string& what) {
    return Error{ErrorCode::kBadFile, Cat(file, ": byte ", WithThousands(static_cast<int64_t>(at)), ": ", what)};
  };
  size_t at = 0;
  const auto next_pickle = [&]() -> Result<PickleDocument> {
    Result<PickleDocument> document = ReadPickle(bytes.subspan(at), file, at);
    if (document.ok()) at += document->size;
    return document;
  };

  ANCHORSPLAT_ASSIGN_OR_RETURN(const PickleDocument magic, next_pickle());
  const PickleValue& number = magic.values[static_cast<size_t>(magic.root)];
  if (number.kind != PickleKind::kBigInt ||
      number.text != std::string_view("\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19", 10)) {
    return bad(0, "is a pickle, but not one of torch.save");
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PickleDocument version, next_pickle());
  const PickleValue& protocol = version.values[static_cast<size_t>(version.root)];
  if (protocol.kind != PickleKind::kInt || protocol.integer != 1001)
    return bad(at, "has an unknown version of torch.save");
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PickleDocument machine, next_pickle());
  const PickleValue& facts = machine.values[static_cast<size_t>(machine.root)];
  for (size_t i = 0; i + 1 < facts.items.size(); i += 2) {
    const PickleValue& key = machine.values[static_cast<size_t>(facts.items[i])];
    const PickleValue& value = machine.values[static_cast<size_t>(facts.items[i + 1])];
    if (key.text == "little_endian" && value.kind == PickleKind::kBool && value.integer == 0) {
      return bad(at, "was saved on a big-endian machine; save it again on this one");
    }
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PickleDocument document, next_pickle());
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PickleDocument keys, next_pickle());

  std::unordered_map<std::string_view, const PickleStorage*> known;
  for (const PickleStorage& storage : document.storages) known.emplace(storage.key, &storage);
  StorageBytes storages;
  for (const int32_t index : keys.values[static_cast<size_t>(keys.root)].items) {
    const PickleValue& key = keys.values[static_cast<size_t>(index)];
    const auto found = known.find(key.text);
    if (key.kind != PickleKind::kText || found == known.end()) {
      return bad(at, Cat("storage \"", Printable(std::string(key.text)), "\" is not one of the pickle's"));
    }
    if (bytes.size() - at < 8) return bad(at, "the file is cut off before a storage");
    const auto elements = LoadLittleEndian<uint64_t>(bytes.data() + at);
    const auto item = static_cast<uint64_t>(ItemSize(found->second->type));
    at += 8;
    if (elements > (bytes.size() - at) / item) {
      return bad(at, Cat("the file is cut off within a storage of ", elements, " numbers"));
    }
    storages[key.text] = bytes.subspan(at, static_cast<size_t>(elements * item));
    at += static_cast<size_t>(elements * item);
  }
  if (at != bytes.size()) return bad(at, "the file goes on after its last storage");
  return ContentsBuilder(document, storages, bytes.size(), file).Build();
}

}  // namespace anchorsplat
