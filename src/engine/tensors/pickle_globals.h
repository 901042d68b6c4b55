#pragma once

#include <string_view>

#include "tensors/tensor_entry.h"

namespace anchorsplat {

enum class PickleRole {
  kOrderedDict,
  kRebuildTensorV2,
  kRebuildTensorV3,
  kRebuildParameter,
  kStorageType,
  kUntypedStorage,
  kDtype,
  kNumpy,  // gives a PickleKind::kNumpy
};

// A Python name allowed in checkpoints. None is imported or called: each stands for a form of data.
struct PickleGlobal {
  std::string_view module;
  std::string_view name;
  PickleRole role;
  TensorType type = TensorType::kUint8;  // of storage types and dtypes
};

// The entry of an allowed name, or null.
const PickleGlobal* FindPickleGlobal(std::string_view module, std::string_view name);

}  // namespace anchorsplat
