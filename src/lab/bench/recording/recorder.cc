#include "bench/recording/recorder.h"

#include "gpu/wgsl.h"
#include "io/atomic_file.h"

namespace anchorsplat {

Result<GpuMemory> Recorder::Allocate(uint64_t bytes, std::string_view what) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(GpuMemory memory, gpu_->Allocate(bytes, what));
  numbers_[memory.get()] = buffers_.size();
  buffers_.push_back(memory->bytes());
  return memory;
}

void Recorder::Write(const GpuBuffer& buffer, uint64_t offset, std::span<const std::byte> data) {
  if (!data.empty()) calls_.push_back({"write", NumberOf(buffer), offset, Keep(data), data.size()});
  gpu_->Write(buffer, offset, data);
}

void Recorder::Clear(const GpuBuffer& buffer, uint64_t offset, uint64_t bytes) {
  if (bytes > 0) calls_.push_back({"clear", NumberOf(buffer), offset, bytes});
  gpu_->Clear(buffer, offset, bytes);
}

void Recorder::Copy(const GpuBuffer& from, uint64_t from_offset, const GpuBuffer& to, uint64_t to_offset,
                    uint64_t bytes) {
  if (bytes > 0) calls_.push_back({"copy", NumberOf(from), from_offset, NumberOf(to), to_offset, bytes});
  gpu_->Copy(from, from_offset, to, to_offset, bytes);
}

void Recorder::Run(const GpuKernel& kernel, std::span<const std::byte> parameters,
                   std::initializer_list<GpuBinding> bindings, uint32_t groups) {
  if (groups > 0) {
    const auto [known, is_new] = kernel_numbers_.try_emplace(&kernel, kernels_.size());
    if (is_new) {
      std::string text(wgsl::kPreludeWgsl);
      for (const std::string_view source : kernel.sources) text += source;
      kernels_.push_back({{"entry", std::string(kernel.entry)}, {"text", text}});
    }
    nlohmann::json bound = nlohmann::json::array();
    for (const GpuBinding& binding : bindings) {
      const uint64_t bytes = binding.bytes > 0 ? binding.bytes : binding.buffer->bytes() - binding.offset;
      bound.push_back({binding.index, NumberOf(*binding.buffer), binding.offset, bytes});
    }
    calls_.push_back({"run", known->second, Keep(parameters), parameters.size(), bound, groups});
  }
  gpu_->Run(kernel, parameters, bindings, groups);
}

Status Recorder::Read(std::span<const GpuRead> reads) {
  ANCHORSPLAT_RETURN_IF_ERROR(gpu_->Read(reads));
  for (const GpuRead& read : reads) {
    if (read.to.empty()) continue;
    calls_.push_back({"read", NumberOf(*read.buffer), read.offset, Keep(read.to), read.to.size()});
  }
  return {};
}

size_t Recorder::Keep(std::span<const std::byte> data) {
  const size_t at = data_.size();
  data_.insert(data_.end(), data.begin(), data.end());
  data_.resize((data_.size() + 15) / 16 * 16);
  return at;
}

Status Recorder::WriteTo(const std::filesystem::path& folder) const {
  const nlohmann::json json = {{"kernels", kernels_}, {"buffers", buffers_}, {"calls", calls_}};
  ANCHORSPLAT_RETURN_IF_ERROR(WriteWholeFile(folder / "recording.json", json.dump(), true));
  const std::string_view bytes(reinterpret_cast<const char*>(data_.data()), data_.size());
  return WriteWholeFile(folder / "recording.bin", bytes, true);
}

}  // namespace anchorsplat
