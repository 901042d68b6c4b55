#include "gpu/device.h"

#include <algorithm>
#include <utility>

#include "core/text.h"

namespace anchorsplat {

Status EnsureGpuMemory(GpuDevice& device, GpuMemory& memory, uint64_t bytes, std::string_view what) {
  bytes = std::max<uint64_t>(bytes, 4);
  if (memory != nullptr && memory->bytes() >= bytes) return {};
  const GpuAdapter& adapter = device.adapter();
  const uint64_t largest = std::min(adapter.max_binding, adapter.max_buffer) / 256 * 256;
  if (bytes > largest) {
    return Error{ErrorCode::kIo,
                 Cat(what, " would take ", WithThousands(static_cast<int64_t>(bytes)),
                     " bytes in one piece, and the GPU allows ", WithThousands(static_cast<int64_t>(largest)))};
  }
  memory.reset();  // free first: there may be no room for both
  Result<GpuMemory> made = device.Allocate(std::min(largest, bytes + bytes / 8), what);
  if (!made.ok()) made = device.Allocate(bytes, what);
  if (!made.ok()) return made.error();
  memory = std::move(made).value();
  return {};
}

}  // namespace anchorsplat
