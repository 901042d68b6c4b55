#include "cli/lab.h"

#include <string>
#include <vector>

#include "core/log.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr const char* kWithout = "this program was built without the lab";
constexpr const char* kCommand = "make build in a checkout of the sources";

// Accepts any words: their options are not declared here.
void AddMissingVerb(CLI::App& app, Program& program, const std::string& name) {
  CLI::App& verb = AddVerb(app, program, name, Cat("Not available: ", kWithout), "anchorsplat doctor");
  verb.allow_extras();
  verb.callback([&program, name] {
    program.run = [name]() -> Status {
      return Error{ErrorCode::kNotFound, Cat(name, " is missing: ", kWithout, " (", kCommand, ")")};
    };
  });
}

}  // namespace

void AddEval(CLI::App& app, Program& program) { AddMissingVerb(app, program, "eval"); }
void AddViews(CLI::App& app, Program& program) { AddMissingVerb(app, program, "views"); }
void AddDataset(CLI::App& app, Program& program) { AddMissingVerb(app, program, "dataset"); }
void AddTrain(CLI::App& app, Program& program) { AddMissingVerb(app, program, "train"); }
void AddBench(CLI::App& app, Program& program) { AddMissingVerb(app, program, "bench"); }

bool LooksLikeMesh(const std::string&) { return false; }

Status RunMeshInfo(const std::string& address, const SharedFlags&) {
  return Error{ErrorCode::kNotFound, Cat(address, ": cannot read meshes: ", kWithout)};
}

Result<PictureDistance> OpenLpipsDistance(const std::string& net, const std::string&) {
  if (net.empty()) return PictureDistance();
  const std::string missing = Cat("LPIPS missing: ", kWithout);
  if (net != kLpipsIfThere) {
    return Error{ErrorCode::kNotFound, Cat(missing, "; --lpips if-there continues without it")};
  }
  LogWarning(missing);
  return PictureDistance();
}

std::vector<Finding> LabFindings() {
  std::vector<Finding> findings;
  for (const char* name : {"training", "LPIPS", "LPIPS weights"}) {
    findings.push_back({name, kMissing, "built without the lab", kCommand});
  }
  return findings;
}

}  // namespace anchorsplat
