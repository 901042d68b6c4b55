#pragma once

#include <algorithm>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/stopwatch.h"
#include "gpu/device.h"

namespace anchorsplat {

// What one kernel took, of all its calls.
struct KernelTime {
  std::string entry;
  int calls = 0;
  double seconds = 0;
  std::optional<double> unchecked;  // seconds of the same without checks at run time; for those who measure it
};

// A device that waits for every kernel, in front of one that does not, and so knows what each of them takes: by the
// GPU's clock or, where that has none, by the host's, which counts a round trip to the device with each call. Buffers
// are the other's. For one thread.
class KernelClock final : public GpuDevice {
 public:
  explicit KernelClock(std::shared_ptr<GpuDevice> gpu) : gpu_(std::move(gpu)) {}

  void Reset() {
    times_.clear();
    by_gpu_ = true;
  }
  bool by_gpu() const { return by_gpu_; }                          // the clock
  const std::vector<KernelTime>& times() const { return times_; }  // in the order of the first calls

  const GpuAdapter& adapter() const override { return gpu_->adapter(); }
  Result<GpuMemory> Allocate(uint64_t bytes, std::string_view what) override { return gpu_->Allocate(bytes, what); }
  void Write(const GpuBuffer& buffer, uint64_t offset, std::span<const std::byte> data) override {
    gpu_->Write(buffer, offset, data);
  }
  void Clear(const GpuBuffer& buffer, uint64_t offset, uint64_t bytes) override { gpu_->Clear(buffer, offset, bytes); }
  void Copy(const GpuBuffer& from, uint64_t from_offset, const GpuBuffer& to, uint64_t to_offset,
            uint64_t bytes) override {
    gpu_->Copy(from, from_offset, to, to_offset, bytes);
  }
  void Run(const GpuKernel& kernel, std::span<const std::byte> parameters, std::initializer_list<GpuBinding> bindings,
           uint32_t groups) override {
    // A failure sticks and is met by whoever reads.
    if (!gpu_->Wait().ok()) return;
    Stopwatch watch;
    const std::optional<double> of_gpu = gpu_->RunTimed(kernel, parameters, bindings, groups);
    const double seconds = of_gpu.value_or(watch.Lap());
    if (!gpu_->Wait().ok() || groups == 0) return;
    by_gpu_ = by_gpu_ && of_gpu.has_value();
    auto time = std::ranges::find(times_, kernel.entry, &KernelTime::entry);
    if (time == times_.end()) time = times_.insert(time, KernelTime{std::string(kernel.entry), 0, 0, std::nullopt});
    ++time->calls;
    time->seconds += seconds;
  }
  std::optional<double> RunTimed(const GpuKernel& kernel, std::span<const std::byte> parameters,
                                 std::initializer_list<GpuBinding> bindings, uint32_t groups) override {
    return gpu_->RunTimed(kernel, parameters, bindings, groups);
  }
  void Submit() override { gpu_->Submit(); }
  Status Read(std::span<const GpuRead> reads) override { return gpu_->Read(reads); }
  Status Wait() override { return gpu_->Wait(); }
  double seconds() const override { return gpu_->seconds(); }
  int64_t waits() const override { return gpu_->waits(); }

 private:
  std::shared_ptr<GpuDevice> gpu_;
  std::vector<KernelTime> times_;
  bool by_gpu_ = true;
};

}  // namespace anchorsplat
