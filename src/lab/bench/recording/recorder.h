#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/result.h"
#include "gpu/device.h"

namespace anchorsplat {

// A device that writes down all that another one is told and what it answers, so that scripts/gpu_browser_test.mjs can
// tell a browser the same. For one thread.
class Recorder final : public GpuDevice {
 public:
  explicit Recorder(std::shared_ptr<GpuDevice> gpu) : gpu_(std::move(gpu)) {}

  const GpuAdapter& adapter() const override { return gpu_->adapter(); }
  Result<GpuMemory> Allocate(uint64_t bytes, std::string_view what) override;
  void Write(const GpuBuffer& buffer, uint64_t offset, std::span<const std::byte> data) override;
  void Clear(const GpuBuffer& buffer, uint64_t offset, uint64_t bytes) override;
  void Copy(const GpuBuffer& from, uint64_t from_offset, const GpuBuffer& to, uint64_t to_offset,
            uint64_t bytes) override;
  void Run(const GpuKernel& kernel, std::span<const std::byte> parameters, std::initializer_list<GpuBinding> bindings,
           uint32_t groups) override;
  std::optional<double> RunTimed(const GpuKernel& kernel, std::span<const std::byte> parameters,
                                 std::initializer_list<GpuBinding> bindings, uint32_t groups) override {
    Run(kernel, parameters, bindings, groups);
    return std::nullopt;
  }
  void Submit() override { gpu_->Submit(); }
  Status Read(std::span<const GpuRead> reads) override;
  Status Wait() override { return gpu_->Wait(); }
  double seconds() const override { return gpu_->seconds(); }
  int64_t waits() const override { return gpu_->waits(); }

  // recording.json: {"kernels": [{"entry", "text"}], "buffers": [bytes], "calls": […]}, where a call is one of
  //   ["write", buffer, offset, at, bytes]         at: in recording.bin
  //   ["clear", buffer, offset, bytes]
  //   ["copy", from, from_offset, to, to_offset, bytes]
  //   ["run", kernel, at, bytes, [[binding, buffer, offset, bytes]…], groups]
  //   ["read", buffer, offset, at, bytes]
  // and recording.bin, what was written and what was read. Errors: kIo.
  Status WriteTo(const std::filesystem::path& folder) const;

 private:
  size_t NumberOf(const GpuBuffer& buffer) const { return numbers_.at(&buffer); }
  size_t Keep(std::span<const std::byte> data);

  std::shared_ptr<GpuDevice> gpu_;
  std::map<const GpuBuffer*, size_t> numbers_;  // of those that live; a new one may stand where an old one was
  std::map<const GpuKernel*, size_t> kernel_numbers_;
  nlohmann::json kernels_ = nlohmann::json::array(), buffers_ = nlohmann::json::array(),
                 calls_ = nlohmann::json::array();
  std::vector<std::byte> data_;
};

}  // namespace anchorsplat
