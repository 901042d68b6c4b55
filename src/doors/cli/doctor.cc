#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iostream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/finding.h"
#include "cli/gpu_report.h"
#include "cli/lab.h"
#include "cli/verb.h"
#include "compact/shipped_network.h"
#include "core/memory_limit.h"
#include "core/parallel.h"
#include "core/text.h"
#include "kernels/bfloat16_tile.h"

namespace anchorsplat {

namespace {

// Files of the kernel have size 0, so the readers in io/ would see them as empty.
std::string ProcessorName() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return Printable(line.substr(colon + 2));
  }
  return "unknown processor";
}

// Bytes from /proc/meminfo; 0 if unknown.
uint64_t MemoryOf(const std::string& what) {
  std::ifstream file("/proc/meminfo");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(what + ":")) return 1024 * std::strtoull(line.c_str() + what.size() + 1, nullptr, 10);
  }
  return 0;
}

// Memory limit of the container; unset if there is none.
std::optional<uint64_t> MemoryOfContainer() {
  const uint64_t most = MachineMemory();
  return most < MemoryOf("MemTotal") ? std::optional(most) : std::nullopt;
}

struct Machine {
  std::string processor = ProcessorName();
  std::string simd;                 // in use
  std::vector<std::string> lesser;  // others in this program that this machine can run
  bool bfloat16_products = UsesBFloat16Dot();
  int threads = ThreadCount();
  uint64_t memory = MemoryOf("MemTotal");
  uint64_t available = MemoryOf("MemAvailable");
  std::optional<uint64_t> limit = MemoryOfContainer();
};

Machine LookAtMachine() {
  Machine machine;
  for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
    (machine.simd.empty() ? machine.simd : machine.lesser.emplace_back()) = hwy::TargetName(target);
  }
  return machine;
}

const char* BuildKind() {
#ifdef __SANITIZE_ADDRESS__
  return "debug build with sanitizers";
#elif defined(NDEBUG)
  return "release build";
#else
  return "debug build, slow";
#endif
}

Finding FindModel() {
  if (!HasShippedNetwork()) {
    return {"model", kMissing, "this program was built without the weights in models/",
            "anchorsplat enhance --model FILE, or --method filter"};
  }
  int64_t copies = 0;
  for (const Shipped which : kAllShipped) {
    const auto network = LoadShippedNetwork(which);
    if (!network.ok()) return {"model", kBroken, network.error().message, "make build"};
    copies = std::max(copies, network->config().copies);
  }
  return {"model", kReady, Cat("built in, ", copies, " Gaussians for each"), ""};
}

Finding FindGpu(const GpuFindings& gpus) {
  std::string text;
  for (const std::string& line : LinesOf(gpus)) text += (text.empty() ? "" : "\n") + line;
  return {"GPU", gpus.ready() ? kReady : gpus.broken() ? kBroken : kMissing, text, CommandFor(gpus)};
}

void PrintReport(const Machine& machine, const std::vector<Finding>& findings) {
  constexpr size_t kColumn = 15;
  const auto line = [](const std::string& name, const std::string& text) {
    std::cout << name << std::string(name.size() < kColumn ? kColumn - name.size() : 1, ' ');
    for (const char c : text) std::cout << c << (c == '\n' ? std::string(kColumn, ' ') : "");
    std::cout << "\n";
  };
  line("anchorsplat", Cat(ANCHORSPLAT_VERSION, ", ", BuildKind()));
  line("processor", machine.processor);
  std::string lesser;
  for (const std::string& name : machine.lesser) lesser += (lesser.empty() ? "" : ", ") + name;
  line("SIMD", Cat(machine.simd, lesser.empty() ? "" : Cat(" (also built: ", lesser, ")")));
  line("bfloat16", machine.bfloat16_products ? "supported: --precision bf16 is faster than fp32"
                                             : "not supported: --precision bf16 falls back to fp32");
  line("threads", Cat(machine.threads));
  line("memory", Cat(HumanBytes(machine.memory), ", ", HumanBytes(machine.available), " free",
                     machine.limit ? Cat("; this container may use ", HumanBytes(*machine.limit)) : ""));
  for (const Finding& finding : findings) {
    const bool ready = finding.state == std::string(kReady);
    line(finding.name, ready ? finding.text : Cat(finding.state, ": ", finding.text));
    if (!finding.command.empty()) line("", Cat("→ ", finding.command));
  }
}

void PrintReportAsJson(const Machine& machine, const std::vector<Finding>& findings, const GpuFindings& gpus) {
  nlohmann::json parts = nlohmann::json::object();
  for (const Finding& finding : findings) {
    nlohmann::json& part = parts[finding.name] = {{"state", finding.state}, {"text", finding.text}};
    if (!finding.command.empty()) part["command"] = finding.command;
  }
  PrintJson({{"version", ANCHORSPLAT_VERSION},
             {"build", BuildKind()},
             {"processor", machine.processor},
             {"simd", machine.simd},
             {"simd_also_built", machine.lesser},
             {"bfloat16_products", machine.bfloat16_products},
             {"threads", machine.threads},
             {"memory_bytes", machine.memory},
             {"memory_available_bytes", machine.available},
             {"memory_limit_bytes", machine.limit ? nlohmann::json(*machine.limit) : nlohmann::json()},
             {"gpu", ToJson(gpus)},
             {"parts", parts}});
}

}  // namespace

void AddDoctor(CLI::App& app, Program& program) {
  CLI::App& verb = AddVerb(app, program, "doctor", "Check this program and machine, and say how to get what is missing",
                           "anchorsplat doctor");
  verb.callback([&program] {
    program.run = [&program]() -> Status {
      const Machine machine = LookAtMachine();
      const GpuFindings gpus = LookForGpus();
      std::vector<Finding> findings = LabFindings();
      findings.insert(findings.begin(), FindModel());
      findings.push_back(FindGpu(gpus));
      for (const Finding& finding : findings) {
        if (finding.state == std::string(kBroken)) program.exit_code = kPartialExitCode;
      }
      program.flags.json ? PrintReportAsJson(machine, findings, gpus) : PrintReport(machine, findings);
      return {};
    };
  });
}

}  // namespace anchorsplat
