#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "core/result.h"

namespace anchorsplat {

// A GPU as one of its drivers describes it.
struct GpuAdapter {
  enum class Type { kDiscrete, kIntegrated, kCpu, kUnknown };
  int number = 0;  // index in ListGpuAdapters: the N of --device N
  std::string name, driver, backend;
  Type type = Type::kUnknown;
  uint64_t max_binding = 0;           // bytes of a buffer visible to a kernel
  uint64_t max_buffer = 0;            // bytes
  uint32_t max_storage_buffers = 0;   // per kernel
  uint32_t max_workgroup_memory = 0;  // bytes
  bool timestamps = false;            // GPU timestamps are available
  std::string unusable;               // why no device can be opened, in one sentence; empty: usable
};

// GPU memory. Freed after destruction, once the work recorded with it is done.
class GpuBuffer {
 public:
  virtual ~GpuBuffer() = default;
  uint64_t bytes() const { return bytes_; }

 protected:
  explicit GpuBuffer(uint64_t bytes) : bytes_(bytes) {}

 private:
  uint64_t bytes_;
};
using GpuMemory = std::unique_ptr<GpuBuffer>;

// A compute shader. Objects must be constants that live as long as the program: devices cache compiled kernels by
// address.
struct GpuKernel {
  std::string_view entry;                   // entry point; also the name in messages and timings
  std::array<std::string_view, 4> sources;  // WGSL, concatenated
};

// A buffer bound at `@group(0) @binding(index)`.
struct GpuBinding {
  uint32_t index;  // ≥ 1; 0 is for parameters
  const GpuBuffer* buffer;
  uint64_t offset = 0;  // bytes, a multiple of 256
  uint64_t bytes = 0;   // 0: to the end
};

// A transfer from the GPU.
struct GpuRead {
  const GpuBuffer* buffer;
  uint64_t offset;          // bytes, a multiple of 4
  std::span<std::byte> to;  // a multiple of 4 bytes
};

// Records work for a GPU and executes it in the order of the calls. Thread-safe; the calls of one thread keep their
// order.
//
// Failures are sticky: after the first (a kernel that does not compile, a lost device, memory refused by the driver),
// recorded work is discarded, and Read and Wait return the error. Callers need to check only there.
class GpuDevice {
 public:
  virtual ~GpuDevice() = default;

  virtual const GpuAdapter& adapter() const = 0;

  // Allocates `bytes` > 0, rounded up to a multiple of 256, zeroed. `what`: a few words for messages. Errors, not
  // sticky as smaller requests may succeed: more than the adapter's max_buffer; more than the run's --max-gpu-memory in
  // total (core/run_context.h); refused by the driver.
  virtual Result<GpuMemory> Allocate(uint64_t bytes, std::string_view what) = 0;

  // Offsets and sizes are multiples of 4. `data` is copied before the call returns.
  virtual void Write(const GpuBuffer& buffer, uint64_t offset, std::span<const std::byte> data) = 0;
  virtual void Clear(const GpuBuffer& buffer, uint64_t offset, uint64_t bytes) = 0;  // to 0
  // The buffers must differ: WebGPU cannot copy within one.
  virtual void Copy(const GpuBuffer& from, uint64_t from_offset, const GpuBuffer& to, uint64_t to_offset,
                    uint64_t bytes) = 0;

  // Dispatches `groups` workgroups (0: none). More than 65,535 are arranged in rows, so kernels get their index from
  // GroupNumber() of gpu/prelude.wgsl, which is prepended to every kernel. Kernels must ignore indices beyond the
  // expected range, as the last row may be longer than needed. `parameters` (≤ 256 bytes) is the kernel's `@group(0)
  // @binding(0) var<uniform>`; empty: none. Do not pass bindings that the entry point does not use.
  virtual void Run(const GpuKernel& kernel, std::span<const std::byte> parameters,
                   std::initializer_list<GpuBinding> bindings, uint32_t groups) = 0;

  // Run alone, and wait: seconds by the GPU's clock. None without timestamps (GpuAdapter::timestamps) or after a
  // failure.
  virtual std::optional<double> RunTimed(const GpuKernel& kernel, std::span<const std::byte> parameters,
                                         std::initializer_list<GpuBinding> bindings, uint32_t groups) = 0;

  // Submits recorded work, so that the GPU starts while more is recorded. Also happens automatically from time to time.
  virtual void Submit() = 0;

  // Submits all recorded work, waits for it, and returns the first failure.
  virtual Status Read(std::span<const GpuRead> reads) = 0;
  virtual Status Wait() = 0;

  // Seconds spent in the calls above since the device was opened: recording, transfers and waiting.
  virtual double seconds() const = 0;
  // Number of waits for the GPU since then.
  virtual int64_t waits() const = 0;
};

// Grows `memory` to at least `bytes`, visible in one binding; contents are lost when it grows. Errors: larger than a
// binding or buffer of the device (kIo); those of GpuDevice::Allocate.
Status EnsureGpuMemory(GpuDevice& device, GpuMemory& memory, uint64_t bytes, std::string_view what);

// Workgroup size of kernels with one thread per item, and the number of workgroups for `threads` items.
inline constexpr uint32_t kGpuWorkgroupSize = 256;
inline constexpr uint32_t GpuWorkgroups(uint64_t threads) {
  return static_cast<uint32_t>((threads + kGpuWorkgroupSize - 1) / kGpuWorkgroupSize);
}

// Bytes of a parameter struct, laid out as in WGSL (vec3 and vec4 at multiples of 16 bytes).
template <typename T>
std::span<const std::byte> AsParameters(const T& parameters) {
  static_assert(sizeof(T) <= 256 && std::is_trivially_copyable_v<T>);
  return std::as_bytes(std::span(&parameters, 1));
}

}  // namespace anchorsplat
