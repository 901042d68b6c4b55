#include "cli/gpu_report.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/companion.h"
#include "core/file_system.h"
#include "core/text.h"
#include "request/device_flags.h"

namespace anchorsplat {

namespace {

std::string LineOf(const GpuAdapter& adapter) {
  return Cat(adapter.number, ": ", Printable(adapter.name), ", ", adapter.backend, ", ", NameOf(adapter.type),
             "; bindings up to ", HumanBytes(adapter.max_binding), ", buffers up to ", HumanBytes(adapter.max_buffer));
}

}  // namespace

bool GpuFindings::ready() const {
  return std::ranges::any_of(adapters, [](const GpuAdapter& adapter) { return adapter.unusable.empty(); });
}

GpuFindings LookForGpus() {
  GpuFindings findings{FindGpuLibrary(), {}};
  if (!findings.library.path.empty()) findings.adapters = ListGpuAdapters();
  return findings;
}

std::string WorkingOn(const GpuAdapter& adapter) {
  const bool software = adapter.type == GpuAdapter::Type::kCpu;
  return Cat("working on ", Printable(adapter.name), " (", adapter.backend, ")",
             software ? ", a software renderer, slower than --device cpu" : "");
}

std::string WhyNotTaken(const GpuAdapter& adapter) {
  if (!adapter.unusable.empty()) return adapter.unusable;
  if (adapter.type == GpuAdapter::Type::kCpu) return "software renderer, slower than --device cpu";
  return "";
}

std::vector<std::string> LinesOf(const GpuFindings& findings) {
  if (findings.library.path.empty()) return {findings.library.problem};
  if (findings.adapters.empty()) return {Cat(findings.library.path, " finds no adapter: no driver is installed")};
  std::vector<std::string> lines;
  for (const GpuAdapter& adapter : findings.adapters) {
    lines.push_back(LineOf(adapter));
    if (!adapter.unusable.empty()) {
      lines.push_back(Cat("   cannot be used: ", adapter.unusable));
    } else if (const std::string why = WhyNotTaken(adapter); !why.empty()) {
      lines.push_back(Cat("   not chosen by auto: ", why));
    }
  }
  lines.push_back(Cat("by ", findings.library.path));
  return lines;
}

std::string CommandFor(const GpuFindings& findings) {
  if (findings.ready()) return "";
  if (findings.broken()) return "set ANCHORSPLAT_WEBGPU to an existing library, or unset it";
  if (!findings.library.path.empty()) return "install the Vulkan driver of your GPU (Debian: mesa-vulkan-drivers)";
  const bool checkout = Exists(ProgramFolder().parent_path() / "scripts" / "fetch-webgpu.sh");
  return checkout ? "scripts/fetch-webgpu.sh" : "pip install wgpu==0.32.0";
}

nlohmann::json ToJson(const GpuFindings& findings) {
  const GpuLibrary& library = findings.library;
  nlohmann::json json = {{"library", library.path.empty() ? nlohmann::json() : nlohmann::json(library.path)},
                         {"adapters", nlohmann::json::array()}};
  if (!library.problem.empty()) json["problem"] = library.problem;
  for (const GpuAdapter& adapter : findings.adapters) {
    nlohmann::json& row = json["adapters"].emplace_back(nlohmann::json{
        {"number", adapter.number},
        {"name", adapter.name},
        {"driver", adapter.driver},
        {"backend", adapter.backend},
        {"type", NameOf(adapter.type)},
        {"max_binding_bytes", adapter.max_binding},
        {"max_buffer_bytes", adapter.max_buffer},
        {"max_storage_buffers", adapter.max_storage_buffers},
        {"max_workgroup_memory_bytes", adapter.max_workgroup_memory},
        {"timestamps", adapter.timestamps},
        {"usable", adapter.unusable.empty()},
    });
    const std::string why = WhyNotTaken(adapter);
    row["taken_by_auto"] = why.empty();
    if (!why.empty()) row["why_not"] = why;
  }
  return json;
}

}  // namespace anchorsplat
