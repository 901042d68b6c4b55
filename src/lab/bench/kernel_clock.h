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

// Total time of one kernel over all its calls.
struct KernelTime {
  std::string entry;
  int calls = 0;
  double seconds = 0;
  std::optional<double> unchecked;  // seconds without run-time checks, if measured
};

// A device that forwards to another one and waits after every kernel to time it: by the GPU's clock or, without one, by
// the host's, which includes a round trip per call. Not thread-safe.
class KernelClock final : public GpuDevice {
 public:
  explicit KernelClock(std::shared_ptr<GpuDevice> gpu) : gpu_(std::move(gpu)) {}

  void Reset() {
    times_.clear();
    by_gpu_ = true;
  }
  bool by_gpu() const { return by_gpu_; }                          // whether the GPU's clock was used
  const std::vector<KernelTime>& times() const { return times_; }  // in order of first calls

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
    // Failures are sticky; whoever reads next reports them.
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
