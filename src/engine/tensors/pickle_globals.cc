#include "tensors/pickle_globals.h"

namespace anchorsplat {

namespace {

constexpr PickleGlobal kAllowed[] = {
    {"collections", "OrderedDict", PickleRole::kOrderedDict},
    {"numpy", "dtype", PickleRole::kNumpy},
    {"numpy.core.multiarray", "scalar", PickleRole::kNumpy},
    {"numpy._core.multiarray", "scalar", PickleRole::kNumpy},
    {"_codecs", "encode", PickleRole::kNumpy},  // of bytes in protocol 2
    {"torch._utils", "_rebuild_tensor_v2", PickleRole::kRebuildTensorV2},
    {"torch._utils", "_rebuild_tensor_v3", PickleRole::kRebuildTensorV3},
    {"torch._utils", "_rebuild_parameter", PickleRole::kRebuildParameter},
    {"torch.storage", "UntypedStorage", PickleRole::kUntypedStorage},
    {"torch", "DoubleStorage", PickleRole::kStorageType, TensorType::kFloat64},
    {"torch", "FloatStorage", PickleRole::kStorageType, TensorType::kFloat32},
    {"torch", "HalfStorage", PickleRole::kStorageType, TensorType::kFloat16},
    {"torch", "BFloat16Storage", PickleRole::kStorageType, TensorType::kBFloat16},
    {"torch", "LongStorage", PickleRole::kStorageType, TensorType::kInt64},
    {"torch", "IntStorage", PickleRole::kStorageType, TensorType::kInt32},
    {"torch", "ShortStorage", PickleRole::kStorageType, TensorType::kInt16},
    {"torch", "CharStorage", PickleRole::kStorageType, TensorType::kInt8},
    {"torch", "ByteStorage", PickleRole::kStorageType, TensorType::kUint8},
    {"torch", "BoolStorage", PickleRole::kStorageType, TensorType::kBool},
    {"torch", "float64", PickleRole::kDtype, TensorType::kFloat64},
    {"torch", "float32", PickleRole::kDtype, TensorType::kFloat32},
    {"torch", "float16", PickleRole::kDtype, TensorType::kFloat16},
    {"torch", "bfloat16", PickleRole::kDtype, TensorType::kBFloat16},
    {"torch", "int64", PickleRole::kDtype, TensorType::kInt64},
    {"torch", "int32", PickleRole::kDtype, TensorType::kInt32},
    {"torch", "int16", PickleRole::kDtype, TensorType::kInt16},
    {"torch", "int8", PickleRole::kDtype, TensorType::kInt8},
    {"torch", "uint64", PickleRole::kDtype, TensorType::kUint64},
    {"torch", "uint32", PickleRole::kDtype, TensorType::kUint32},
    {"torch", "uint16", PickleRole::kDtype, TensorType::kUint16},
    {"torch", "uint8", PickleRole::kDtype, TensorType::kUint8},
    {"torch", "bool", PickleRole::kDtype, TensorType::kBool},
};

}  // namespace

const PickleGlobal* FindPickleGlobal(std::string_view module, std::string_view name) {
  for (const PickleGlobal& global : kAllowed) {
    if (global.module == module && global.name == name) return &global;
  }
  return nullptr;
}

}  // namespace anchorsplat
