#include "gpu/choose_adapter.h"

#include <algorithm>
#include <optional>

#include "core/text.h"

namespace anchorsplat {

namespace {

int Rank(const GpuAdapter& adapter) {
  switch (adapter.type) {
    case GpuAdapter::Type::kDiscrete:
      return 0;
    case GpuAdapter::Type::kIntegrated:
      return 1;
    case GpuAdapter::Type::kUnknown:
      return 2;
    case GpuAdapter::Type::kCpu:
      break;
  }
  return 3;
}

// A card may be listed once per driver; OpenGL is the last resort for each.
bool ByOpenGl(const GpuAdapter& adapter) { return adapter.backend.starts_with("OpenGL"); }

}  // namespace

Result<size_t> ChooseAdapter(const std::vector<GpuAdapter>& adapters, const DeviceChoice& choice) {
  if (adapters.empty()) {
    return Error{ErrorCode::kNotFound,
                 "no GPU was found: WebGPU needs the card's Vulkan driver (anchorsplat doctor says more)"};
  }
  if (choice.kind == DeviceChoice::Kind::kNumber) {
    for (size_t i = 0; i < adapters.size(); ++i) {
      if (adapters[i].number != choice.number) continue;
      if (adapters[i].unusable.empty()) return i;
      return Error{ErrorCode::kNotFound, Cat("device ", choice.number, " cannot be used: ", adapters[i].unusable)};
    }
    return Error{ErrorCode::kNotFound,
                 Cat("there is no device ", choice.number, ": the adapters here are numbered from 0 to ",
                     adapters.back().number, " (anchorsplat doctor lists them)")};
  }
  std::optional<size_t> best;
  for (size_t i = 0; i < adapters.size(); ++i) {
    const GpuAdapter& adapter = adapters[i];
    if (!adapter.unusable.empty()) continue;
    if (choice.kind == DeviceChoice::Kind::kAuto && adapter.type == GpuAdapter::Type::kCpu) continue;
    if (best && Rank(adapter) > Rank(adapters[*best])) continue;
    const bool better =
        !best || Rank(adapter) < Rank(adapters[*best]) || (ByOpenGl(adapters[*best]) && !ByOpenGl(adapter));
    if (better) best = i;
  }
  if (best) return *best;
  const auto usable_software = [](const GpuAdapter& adapter) {
    return adapter.unusable.empty() && adapter.type == GpuAdapter::Type::kCpu;
  };
  if (std::ranges::any_of(adapters, usable_software)) {
    return Error{ErrorCode::kNotFound, "only software adapters were found: --device gpu uses them, auto does not"};
  }
  return Error{ErrorCode::kNotFound, "no GPU can be used (anchorsplat doctor says why)"};
}

}  // namespace anchorsplat
