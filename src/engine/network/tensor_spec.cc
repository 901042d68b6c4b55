#include "network/tensor_spec.h"

#include "core/text.h"

namespace anchorsplat {

std::string ShapeText(std::span<const int64_t> shape) {
  std::string text = "[";
  for (const int64_t d : shape) text += Cat(text.size() > 1 ? ", " : "", d);
  return text + "]";
}

}  // namespace anchorsplat
