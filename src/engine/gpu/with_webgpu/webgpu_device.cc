#include "gpu/with_webgpu/webgpu_device.h"

#include <memory>
#include <string>
#include <utility>

#include "core/run_context.h"
#include "core/text.h"
#include "gpu/with_webgpu/abort_guard.h"
#include "gpu/with_webgpu/webgpu_buffer.h"

namespace anchorsplat {

namespace {

// Short enough for a desktop's GPU watchdog.
constexpr uint32_t kRecorded = 64;  // commands per submit
constexpr uint32_t kSubmits = 32;   // submits between waits, as queued work takes memory

}  // namespace

Result<std::shared_ptr<WebGpuDevice>> WebGpuDevice::Open(WebGpuInstance& instance, const FoundAdapter& adapter,
                                                         bool unchecked) {
  const WebGpuApi& api = *instance.api();
  // NOLINTNEXTLINE: the constructor is private
  std::shared_ptr<WebGpuDevice> made(new WebGpuDevice(instance, adapter.description));
  made->unchecked_ = unchecked;
  WGPULimits limits = WGPU_LIMITS_INIT;
  limits.maxStorageBufferBindingSize = adapter.description.max_binding;
  limits.maxBufferSize = adapter.description.max_buffer;
  WGPUDeviceDescriptor descriptor = WGPU_DEVICE_DESCRIPTOR_INIT;
  descriptor.requiredLimits = &limits;
  const WGPUFeatureName timestamps = WGPUFeatureName_TimestampQuery;
  if (adapter.description.timestamps) {
    descriptor.requiredFeatures = &timestamps;
    descriptor.requiredFeatureCount = 1;
  }
  descriptor.uncapturedErrorCallbackInfo.userdata1 = made->failure_;
  descriptor.uncapturedErrorCallbackInfo.callback = [](WGPUDevice const*, WGPUErrorType type, WGPUStringView message,
                                                       void* failure, void*) {
    const char* what = type == WGPUErrorType_OutOfMemory ? "it has no memory left" : "it refused a command";
    static_cast<GpuFailure*>(failure)->Set(Cat(what, " (", ReasonOf(TextOf(message)), ")"));
  };
  descriptor.deviceLostCallbackInfo.mode = WGPUCallbackMode_AllowSpontaneous;
  descriptor.deviceLostCallbackInfo.userdata1 = made->failure_;
  descriptor.deviceLostCallbackInfo.callback = [](WGPUDevice const*, WGPUDeviceLostReason, WGPUStringView message,
                                                  void* failure, void*) {
    static_cast<GpuFailure*>(failure)->Set(Cat("the device was lost (", ReasonOf(TextOf(message)), ")"));
  };
  struct Answer {
    WGPUDevice device = nullptr;
    std::string message;
    bool done = false;
  };
  auto* const answer = new Answer;  // freed by the callback
  WGPURequestDeviceCallbackInfo callback = WGPU_REQUEST_DEVICE_CALLBACK_INFO_INIT;
  callback.mode = WGPUCallbackMode_AllowProcessEvents;
  callback.callback = [](WGPURequestDeviceStatus, WGPUDevice device, WGPUStringView message, void* to, void*) {
    *static_cast<Answer*>(to) = {.device = device, .message = TextOf(message), .done = true};
  };
  callback.userdata1 = answer;
  const WGPUFuture future = api.AdapterRequestDevice(adapter.handle->get(), &descriptor, callback);
  if (!instance.WaitUntil([&] { return answer->done; }, nullptr, future)) {
    return Error{ErrorCode::kNotFound, Cat("the driver of ", made->adapter_.name, " does not answer")};
  }
  const std::unique_ptr<Answer> answered(answer);
  if (answered->device == nullptr) {
    return Error{ErrorCode::kNotFound, Cat(made->adapter_.name, " cannot be opened: ", ReasonOf(answered->message))};
  }
  made->device_ = answered->device;
  made->queue_ = api.DeviceGetQueue(made->device_);
  ScopedError error;
  made->parameter_slots_ = made->MakeBuffer(uint64_t{kRecorded} * kParameterBytes,
                                            WGPUBufferUsage_Uniform | WGPUBufferUsage_CopyDst, "parameters", error);
  if (made->parameter_slots_ == nullptr) {
    return Error{ErrorCode::kNotFound, Cat(made->adapter_.name, " cannot be opened: ", error.message)};
  }
  return made;
}

// Opened devices are kept for the program's lifetime (open_gpu.cc).
WebGpuDevice::~WebGpuDevice() = default;

Status WebGpuDevice::FailureOr() const {
  if (failure_->happened()) return failure_->error();
  if (instance_.broken()) return Error{ErrorCode::kIo, kGpuLost};
  return {};
}

void WebGpuDevice::PushErrorScopes() {
  const WebGpuApi& api = *instance_.api();
  // wgpu-native has no error scope for internal errors; they are sticky failures.
  api.DevicePushErrorScope(device_, WGPUErrorFilter_OutOfMemory);
  api.DevicePushErrorScope(device_, WGPUErrorFilter_Validation);
}

WebGpuDevice::ScopedError WebGpuDevice::PopErrorScopes() {
  const WebGpuApi& api = *instance_.api();
  struct Answer : ScopedError {
    bool done = false;
  };
  ScopedError first;
  for (int scope = 0; scope < 2; ++scope) {
    auto* const answer = new Answer;  // freed by the callback
    WGPUPopErrorScopeCallbackInfo callback = WGPU_POP_ERROR_SCOPE_CALLBACK_INFO_INIT;
    callback.mode = WGPUCallbackMode_AllowProcessEvents;
    callback.callback = [](WGPUPopErrorScopeStatus, WGPUErrorType type, WGPUStringView message, void* to, void*) {
      auto& answered = *static_cast<Answer*>(to);
      answered.type = type;
      answered.message = TextOf(message);
      answered.done = true;
    };
    callback.userdata1 = answer;
    const WGPUFuture future = api.DevicePopErrorScope(device_, callback);
    if (!instance_.WaitUntil([&] { return answer->done; }, nullptr, future)) {
      failure_->Set("the driver does not answer");
      return first;
    }
    if (first.type == WGPUErrorType_NoError && answer->type > WGPUErrorType_NoError) first = *answer;
    if (IsDeviceLost(answer->message)) failure_->Set(kGpuLost);
    delete answer;
  }
  return first;
}

WGPUBuffer WebGpuDevice::MakeBuffer(uint64_t bytes, WGPUBufferUsage usage, std::string_view label, ScopedError& error) {
  const WebGpuApi& api = *instance_.api();
  WGPUBufferDescriptor descriptor = WGPU_BUFFER_DESCRIPTOR_INIT;
  descriptor.label = ViewOf(label);
  descriptor.size = bytes;
  descriptor.usage = usage;
  PushErrorScopes();
  WGPUBuffer buffer = api.DeviceCreateBuffer(device_, &descriptor);
  error = PopErrorScopes();
  error.message = ReasonOf(error.message);
  if (error.type == WGPUErrorType_NoError && !failed()) return buffer;
  if (buffer != nullptr && !failed()) api.BufferRelease(buffer);
  return nullptr;
}

Result<GpuMemory> WebGpuDevice::Allocate(uint64_t bytes, std::string_view what) {
  const Working working(*this);
  if (Status failure = FailureOr(); !failure.ok()) return failure.error();
  const uint64_t limit = adapter_.max_buffer;
  if (bytes == 0 || bytes > limit) {
    return Error{ErrorCode::kBadArgument, Cat("the GPU memory for ", what, " would be ", HumanBytes(bytes),
                                              ", and one buffer has from 1 byte to ", HumanBytes(limit))};
  }
  const uint64_t rounded = (bytes + kParameterBytes - 1) / kParameterBytes * kParameterBytes;
  const auto of_run = internal::CurrentStorage().Get<GpuMemoryOfRun>();
  const uint64_t allowed = MaxGpuMemoryOfRun();
  // Add first, so that two threads cannot both take the rest.
  const uint64_t in_use = of_run->bytes.fetch_add(rounded);
  if (in_use + rounded > allowed) {
    of_run->bytes -= rounded;
    return Error{ErrorCode::kBadArgument,
                 Cat("there is no room for ", what, " (", HumanBytes(rounded), ") within --max-gpu-memory (",
                     HumanBytes(allowed), ", of which ", HumanBytes(in_use), " are in use)")};
  }
  constexpr WGPUBufferUsage kUsage = WGPUBufferUsage_Storage | WGPUBufferUsage_CopySrc | WGPUBufferUsage_CopyDst;
  ScopedError error;
  WGPUBuffer buffer = MakeBuffer(rounded, kUsage, what, error);
  if (buffer == nullptr && !failed() && WaitForQueue()) {  // frees retired buffers
    buffer = MakeBuffer(rounded, kUsage, what, error);
  }
  if (buffer == nullptr) {
    of_run->bytes -= rounded;
    if (Status failure = FailureOr(); !failure.ok()) return failure.error();
    return Error{ErrorCode::kIo,
                 Cat("the GPU has no memory left for ", what, " (", HumanBytes(rounded), ": ", error.message, ")")};
  }
  return GpuMemory(std::make_unique<Buffer>(shared_from_this(), buffer, rounded, of_run));
}

void WebGpuDevice::Retire(WGPUBuffer buffer, uint64_t last_used) {
  const Working working(*this);
  if (last_used == recording_ && !failed()) {
    retired_.push_back(buffer);
    return;
  }
  Destroy(buffer);
}

// Also for failed devices, as others may need the memory.
void WebGpuDevice::Destroy(WGPUBuffer buffer) {
  if (instance_.broken()) return;
  const WebGpuApi& api = *instance_.api();
  const auto destroy = [&] {
    api.BufferDestroy(buffer);
    api.BufferRelease(buffer);
  };
  if (!failure_->happened()) return destroy();
  if (!SurvivesAbort(destroy)) instance_.Break();
}

void WebGpuDevice::ReleaseRetired() {
  for (WGPUBuffer buffer : retired_) Destroy(buffer);
  retired_.clear();
}

void WebGpuDevice::BeginCommands() {
  if (encoder_ == nullptr) encoder_ = instance_.api()->DeviceCreateCommandEncoder(device_, nullptr);
}

void WebGpuDevice::CountCommand() {
  if (++commands_ >= kRecorded) SubmitRecorded();
}

void WebGpuDevice::EndPass() {
  if (pass_ == nullptr) return;
  instance_.api()->ComputePassEncoderEnd(pass_);
  instance_.api()->ComputePassEncoderRelease(pass_);
  pass_ = nullptr;
}

void WebGpuDevice::Clear(const GpuBuffer& buffer, uint64_t offset, uint64_t bytes) {
  const Working working(*this);
  if (failed() || bytes == 0) return;
  EndPass();
  BeginCommands();
  instance_.api()->CommandEncoderClearBuffer(encoder_, Buffer::Use(buffer, recording_), offset, bytes);
  CountCommand();
}

void WebGpuDevice::Copy(const GpuBuffer& from, uint64_t from_offset, const GpuBuffer& to, uint64_t to_offset,
                        uint64_t bytes) {
  const Working working(*this);
  if (failed() || bytes == 0) return;
  EndPass();
  BeginCommands();
  instance_.api()->CommandEncoderCopyBufferToBuffer(encoder_, Buffer::Use(from, recording_), from_offset,
                                                    Buffer::Use(to, recording_), to_offset, bytes);
  CountCommand();
}

bool WebGpuDevice::HandOver(size_t count, const WGPUCommandBuffer* commands) {
  const bool survived = SurvivesAbort([&] { instance_.api()->QueueSubmit(queue_, count, commands); });
  if (survived) return true;
  instance_.Break();
  failure_->Set(kGpuLost);
  return false;
}

void WebGpuDevice::SubmitRecorded() {
  if (encoder_ == nullptr || failed()) return;
  const WebGpuApi& api = *instance_.api();
  EndPass();
  if (!parameters_.empty()) {
    api.QueueWriteBuffer(queue_, parameter_slots_, 0, parameters_.data(), parameters_.size());
    parameters_.clear();
  }
  WGPUCommandBuffer commands = api.CommandEncoderFinish(encoder_, nullptr);
  // Command errors have been reported by now, and wgpu-native aborts when bad commands are submitted.
  if (failed() || !HandOver(1, &commands)) return;
  api.CommandBufferRelease(commands);
  api.CommandEncoderRelease(encoder_);
  encoder_ = nullptr;
  commands_ = 0;
  ++recording_;
  ReleaseRetired();
  if (++submits_ >= kSubmits) WaitForQueue();
}

void WebGpuDevice::Submit() {
  const Working working(*this);
  SubmitRecorded();
}

}  // namespace anchorsplat
