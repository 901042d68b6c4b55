#pragma once

#include <atomic>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "gpu/device.h"

namespace anchorsplat {

// Faults of a FaultyDevice; none by default.
struct GpuFaults {
  int calls = -1;            // number of Write, Clear, Copy and Run calls until the device is lost; -1: never
  int allocations = -1;      // number of successful allocations; later ones fail (not sticky); -1: all succeed
  uint64_t max_binding = 0;  // claimed max_binding in bytes, beyond which Run fails; 0: the real one
};

// Wraps a working device and injects faults. Buffers belong to the wrapped one.
class FaultyDevice final : public GpuDevice {
 public:
  FaultyDevice(std::shared_ptr<GpuDevice> gpu, const GpuFaults& faults)
      : gpu_(std::move(gpu)), adapter_(gpu_->adapter()), faults_(faults) {
    if (faults.max_binding > 0) adapter_.max_binding = faults.max_binding;
  }

  const GpuAdapter& adapter() const override { return adapter_; }
  Result<GpuMemory> Allocate(uint64_t bytes, std::string_view what) override {
    if (lost_) return Lost();
    if (allocations_++ >= faults_.allocations && faults_.allocations >= 0) {
      return Error{ErrorCode::kIo, "the GPU has no memory left (a test says so)"};
    }
    return gpu_->Allocate(bytes, what);
  }
  void Write(const GpuBuffer& buffer, uint64_t offset, std::span<const std::byte> data) override {
    bytes_written_ += static_cast<int64_t>(data.size());
    if (Works()) gpu_->Write(buffer, offset, data);
  }
  void Clear(const GpuBuffer& buffer, uint64_t offset, uint64_t bytes) override {
    if (Works()) gpu_->Clear(buffer, offset, bytes);
  }
  void Copy(const GpuBuffer& from, uint64_t from_offset, const GpuBuffer& to, uint64_t to_offset,
            uint64_t bytes) override {
    if (Works()) gpu_->Copy(from, from_offset, to, to_offset, bytes);
  }
  void Run(const GpuKernel& kernel, std::span<const std::byte> parameters, std::initializer_list<GpuBinding> bindings,
           uint32_t groups) override {
    for (const GpuBinding& binding : bindings) {
      const uint64_t bytes = binding.bytes > 0 ? binding.bytes : binding.buffer->bytes() - binding.offset;
      if (groups > 0 && bytes > adapter_.max_binding) too_large_ = lost_ = true;
    }
    if (Works()) gpu_->Run(kernel, parameters, bindings, groups);
  }
  std::optional<double> RunTimed(const GpuKernel& kernel, std::span<const std::byte> parameters,
                                 std::initializer_list<GpuBinding> bindings, uint32_t groups) override {
    return Works() ? gpu_->RunTimed(kernel, parameters, bindings, groups) : std::nullopt;
  }
  void Submit() override {
    if (!lost_) gpu_->Submit();
  }
  Status Read(std::span<const GpuRead> reads) override { return lost_ ? Status(Lost()) : gpu_->Read(reads); }
  Status Wait() override { return lost_ ? Status(Lost()) : gpu_->Wait(); }
  double seconds() const override { return gpu_->seconds(); }
  int64_t waits() const override { return gpu_->waits(); }

  // Counts so far, for tests that make each call fail in turn.
  int calls() const { return calls_; }
  int allocations() const { return allocations_; }
  int64_t bytes_written() const { return bytes_written_; }

 private:
  bool Works() {
    if (lost_) return false;
    if (calls_++ == faults_.calls) lost_ = true;
    return !lost_;
  }
  Error Lost() const {
    return {ErrorCode::kIo, too_large_ ? "a kernel is given more than the device's max_binding"
                                       : "the device was lost (a test says so)"};
  }

  std::shared_ptr<GpuDevice> gpu_;
  GpuAdapter adapter_;
  GpuFaults faults_;
  std::atomic<int> calls_ = 0, allocations_ = 0;
  std::atomic<int64_t> bytes_written_ = 0;
  std::atomic<bool> lost_ = false, too_large_ = false;
};

}  // namespace anchorsplat
