#pragma once

#include <webgpu.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "core/result.h"

namespace anchorsplat {

// The functions of the standard header that are called, without their prefix "wgpu".
// As it would move these at every call:
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

// A library that speaks WebGPU, loaded. Libraries stay loaded: their threads may live as long as the program.
struct WebGpuApi {
#define ANCHORSPLAT_WEBGPU_MEMBER(name) WGPUProc##name name = nullptr;
  ANCHORSPLAT_WEBGPU_FUNCTIONS(ANCHORSPLAT_WEBGPU_MEMBER)
#undef ANCHORSPLAT_WEBGPU_MEMBER
  // Standard, but a stub in wgpu-native, whose own way to wait is DevicePoll.
  WGPUProcInstanceWaitAny InstanceWaitAny = nullptr;
  WGPUProcHasInstanceFeature HasInstanceFeature = nullptr;
  // Standard, for the GPU's clock.
  WGPUProcDeviceCreateQuerySet DeviceCreateQuerySet = nullptr;
  WGPUProcCommandEncoderResolveQuerySet CommandEncoderResolveQuerySet = nullptr;
  // wgpu-native's own, null in others; declared in its wgpu.h, which is not needed for them.
  WGPUBool (*DevicePoll)(WGPUDevice device, WGPUBool wait, const uint64_t* submission) = nullptr;
  size_t (*InstanceEnumerateAdapters)(WGPUInstance instance, const void* options, WGPUAdapter* adapters) = nullptr;
  float (*QueueGetTimestampPeriod)(WGPUQueue queue) = nullptr;  // nanoseconds; others count in these
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
