#include "tensors/pickle.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "core/text.h"
#include "core/utf8.h"
#include "io/little_endian.h"
#include "tensors/pickle_globals.h"

namespace anchorsplat {

namespace {

// Bounds on the memory of hostile pickles. A checkpoint of 541 tensors has a pickle of 0.1 MB and 10,000 values.
constexpr size_t kMaxPickleBytes = size_t{32} << 20;
constexpr size_t kMaxPickleValues = size_t{1} << 20;  // also bounds stack entries and marks
constexpr size_t kMaxTensors = size_t{1} << 17;
constexpr size_t kMaxArguments = 8;

// Pickle's stack machine; opcodes as in Python's pickletools.
class PickleMachine {
 public:
  PickleMachine(std::span<const std::byte> bytes, const std::string& where, size_t base)
      : bytes_(bytes.first(std::min(bytes.size(), kMaxPickleBytes))), where_(where), base_(base) {}

  Result<PickleDocument> Run() {
    for (bool stopped = false; !stopped;) {
      opcode_at_ = at_;
      if (at_ >= bytes_.size()) return Bad("the pickle is cut off, or longer than 32 MiB");
      const auto opcode = static_cast<uint8_t>(bytes_[at_++]);
      stopped = opcode == '.';
      if (!stopped) ANCHORSPLAT_RETURN_IF_ERROR(Step(opcode));
      if (std::max({document_.values.size(), stack_.size(), marks_.size()}) > kMaxPickleValues) {
        return Bad(Cat("the pickle makes more than ", kMaxPickleValues, " values"));
      }
    }
    if (Available() != 1 || !marks_.empty()) return Bad("the pickle stops with something other than one value");
    document_.root = stack_.back();
    document_.size = at_;
    return std::move(document_);
  }

 private:
  Error Bad(const std::string& what) const {
    return {ErrorCode::kBadFile,
            Cat(where_, ": byte ", WithThousands(static_cast<int64_t>(base_ + opcode_at_)), ": ", what)};
  }
  Error Underflow() const { return Bad("a pickle opcode finds too few values on the stack"); }

  // --- input ---
  bool Has(uint64_t bytes) const { return bytes <= bytes_.size() - at_; }
  template <typename T>
  Status Read(T& value) {
    if (!Has(sizeof value)) return Bad("the pickle ends within an opcode");
    value = LoadLittleEndian<T>(bytes_.data() + at_);
    at_ += sizeof value;
    return {};
  }
  Status ReadView(uint64_t length, std::string_view& view) {
    if (!Has(length)) return Bad(Cat("the pickle ends before ", length, " bytes that it promises"));
    view = {reinterpret_cast<const char*>(bytes_.data()) + at_, static_cast<size_t>(length)};
    at_ += static_cast<size_t>(length);
    return {};
  }
  Status ReadLine(std::string_view& line) {
    const auto end = std::find(bytes_.begin() + static_cast<ptrdiff_t>(at_), bytes_.end(), std::byte{'\n'});
    if (end == bytes_.end()) return Bad("the pickle ends within a name");
    ANCHORSPLAT_RETURN_IF_ERROR(ReadView(static_cast<uint64_t>(end - bytes_.begin()) - at_, line));
    ++at_;
    return {};
  }

  // --- stack ---
  // Values above the topmost mark.
  size_t Available() const { return stack_.size() - (marks_.empty() ? 0 : marks_.back()); }
  PickleValue& Value(int32_t index) { return document_.values[static_cast<size_t>(index)]; }
  PickleValue& Make(PickleKind kind, int64_t integer = 0) {
    stack_.push_back(static_cast<int32_t>(document_.values.size()));
    document_.values.emplace_back();
    document_.values.back().kind = kind;
    document_.values.back().integer = integer;
    return document_.values.back();
  }
  int32_t Pop() {
    const int32_t top = stack_.back();
    stack_.pop_back();
    return top;
  }
  std::vector<int32_t> PopLast(size_t count) {
    std::vector<int32_t> items(stack_.end() - static_cast<ptrdiff_t>(count), stack_.end());
    stack_.resize(stack_.size() - count);
    return items;
  }
  Status PopToMark(std::vector<int32_t>& items) {
    if (marks_.empty()) return Bad("a pickle opcode finds no mark on the stack");
    items = PopLast(Available());
    marks_.pop_back();
    return {};
  }
  Status MakeText(uint64_t length) {
    std::string_view text;
    ANCHORSPLAT_RETURN_IF_ERROR(ReadView(length, text));
    if (!IsUtf8(text)) return Bad("text that is not UTF-8");
    Make(PickleKind::kText).text = text;
    return {};
  }
  template <typename Length>
  Status MakeText() {
    Length length = 0;
    ANCHORSPLAT_RETURN_IF_ERROR(Read(length));
    return MakeText(uint64_t{length});
  }
  template <typename Length>
  Status MakeBytes() {
    Length length = 0;
    ANCHORSPLAT_RETURN_IF_ERROR(Read(length));
    std::string_view ignored;
    ANCHORSPLAT_RETURN_IF_ERROR(ReadView(uint64_t{length}, ignored));
    Make(PickleKind::kNumpy);
    return {};
  }
  template <typename T>
  Status MakeInt() {
    T value = 0;
    ANCHORSPLAT_RETURN_IF_ERROR(Read(value));
    Make(PickleKind::kInt, value);
    return {};
  }
  Status MakeLong(uint64_t length) {
    std::string_view digits;
    ANCHORSPLAT_RETURN_IF_ERROR(ReadView(length, digits));
    if (length > 8) {
      Make(PickleKind::kBigInt).text = digits;
      return {};
    }
    uint64_t value = length > 0 && (static_cast<uint8_t>(digits.back()) & 0x80) != 0 ? ~uint64_t{0} : 0;
    for (size_t i = digits.size(); i-- > 0;) value = value << 8 | static_cast<uint8_t>(digits[i]);
    Make(PickleKind::kInt, static_cast<int64_t>(value));
    return {};
  }
  Status MakeTuple(size_t count) {
    if (Available() < count) return Underflow();
    std::vector<int32_t> items = PopLast(count);
    Make(PickleKind::kTuple).items = std::move(items);
    return {};
  }

  // --- memo ---
  Status Remember(uint64_t slot) {
    if (Available() < 1) return Underflow();
    // Python numbers memo slots consecutively, so a slot far beyond the current values was not written by Python.
    if (slot > 2 * document_.values.size() + 16) return Bad(Cat("pickle memo slot ", slot, " is out of line"));
    if (slot >= memo_.size()) memo_.resize(static_cast<size_t>(slot) + 1, -1);
    if (memo_[static_cast<size_t>(slot)] < 0) ++memo_used_;
    memo_[static_cast<size_t>(slot)] = stack_.back();
    return {};
  }
  Status Recall(uint64_t slot) {
    if (slot >= memo_.size() || memo_[static_cast<size_t>(slot)] < 0) {
      return Bad(Cat("pickle memo slot ", slot, " is read before it is written"));
    }
    stack_.push_back(memo_[static_cast<size_t>(slot)]);
    return {};
  }
  template <typename Slot>
  Status Memo(Status (PickleMachine::*action)(uint64_t)) {
    Slot slot = 0;
    ANCHORSPLAT_RETURN_IF_ERROR(Read(slot));
    return (this->*action)(uint64_t{slot});
  }

  // --- containers ---
  // Appends items to the list, or key-value pairs to the dictionary, on top of the stack.
  Status Extend(PickleKind kind, const std::vector<int32_t>& items) {
    if (Available() < 1) return Underflow();
    PickleValue& target = Value(stack_.back());
    if (target.kind != kind) return Bad("a pickle opcode adds items to something that holds none");
    if (kind == PickleKind::kDict && items.size() % 2 != 0) return Bad("a dictionary gets a key without a value");
    target.items.insert(target.items.end(), items.begin(), items.end());
    return {};
  }
  Status ExtendByTop(PickleKind kind, size_t count) {
    if (Available() < count + 1) return Underflow();
    return Extend(kind, PopLast(count));
  }
  Status ExtendToMark(PickleKind kind) {
    std::vector<int32_t> items;
    ANCHORSPLAT_RETURN_IF_ERROR(PopToMark(items));
    return Extend(kind, items);
  }

  // --- objects ---
  Status MakeGlobal(std::string_view module, std::string_view name) {
    const PickleGlobal* global = FindPickleGlobal(module, name);
    if (global == nullptr) {
      return Bad(Cat("asks for \"", Printable(Cat(module, ".", name)),
                     "\", but only plain tensors are loaded from a checkpoint, nothing that would run code"));
    }
    globals_.push_back(global);
    Make(PickleKind::kGlobal, static_cast<int64_t>(globals_.size()) - 1);
    return {};
  }
  Status MakeStackGlobal() {
    if (Available() < 2) return Underflow();
    const PickleValue& name = Value(Pop());
    const PickleValue& module = Value(Pop());
    if (name.kind != PickleKind::kText || module.kind != PickleKind::kText) return Bad("a global without a name");
    return MakeGlobal(module.text, name.text);
  }

  const PickleGlobal* Global(int32_t index) {
    const PickleValue& value = Value(index);
    return value.kind == PickleKind::kGlobal ? globals_[static_cast<size_t>(value.integer)] : nullptr;
  }
  bool IsCount(int32_t index) { return Value(index).kind == PickleKind::kInt && Value(index).integer >= 0; }

  // ('storage', type, key, location, elements) and, in files before PyTorch 1.6, None for "not a view".
  Status MakeStorage() {
    if (Available() < 1) return Underflow();
    const PickleValue& id = Value(Pop());
    const std::vector<int32_t>& parts = id.items;
    if (id.kind != PickleKind::kTuple || parts.size() < 5 || parts.size() > 6 ||
        Value(parts[0]).kind != PickleKind::kText || Value(parts[0]).text != "storage") {
      return Bad("a persistent id that is not a tensor's storage");
    }
    const PickleGlobal* type = Global(parts[1]);
    if (type == nullptr || (type->role != PickleRole::kStorageType && type->role != PickleRole::kUntypedStorage) ||
        Value(parts[2]).kind != PickleKind::kText || !IsCount(parts[4])) {
      return Bad("a storage needs a type, a key and a number of elements");
    }
    if (parts.size() == 6 && Value(parts[5]).kind != PickleKind::kNone) {
      return Bad("a storage that is a view of another one, as only PyTorch before 0.4 wrote it");
    }
    document_.storages.push_back(
        {Value(parts[2]).text, type->type, type->role == PickleRole::kUntypedStorage, Value(parts[4]).integer});
    Make(PickleKind::kStorage, static_cast<int64_t>(document_.storages.size()) - 1);
    return {};
  }

  // A tuple of non-negative integers: a shape or strides.
  bool ReadCounts(int32_t index, std::vector<int64_t>& counts) {
    const PickleValue& tuple = Value(index);
    if (tuple.kind != PickleKind::kTuple || tuple.items.size() > kMaxTensorRank) return false;
    for (const int32_t item : tuple.items) {
      if (!IsCount(item)) return false;
      counts.push_back(Value(item).integer);
    }
    return true;
  }

  // (storage, offset, shape, strides, requires_grad, hooks, metadata?); v3 has the type before the metadata.
  Status MakeTensor(const std::vector<int32_t>& arguments, bool is_v3) {
    const size_t required = is_v3 ? 7 : 6;
    if (arguments.size() < required || arguments.size() > required + 1 ||
        Value(arguments[0]).kind != PickleKind::kStorage) {
      return Bad("a tensor without its storage, offset, shape and strides");
    }
    const PickleGlobal* dtype = is_v3 ? Global(arguments[6]) : nullptr;
    if (is_v3 && (dtype == nullptr || dtype->role != PickleRole::kDtype)) return Bad("a tensor without its type");
    if (document_.tensors.size() >= kMaxTensors)
      return Bad(Cat("the pickle holds more than ", kMaxTensors, " tensors"));
    PickleTensor tensor;
    tensor.storage = static_cast<int32_t>(Value(arguments[0]).integer);
    const PickleStorage& storage = document_.storages[static_cast<size_t>(tensor.storage)];
    tensor.type = is_v3 ? dtype->type : storage.type;
    if (!IsCount(arguments[1])) return Bad("a tensor's storage offset must be a whole number, not negative");
    tensor.offset = Value(arguments[1]).integer;
    if (!ReadCounts(arguments[2], tensor.shape) || !ReadCounts(arguments[3], tensor.strides) ||
        tensor.shape.size() != tensor.strides.size()) {
      return Bad(Cat("a tensor's shape and strides must be equally many whole numbers, none negative, at most ",
                     kMaxTensorRank));
    }
    if (arguments.size() > required) {
      // Conjugate and negative views would need other values.
      const PickleValue& metadata = Value(arguments[required]);
      if (metadata.kind != PickleKind::kNone && !(metadata.kind == PickleKind::kDict && metadata.items.empty())) {
        return Bad("a tensor with metadata (a conjugate or negative view)");
      }
    }
    document_.tensors.push_back(std::move(tensor));
    Make(PickleKind::kTensor, static_cast<int64_t>(document_.tensors.size()) - 1);
    return {};
  }

  // OrderedDict() or OrderedDict([[key, value], …]), as Python 2 wrote it.
  Status MakeOrderedDict(const std::vector<int32_t>& arguments) {
    std::vector<int32_t> items;
    if (!arguments.empty()) {
      const PickleValue& pairs = Value(arguments[0]);
      if (arguments.size() > 1 || pairs.kind != PickleKind::kList) return Bad("an OrderedDict of something else");
      // Python writes such a list once, where it is used; one reused again and again would grow without bound.
      copied_pairs_ += pairs.items.size();
      if (copied_pairs_ > kMaxPickleValues) return Bad(Cat("OrderedDicts of more than ", kMaxPickleValues, " pairs"));
      for (const int32_t index : pairs.items) {
        const PickleValue& pair = Value(index);
        if ((pair.kind != PickleKind::kList && pair.kind != PickleKind::kTuple) || pair.items.size() != 2) {
          return Bad("an OrderedDict of something other than pairs");
        }
        items.insert(items.end(), pair.items.begin(), pair.items.end());
      }
    }
    Make(PickleKind::kDict).items = std::move(items);
    return {};
  }

  Status Reduce() {
    if (Available() < 2) return Underflow();
    const int32_t arguments_index = Pop();
    const PickleGlobal* callee = Global(Pop());
    if (callee == nullptr || Value(arguments_index).kind != PickleKind::kTuple) {
      return Bad("a call of something that is not a function of the checkpoint format");
    }
    if (Value(arguments_index).items.size() > kMaxArguments) {
      return Bad(Cat("a call of \"", callee->module, ".", callee->name, "\" with too many arguments"));
    }
    const std::vector<int32_t> arguments = Value(arguments_index).items;  // copied, as Make() moves the values
    switch (callee->role) {
      case PickleRole::kOrderedDict:
        return MakeOrderedDict(arguments);
      case PickleRole::kRebuildTensorV2:
        return MakeTensor(arguments, /*is_v3=*/false);
      case PickleRole::kRebuildTensorV3:
        return MakeTensor(arguments, /*is_v3=*/true);
      case PickleRole::kRebuildParameter:
        if (arguments.empty() || Value(arguments[0]).kind != PickleKind::kTensor) {
          return Bad("a parameter without a tensor");
        }
        stack_.push_back(arguments[0]);
        return {};
      case PickleRole::kNumpy:
        Make(PickleKind::kNumpy);
        return {};
      default:
        return Bad(Cat("a call of \"", callee->module, ".", callee->name, "\""));
    }
  }

  // Attributes of an object: `_metadata` of OrderedDict (module versions, irrelevant to tensors), byte order of NumPy
  // types.
  Status Build() {
    if (Available() < 2) return Underflow();
    Pop();
    const PickleKind kind = Value(stack_.back()).kind;
    if (kind != PickleKind::kDict && kind != PickleKind::kNumpy) return Bad("attributes for something that has none");
    return {};
  }

  Status Step(uint8_t opcode) {
    switch (opcode) {
      case 0x80: {  // PROTO
        uint8_t protocol = 0;
        ANCHORSPLAT_RETURN_IF_ERROR(Read(protocol));
        if (protocol < 2 || protocol > 5) return Bad(Cat("pickle protocol ", int{protocol}, " (known are 2 to 5)"));
        return {};
      }
      case 0x95: {  // FRAME: a hint for buffering
        uint64_t length = 0;
        return Read(length);
      }
      case 'N':
        Make(PickleKind::kNone);
        return {};
      case 0x88:  // NEWTRUE
      case 0x89:  // NEWFALSE
        Make(PickleKind::kBool, opcode == 0x88 ? 1 : 0);
        return {};
      case 'J':  // BININT
        return MakeInt<int32_t>();
      case 'K':  // BININT1
        return MakeInt<uint8_t>();
      case 'M':  // BININT2
        return MakeInt<uint16_t>();
      case 0x8a: {  // LONG1
        uint8_t length = 0;
        ANCHORSPLAT_RETURN_IF_ERROR(Read(length));
        return MakeLong(length);
      }
      case 'G': {  // BINFLOAT, the one big-endian number
        uint64_t bits = 0;
        ANCHORSPLAT_RETURN_IF_ERROR(Read(bits));
        Make(PickleKind::kFloat).real = std::bit_cast<double>(__builtin_bswap64(bits));
        return {};
      }
      case 'X':  // BINUNICODE
        return MakeText<uint32_t>();
      case 0x8c:  // SHORT_BINUNICODE
      case 'U':   // SHORT_BINSTRING, text of Python 2
        return MakeText<uint8_t>();
      case 0x8d:  // BINUNICODE8
        return MakeText<uint64_t>();
      case 'T':  // BINSTRING
        return MakeText<uint32_t>();
      case 'C':  // SHORT_BINBYTES
        return MakeBytes<uint8_t>();
      case 'B':  // BINBYTES
        return MakeBytes<uint32_t>();
      case ')':  // EMPTY_TUPLE
        return MakeTuple(0);
      case 0x85:  // TUPLE1 to TUPLE3
      case 0x86:
      case 0x87:
        return MakeTuple(opcode - 0x84u);
      case 't': {  // TUPLE
        std::vector<int32_t> items;
        ANCHORSPLAT_RETURN_IF_ERROR(PopToMark(items));
        Make(PickleKind::kTuple).items = std::move(items);
        return {};
      }
      case ']':  // EMPTY_LIST
        Make(PickleKind::kList);
        return {};
      case 'a':  // APPEND
        return ExtendByTop(PickleKind::kList, 1);
      case 'e':  // APPENDS
        return ExtendToMark(PickleKind::kList);
      case '}':  // EMPTY_DICT
        Make(PickleKind::kDict);
        return {};
      case 's':  // SETITEM
        return ExtendByTop(PickleKind::kDict, 2);
      case 'u':  // SETITEMS
        return ExtendToMark(PickleKind::kDict);
      case '(':  // MARK
        marks_.push_back(stack_.size());
        return {};
      case 'q':  // BINPUT
        return Memo<uint8_t>(&PickleMachine::Remember);
      case 'r':  // LONG_BINPUT
        return Memo<uint32_t>(&PickleMachine::Remember);
      case 0x94:  // MEMOIZE
        return Remember(memo_used_);
      case 'h':  // BINGET
        return Memo<uint8_t>(&PickleMachine::Recall);
      case 'j':  // LONG_BINGET
        return Memo<uint32_t>(&PickleMachine::Recall);
      case 'c': {  // GLOBAL
        std::string_view module;
        std::string_view name;
        ANCHORSPLAT_RETURN_IF_ERROR(ReadLine(module));
        ANCHORSPLAT_RETURN_IF_ERROR(ReadLine(name));
        return MakeGlobal(module, name);
      }
      case 0x93:  // STACK_GLOBAL
        return MakeStackGlobal();
      case 'Q':  // BINPERSID
        return MakeStorage();
      case 'R':
        return Reduce();
      case 'b':
        return Build();
      default: {
        static constexpr char kDigits[] = "0123456789abcdef";
        return Bad(Cat("pickle opcode 0x", kDigits[opcode >> 4], kDigits[opcode & 15],
                       " is none that torch.save writes for tensors"));
      }
    }
  }

  std::span<const std::byte> bytes_;
  const std::string& where_;
  const size_t base_;
  size_t at_ = 0;
  size_t opcode_at_ = 0;
  PickleDocument document_;
  std::vector<int32_t> stack_;
  std::vector<size_t> marks_;  // heights of the stack
  std::vector<int32_t> memo_;  // −1 = not written
  size_t memo_used_ = 0;
  std::vector<const PickleGlobal*> globals_;
  size_t copied_pairs_ = 0;
};

}  // namespace

Result<PickleDocument> ReadPickle(std::span<const std::byte> bytes, const std::string& where, size_t base) {
  return PickleMachine(bytes, where, base).Run();
}

}  // namespace anchorsplat
