#include "request/device_flags.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "gpu/open_gpu.h"
#include "request/choice.h"

namespace anchorsplat {

void DeviceFlags::AddTo(CLI::App& verb) {
  verb.add_option_function<std::string>(
          "--device", [this](const std::string& word) { device = *ParseDeviceChoice(word); },
          "Rasterize on cpu, gpu (the first usable one), auto (a hardware GPU, else the CPU) or adapter number N "
          "(listed by "
          "`doctor`)")
      ->type_name("DEVICE")
      ->check(CLI::Validator(
          [](const std::string& word) {
            const auto choice = ParseDeviceChoice(word);
            return choice.ok() ? std::string() : choice.error().message;
          },
          ""))
      ->default_str(DeviceWord(device))
      ->group(kDeviceGroup);
  verb.add_option("--max-gpu-memory", max_gpu_memory, "Most GPU memory to use, such as 4G or 500M (default: 2 GiB)")
      ->transform(MemorySize())
      ->group(kDeviceGroup);
}

DeviceUse::DeviceUse() {
  if (const auto gpu = GpuOfRun(); gpu.ok()) gpu_ = *gpu;
  if (gpu_ != nullptr) spent_before_ = gpu_->seconds();
}

nlohmann::json DeviceUse::ToJson() const {
  const std::string gave_up = WhyGpuWasGivenUp();
  nlohmann::json json = {{"name", "cpu"}};
  if (!gave_up.empty()) json["gave_up"] = gave_up;
  if (gpu_ == nullptr) return json;
  const std::chrono::duration<double> in_all = std::chrono::steady_clock::now() - begin_;
  const double spent = gpu_->seconds() - spent_before_;
  const GpuAdapter& adapter = gpu_->adapter();
  json["name"] = adapter.name;
  json["backend"] = adapter.backend;
  json["type"] = NameOf(adapter.type);
  json["seconds"] = spent;
  // Other runs may work on the same device at the same time.
  json["share"] = in_all.count() > 0 ? std::min(1.0, spent / in_all.count()) : 0.0;
  return json;
}

const char* NameOf(GpuAdapter::Type type) {
  switch (type) {
    case GpuAdapter::Type::kDiscrete:
      return "discrete";
    case GpuAdapter::Type::kIntegrated:
      return "integrated";
    case GpuAdapter::Type::kCpu:
      return "cpu";
    case GpuAdapter::Type::kUnknown:
      break;
  }
  return "unknown";
}

}  // namespace anchorsplat
