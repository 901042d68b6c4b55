#pragma once

#include <webgpu.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "core/result.h"

namespace anchorsplat {

// Functions of the standard header that we call, without the prefix "wgpu".
// clang-format off
#define ANCHORSPLAT_WEBGPU_FUNCTIONS(X) \
  X(CreateInstance) X(InstanceProcessEvents) X(InstanceRequestAdapter) X(AdapterGetInfo) X(AdapterInfoFreeMembers) \
  X(AdapterGetLimits) X(AdapterHasFeature) X(AdapterRequestDevice) X(AdapterRelease) X(DeviceCreateBindGroup) \
  X(DeviceCreateBuffer) X(DeviceCreateCommandEncoder) X(DeviceCreateComputePipeline) X(DeviceCreateShaderModule) \
  X(DeviceGetQueue) X(DevicePopErrorScope) X(DevicePushErrorScope) X(QueueOnSubmittedWorkDone) X(QueueSubmit) \
  X(QueueWriteBuffer) X(BufferDestroy) X(BufferGetConstMappedRange) X(BufferMapAsync) X(BufferRelease) \
  X(BufferUnmap) X(CommandEncoderBeginComputePass) X(CommandEncoderClearBuffer) X(CommandEncoderCopyBufferToBuffer) \
  X(CommandEncoderFinish) X(CommandEncoderRelease) X(CommandBufferRelease) X(ComputePassEncoderDispatchWorkgroups) \
  X(ComputePassEncoderEnd) X(ComputePassEncoderRelease) X(ComputePassEncoderSetBindGroup) \
  X(ComputePassEncoderSetPipeline) X(ComputePipelineGetBindGroupLayout) X(BindGroupRelease) X(ShaderModuleRelease)
// clang-format on

// A loaded WebGPU library. Never unloaded: its threads may live as long as the program.
struct WebGpuApi {
#define ANCHORSPLAT_WEBGPU_MEMBER(name) WGPUProc##name name = nullptr;
  ANCHORSPLAT_WEBGPU_FUNCTIONS(ANCHORSPLAT_WEBGPU_MEMBER)
#undef ANCHORSPLAT_WEBGPU_MEMBER
  // Standard, but a stub in wgpu-native, which waits by DevicePoll instead.
  WGPUProcInstanceWaitAny InstanceWaitAny = nullptr;
  WGPUProcHasInstanceFeature HasInstanceFeature = nullptr;
  // Standard, for timestamps.
  WGPUProcDeviceCreateQuerySet DeviceCreateQuerySet = nullptr;
  WGPUProcCommandEncoderResolveQuerySet CommandEncoderResolveQuerySet = nullptr;
  // Extensions of wgpu-native (its wgpu.h), null in other libraries.
  WGPUBool (*DevicePoll)(WGPUDevice device, WGPUBool wait, const uint64_t* submission) = nullptr;
  size_t (*InstanceEnumerateAdapters)(WGPUInstance instance, const void* options, WGPUAdapter* adapters) = nullptr;
  float (*QueueGetTimestampPeriod)(WGPUQueue queue) = nullptr;  // nanoseconds per tick; 1 in other libraries
  WGPUShaderModule (*DeviceCreateShaderModuleTrusted)(WGPUDevice device, const WGPUShaderModuleDescriptor* descriptor,
                                                      WGPUFlags checks) = nullptr;

  std::string path;
};

// Errors (kNotFound): the file cannot be loaded, or lacks functions.
Result<WebGpuApi> LoadWebGpu(const std::string& path);

inline std::string TextOf(WGPUStringView view) {
  if (view.data == nullptr) return {};
  return view.length == WGPU_STRLEN ? std::string(view.data) : std::string(view.data, view.length);
}

inline WGPUStringView ViewOf(std::string_view text) { return {text.data(), text.size()}; }

}  // namespace anchorsplat
