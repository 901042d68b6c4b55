#include <algorithm>
#include <cstring>
#include <optional>
#include <string>

#include "core/text.h"
#include "gpu/wgsl.h"
#include "gpu/with_webgpu/shader_error.h"
#include "gpu/with_webgpu/webgpu_buffer.h"
#include "gpu/with_webgpu/webgpu_device.h"

namespace anchorsplat {

namespace {
constexpr uint32_t kRowGroups = 65535;  // gpu/prelude.wgsl
constexpr size_t kMaxBindings = 9;      // 8 buffers and the parameters
}  // namespace

WebGpuDevice::Pipeline WebGpuDevice::Compile(const GpuKernel& kernel) {
  const WebGpuApi& api = *instance_.api();
  std::string text(wgsl::kPreludeWgsl);
  for (const std::string_view source : kernel.sources) text += source;
  WGPUShaderSourceWGSL source = WGPU_SHADER_SOURCE_WGSL_INIT;
  source.code = ViewOf(text);
  WGPUShaderModuleDescriptor module_descriptor = WGPU_SHADER_MODULE_DESCRIPTOR_INIT;
  module_descriptor.nextInChain = &source.chain;
  module_descriptor.label = ViewOf(kernel.entry);
  PushErrorScopes();
  WGPUShaderModule module = unchecked_ ? api.DeviceCreateShaderModuleTrusted(device_, &module_descriptor, 0)
                                       : api.DeviceCreateShaderModule(device_, &module_descriptor);
  ScopedError error = PopErrorScopes();
  Pipeline made;
  if (error.type == WGPUErrorType_NoError && !failed()) {
    WGPUComputePipelineDescriptor descriptor = WGPU_COMPUTE_PIPELINE_DESCRIPTOR_INIT;
    descriptor.label = ViewOf(kernel.entry);
    descriptor.compute.module = module;
    descriptor.compute.entryPoint = ViewOf(kernel.entry);
    PushErrorScopes();
    made.pipeline = api.DeviceCreateComputePipeline(device_, &descriptor);
    error = PopErrorScopes();
  }
  if (error.type != WGPUErrorType_NoError || failed()) {
    failure_->Set(Cat("the kernel ", kernel.entry, " does not compile: ", ShaderError(error.message, text)));
    return {};
  }
  api.ShaderModuleRelease(module);
  return made;
}

WebGpuDevice::Pipeline* WebGpuDevice::PipelineOf(const GpuKernel& kernel) {
  const auto known = pipelines_.find(&kernel);
  if (known != pipelines_.end()) return &known->second;
  const Pipeline made = Compile(kernel);
  if (failed()) return nullptr;
  return &pipelines_.emplace(&kernel, made).first->second;
}

void WebGpuDevice::Run(const GpuKernel& kernel, std::span<const std::byte> parameters,
                       std::initializer_list<GpuBinding> bindings, uint32_t groups) {
  const Working working(*this);
  Record(kernel, parameters, bindings, groups);
}

void WebGpuDevice::Record(const GpuKernel& kernel, std::span<const std::byte> parameters,
                          std::initializer_list<GpuBinding> bindings, uint32_t groups) {
  if (failed() || groups == 0) return;
  const WebGpuApi& api = *instance_.api();
  if (parameters.size() > kParameterBytes || bindings.size() + 1 > kMaxBindings) {
    failure_->Set(Cat("the kernel ", kernel.entry, " is given more than it can see"));
    return;
  }
  Pipeline* const pipeline = PipelineOf(kernel);
  if (pipeline == nullptr) return;

  WGPUBindGroupEntry entries[kMaxBindings];
  size_t count = 0;
  if (!parameters.empty()) {
    const size_t slot = parameters_.size();
    parameters_.resize(slot + kParameterBytes);
    std::memcpy(parameters_.data() + slot, parameters.data(), parameters.size());
    entries[count] = WGPU_BIND_GROUP_ENTRY_INIT;
    entries[count].buffer = parameter_slots_;
    entries[count].offset = slot;
    entries[count].size = kParameterBytes;
    ++count;
  }
  for (const GpuBinding& binding : bindings) {
    const uint64_t all = binding.buffer->bytes() - std::min(binding.offset, binding.buffer->bytes());
    const uint64_t bytes = binding.bytes == 0 ? all : binding.bytes;
    if (bytes > adapter_.max_binding || bytes > all || bytes == 0) {
      failure_->Set(Cat("the kernel ", kernel.entry, " is given ", HumanBytes(bytes), " at binding ", binding.index,
                        ", where from 4 bytes to ", HumanBytes(std::min(all, adapter_.max_binding)), " can be"));
      return;
    }
    entries[count] = WGPU_BIND_GROUP_ENTRY_INIT;
    entries[count].binding = binding.index;
    entries[count].buffer = Buffer::Use(*binding.buffer, recording_);
    entries[count].offset = binding.offset;
    entries[count].size = bytes;
    ++count;
  }

  BeginCommands();
  if (pass_ == nullptr) pass_ = api.CommandEncoderBeginComputePass(encoder_, nullptr);
  api.ComputePassEncoderSetPipeline(pass_, pipeline->pipeline);
  if (count > 0) {
    if (pipeline->layout == nullptr) pipeline->layout = api.ComputePipelineGetBindGroupLayout(pipeline->pipeline, 0);
    WGPUBindGroupDescriptor descriptor = WGPU_BIND_GROUP_DESCRIPTOR_INIT;
    descriptor.label = ViewOf(kernel.entry);
    descriptor.layout = pipeline->layout;
    descriptor.entries = entries;
    descriptor.entryCount = count;
    WGPUBindGroup group = api.DeviceCreateBindGroup(device_, &descriptor);
    if (failed()) return;
    api.ComputePassEncoderSetBindGroup(pass_, 0, group, 0, nullptr);
    api.BindGroupRelease(group);
  }
  const uint32_t rows = (groups + kRowGroups - 1) / kRowGroups;
  api.ComputePassEncoderDispatchWorkgroups(pass_, std::min(groups, kRowGroups), rows, 1);
  CountCommand();
}

bool WebGpuDevice::EnsureClock() {
  const WebGpuApi& api = *instance_.api();
  if (!adapter_.timestamps || api.DeviceCreateQuerySet == nullptr || api.CommandEncoderResolveQuerySet == nullptr) {
    return false;
  }
  if (ticks_ != nullptr) return true;
  WGPUQuerySetDescriptor descriptor = WGPU_QUERY_SET_DESCRIPTOR_INIT;
  descriptor.type = WGPUQueryType_Timestamp;
  descriptor.count = 2;
  ScopedError error;
  resolved_ticks_ = MakeBuffer(256, WGPUBufferUsage_QueryResolve | WGPUBufferUsage_CopySrc, "ticks", error);
  if (resolved_ticks_ == nullptr || !EnsureStaging(256)) return false;
  PushErrorScopes();
  ticks_ = api.DeviceCreateQuerySet(device_, &descriptor);
  if (PopErrorScopes().type != WGPUErrorType_NoError) ticks_ = nullptr;
  return ticks_ != nullptr;
}

std::optional<double> WebGpuDevice::RunTimed(const GpuKernel& kernel, std::span<const std::byte> parameters,
                                             std::initializer_list<GpuBinding> bindings, uint32_t groups) {
  const Working working(*this);
  if (failed()) return std::nullopt;
  const WebGpuApi& api = *instance_.api();
  if (groups == 0 || !EnsureClock()) {
    Record(kernel, parameters, bindings, groups);
    if (!failed()) WaitForQueue();
    return std::nullopt;
  }
  SubmitRecorded();
  if (PipelineOf(kernel) == nullptr) return std::nullopt;
  WGPUPassTimestampWrites writes = WGPU_PASS_TIMESTAMP_WRITES_INIT;
  writes.querySet = ticks_;
  writes.beginningOfPassWriteIndex = 0;
  writes.endOfPassWriteIndex = 1;
  WGPUComputePassDescriptor descriptor = WGPU_COMPUTE_PASS_DESCRIPTOR_INIT;
  descriptor.timestampWrites = &writes;
  BeginCommands();
  pass_ = api.CommandEncoderBeginComputePass(encoder_, &descriptor);
  Record(kernel, parameters, bindings, groups);
  if (failed()) return std::nullopt;
  EndPass();
  constexpr uint64_t kBytes = 2 * sizeof(uint64_t);
  api.CommandEncoderResolveQuerySet(encoder_, ticks_, 0, 2, resolved_ticks_, 0);
  api.CommandEncoderCopyBufferToBuffer(encoder_, resolved_ticks_, 0, staging_, 0, kBytes);
  const std::byte* const from = MapStaging(kBytes);
  if (from == nullptr) return std::nullopt;
  uint64_t ticks[2];
  std::memcpy(ticks, from, kBytes);
  api.BufferUnmap(staging_);
  const double period = api.QueueGetTimestampPeriod == nullptr ? 1.0 : double{api.QueueGetTimestampPeriod(queue_)};
  if (ticks[1] < ticks[0]) return std::nullopt;  // the clock was reset
  return 1e-9 * period * static_cast<double>(ticks[1] - ticks[0]);
}

}  // namespace anchorsplat
