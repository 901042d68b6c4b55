#pragma once

#include <webgpu.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "core/stopwatch.h"
#include "gpu/device.h"
#include "gpu/with_webgpu/gpu_failure.h"
#include "gpu/with_webgpu/webgpu_instance.h"

namespace anchorsplat {

// Records commands into one encoder and submits them every kRecorded commands. One mutex guards everything, including
// waits: not every library is thread-safe.
class WebGpuDevice final : public GpuDevice, public std::enable_shared_from_this<WebGpuDevice> {
 public:
  // `unchecked`: see OpenUncheckedGpu; the library must support it. Errors (kNotFound): the driver's reason.
  static Result<std::shared_ptr<WebGpuDevice>> Open(WebGpuInstance& instance, const FoundAdapter& adapter,
                                                    bool unchecked = false);
  ~WebGpuDevice() override;

  const GpuAdapter& adapter() const override { return adapter_; }
  Result<GpuMemory> Allocate(uint64_t bytes, std::string_view what) override;
  void Write(const GpuBuffer& buffer, uint64_t offset, std::span<const std::byte> data) override;
  void Clear(const GpuBuffer& buffer, uint64_t offset, uint64_t bytes) override;
  void Copy(const GpuBuffer& from, uint64_t from_offset, const GpuBuffer& to, uint64_t to_offset,
            uint64_t bytes) override;
  void Run(const GpuKernel& kernel, std::span<const std::byte> parameters, std::initializer_list<GpuBinding> bindings,
           uint32_t groups) override;
  std::optional<double> RunTimed(const GpuKernel& kernel, std::span<const std::byte> parameters,
                                 std::initializer_list<GpuBinding> bindings, uint32_t groups) override;
  void Submit() override;
  Status Read(std::span<const GpuRead> reads) override;
  Status Wait() override;
  double seconds() const override { return seconds_.load(); }
  int64_t waits() const override { return waits_.load(); }

  bool failed() const { return failure_->happened() || instance_.broken(); }

 private:
  class Buffer;                                     // webgpu_buffer.h
  static constexpr uint32_t kParameterBytes = 256;  // alignment of uniform buffer offsets

  struct Pipeline {
    WGPUComputePipeline pipeline = nullptr;
    WGPUBindGroupLayout layout = nullptr;  // null: not queried yet
  };
  struct ScopedError {
    WGPUErrorType type = WGPUErrorType_NoError;
    std::string message;
  };

  // Scope of a call: holds the mutex and counts the time.
  class Working {
   public:
    explicit Working(WebGpuDevice& device) : device_(device), lock_(device.mutex_) {}
    ~Working() { device_.seconds_ = device_.seconds_ + watch_.Total(); }
    Working(const Working&) = delete;
    Working& operator=(const Working&) = delete;

   private:
    WebGpuDevice& device_;
    std::lock_guard<std::mutex> lock_;
    Stopwatch watch_;
  };

  WebGpuDevice(WebGpuInstance& instance, GpuAdapter adapter) : instance_(instance), adapter_(std::move(adapter)) {}

  // All require the mutex.
  void Record(const GpuKernel& kernel, std::span<const std::byte> parameters,
              std::initializer_list<GpuBinding> bindings, uint32_t groups);
  bool EnsureClock();
  void BeginCommands();
  void CountCommand();
  void EndPass();
  void SubmitRecorded();
  void ReleaseRetired();
  bool HandOver(size_t count, const WGPUCommandBuffer* commands);
  bool WaitForQueue();
  template <typename Ask>
  bool WaitForAnswer(const Ask& ask);
  void PushErrorScopes();
  ScopedError PopErrorScopes();
  Pipeline* PipelineOf(const GpuKernel& kernel);
  Pipeline Compile(const GpuKernel& kernel);
  bool ReadPieces(std::span<const GpuRead> pieces);
  const std::byte* MapStaging(uint64_t bytes);
  bool EnsureStaging(uint64_t bytes);
  WGPUBuffer MakeBuffer(uint64_t bytes, WGPUBufferUsage usage, std::string_view label, ScopedError& error);
  void Retire(WGPUBuffer buffer, uint64_t last_used);
  void Destroy(WGPUBuffer buffer);
  Status FailureOr() const;

  WebGpuInstance& instance_;
  GpuAdapter adapter_;
  GpuFailure* const failure_ = new GpuFailure;  // never freed: the library may call back after the device is gone
  WGPUDevice device_ = nullptr;
  WGPUQueue queue_ = nullptr;

  std::mutex mutex_;
  WGPUCommandEncoder encoder_ = nullptr;
  WGPUComputePassEncoder pass_ = nullptr;
  uint64_t recording_ = 1;             // number of the current recording; incremented by a submit
  uint32_t commands_ = 0;              // in the current recording
  uint32_t submits_ = 0;               // since the last wait for the queue
  uint64_t bytes_written_ = 0;         // held as copies by the queue
  std::vector<std::byte> parameters_;  // of recorded dispatches, kParameterBytes each
  WGPUBuffer parameter_slots_ = nullptr;
  std::vector<WGPUBuffer> retired_;  // freed by their owners, still in use by recorded work
  WGPUBuffer staging_ = nullptr;     // mapped for reading
  uint64_t staging_bytes_ = 0;
  std::unordered_map<const GpuKernel*, Pipeline> pipelines_;
  bool unchecked_ = false;
  WGPUQuerySet ticks_ = nullptr;  // timestamps before and after a kernel
  WGPUBuffer resolved_ticks_ = nullptr;
  std::atomic<double> seconds_ = 0;
  std::atomic<int64_t> waits_ = 0;
};

}  // namespace anchorsplat
