#pragma once

#include <filesystem>
#include <memory>

#include "core/result.h"
#include "model/enhance_with_model.h"

namespace anchorsplat {

// What the method "model" of enhance/enhance.h works with. Filled in (by the command line) before Enhance is called.
struct ModelMethod {
  std::filesystem::path file;  // checkpoint, .pth or .safetensors; the method is ready when it is given
  WeightPrecision precision = WeightPrecision::kFloat;
  ModelOptions options;
};

// Adds the method "model", which "auto" prefers to the filter once there is a file. The checkpoint is loaded at the
// first cloud and kept for the next.
void RegisterModelMethod(const std::shared_ptr<const ModelMethod>& method);

}  // namespace anchorsplat
