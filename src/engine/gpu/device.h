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

// One way to a GPU, as its driver describes it.
struct GpuAdapter {
  enum class Type { kDiscrete, kIntegrated, kCpu, kUnknown };
  int number = 0;  // in the order of ListGpuAdapters: the N of --device N
  std::string name, driver, backend;
  Type type = Type::kUnknown;
  uint64_t max_binding = 0;           // bytes of one buffer that a kernel sees
  uint64_t max_buffer = 0;            // bytes
  uint32_t max_storage_buffers = 0;   // of one kernel
  uint32_t max_workgroup_memory = 0;  // bytes
  bool timestamps = false;            // the device can say how long it worked
  std::string unusable;               // one sentence why no device is opened on it; empty: it can be used
};

// Memory on the GPU. Given back when it is destroyed, once the work that was recorded with it is done.
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

// A compute shader. Objects are constants that live as long as the program: a device keeps what it has compiled under
// the object's address.
struct GpuKernel {
  std::string_view entry;                   // name of the entry point; also what messages and times call it
  std::array<std::string_view, 4> sources;  // WGSL, put together in this order
};

// What stands behind `@group(0) @binding(index)`.
struct GpuBinding {
  uint32_t index;  // from 1: 0 is the kernel's parameters
  const GpuBuffer* buffer;
  uint64_t offset = 0;  // bytes, a multiple of 256
  uint64_t bytes = 0;   // 0: to the end of the buffer
};

// Bytes that come back from the GPU.
struct GpuRead {
  const GpuBuffer* buffer;
  uint64_t offset;          // bytes, a multiple of 4
  std::span<std::byte> to;  // a multiple of 4 bytes
};

// Work for a GPU, recorded in the order of the calls and done in that order. Any thread may call; the calls of one
// thread keep their order.
//
// Failures stick: after the first one (a kernel that does not compile, a lost device, memory that the driver refuses)
// everything that is recorded goes nowhere, and Read and Wait return the error. Who records has to look only there.
class GpuDevice {
 public:
  virtual ~GpuDevice() = default;

  virtual const GpuAdapter& adapter() const = 0;

  // `bytes` > 0 of memory, rounded up to a multiple of 256, all 0. `what` is a few words for the message. Errors: more
  // than the adapter's max_buffer; more than the run's --max-gpu-memory in all (core/run_context.h); refused by the
  // driver. These do not stick: less may still be had.
  virtual Result<GpuMemory> Allocate(uint64_t bytes, std::string_view what) = 0;

  // Offsets and sizes are multiples of 4. The data are copied before the call returns.
  virtual void Write(const GpuBuffer& buffer, uint64_t offset, std::span<const std::byte> data) = 0;
  virtual void Clear(const GpuBuffer& buffer, uint64_t offset, uint64_t bytes) = 0;  // to 0
  // Between two buffers; WebGPU has no copy within one.
  virtual void Copy(const GpuBuffer& from, uint64_t from_offset, const GpuBuffer& to, uint64_t to_offset,
                    uint64_t bytes) = 0;

  // `groups` workgroups of the kernel, none if 0. More than 65,535 are arranged in rows: the kernel's number is
  // GroupNumber() of gpu/prelude.wgsl, which every kernel is compiled with, and a kernel must do nothing
  // where that is not below what it expects, as the last row may be longer than needed. `parameters` (at most 256
  // bytes) are what the kernel declares as `@group(0) @binding(0) var<uniform>`; none if empty. Bindings that the entry
  // point does not use must not be given.
  virtual void Run(const GpuKernel& kernel, std::span<const std::byte> parameters,
                   std::initializer_list<GpuBinding> bindings, uint32_t groups) = 0;

  // Run, alone and waited for: the seconds it took by the GPU's own clock. None where it has none
  // (GpuAdapter::timestamps) or has failed.
  virtual std::optional<double> RunTimed(const GpuKernel& kernel, std::span<const std::byte> parameters,
                                         std::initializer_list<GpuBinding> bindings, uint32_t groups) = 0;

  // Hands over what was recorded so far, so that the GPU works while more is recorded. Recorded work is also handed
  // over by itself from time to time.
  virtual void Submit() = 0;

  // Does all that was recorded and waits for it.
  virtual Status Read(std::span<const GpuRead> reads) = 0;
  virtual Status Wait() = 0;

  // Seconds that callers spent in the calls above since the device was opened: recording, transfers, and waiting for
  // the GPU.
  virtual double seconds() const = 0;
  // How often a call has waited for the GPU since then.
  virtual int64_t waits() const = 0;
};

// Makes `memory` hold at least `bytes` that one binding can see. What was in it is lost where it grows. Errors: more
// than a binding or a buffer of the device has (kIo); those of GpuDevice::Allocate.
Status GpuRoom(GpuDevice& device, GpuMemory& memory, uint64_t bytes, std::string_view what);

// Threads of a workgroup of all kernels in which each thread sees to one thing, and how many such workgroups it takes.
inline constexpr uint32_t kGpuGroup = 256;
inline constexpr uint32_t GpuGroups(uint64_t threads) {
  return static_cast<uint32_t>((threads + kGpuGroup - 1) / kGpuGroup);
}

// Parameters of a kernel: a struct laid out as WGSL does (vec3 and vec4 at multiples of 16 bytes).
template <typename T>
std::span<const std::byte> AsParameters(const T& parameters) {
  static_assert(sizeof(T) <= 256 && std::is_trivially_copyable_v<T>);
  return std::as_bytes(std::span(&parameters, 1));
}

}  // namespace anchorsplat
