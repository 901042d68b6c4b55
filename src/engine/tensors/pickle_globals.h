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
  kNumpy,  // makes a PickleKind::kNumpy
};

// A name of Python that a checkpoint may mention. None is imported or called: each stands for a shape of data.
struct PickleGlobal {
  std::string_view module;
  std::string_view name;
  PickleRole role;
  TensorType type = TensorType::kUint8;  // of storage types and dtypes
};

// The name's entry in the list of all that is allowed, or null.
const PickleGlobal* FindPickleGlobal(std::string_view module, std::string_view name);

}  // namespace anchorsplat
