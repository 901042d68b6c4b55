#include <algorithm>
#include <cstring>
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
  WGPUShaderModule module = api.DeviceCreateShaderModule(device_, &module_descriptor);
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

}  // namespace anchorsplat
