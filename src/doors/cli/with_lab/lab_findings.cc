#include <filesystem>
#include <string>
#include <vector>

#include "cli/lab.h"
#include "core/companion.h"
#include "core/file_system.h"
#include "core/text.h"
#include "perceptual/lpips.h"
#include "perceptual/lpips_weights.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// How to get LibTorch, for a program in a checkout's build folder or an installed one.
std::string TorchCommand() {
  const fs::path folder = ProgramFolder();
  if (Exists(folder.parent_path() / "scripts" / "install-torch.sh")) return "make torch build";
  return "in a checkout of the sources: make install TORCH_DIR=<libtorch>/share/cmake/Torch";
}

std::string FetchCommand() {
  const fs::path installed = CompanionFile("fetch-lpips.sh");
  return Exists(installed) ? installed.string() : "scripts/fetch-lpips.sh";
}

Finding FindTraining() {
  const fs::path program = CompanionFile("anchorsplat-train");
  if (!Exists(program)) return {"training", kMissing, "built without LibTorch", TorchCommand()};
  return {"training", kReady, program.string(), ""};
}

Finding FindLpips() {
  const Status status = Lpips::CheckPlugin();
  if (status.ok()) return {"LPIPS", kReady, Lpips::PluginPath().string(), ""};
  if (status.error().code == ErrorCode::kNotFound) {
    return {"LPIPS", kMissing, "built without LibTorch", TorchCommand()};
  }
  return {"LPIPS", kBroken, status.error().message, TorchCommand()};
}

Finding FindLpipsWeights() {
  const fs::path folder = LpipsFolder();
  std::string found;
  for (const LpipsNet net : {LpipsNet::kAlex, LpipsNet::kVgg, LpipsNet::kSqueeze}) {
    const auto weights = ReadLpipsWeights(net, folder);
    if (weights.ok()) {
      found += Cat(found.empty() ? "" : ", ", LpipsNetName(net));
    } else if (weights.error().code != ErrorCode::kNotFound) {
      return {"LPIPS weights", kBroken, weights.error().message, FetchCommand()};
    }
  }
  if (found.empty()) return {"LPIPS weights", kMissing, Cat("none in ", folder.string()), FetchCommand()};
  return {"LPIPS weights", kReady, Cat(found, " in ", folder.string()), ""};
}

}  // namespace

std::vector<Finding> LabFindings() { return {FindTraining(), FindLpips(), FindLpipsWeights()}; }

}  // namespace anchorsplat
