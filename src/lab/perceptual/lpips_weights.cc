#include "perceptual/lpips_weights.h"

#include <cstdlib>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "core/file_system.h"
#include "core/text.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFeatures = "features.";

// Finds a tensor; a backbone saved as its `features` alone lacks the prefix.
const TensorEntry* FindTensor(const TensorFile& file, const std::string& name) {
  if (const TensorEntry* entry = file.Find(name)) return entry;
  if (!name.starts_with(kFeatures)) return nullptr;
  return file.Find(std::string_view(name).substr(kFeatures.size()));
}

Result<Buffer<float>> ReadTensor(std::span<const TensorFile> files, const LpipsTensorSpec& spec) {
  for (const TensorFile& file : files) {
    const TensorEntry* entry = FindTensor(file, spec.name);
    if (entry == nullptr) continue;
    if (entry->shape != spec.shape) {
      TensorEntry wanted;
      wanted.shape = spec.shape;
      return Error{ErrorCode::kBadFile, Cat(file.name(), ": tensor \"", entry->name, "\" has the shape ",
                                            entry->ShapeText(), ", LPIPS needs ", wanted.ShapeText())};
    }
    auto values = CopyFloat32(*entry);
    const Status finite = values.ok() ? CheckFinite(spec.name, *values) : Status(values.error());
    if (!finite.ok()) return Error{finite.error().code, Cat(file.name(), ": ", finite.error().message)};
    return values;
  }
  return Error{ErrorCode::kBadFile, Cat(files.front().name(), ": there is no tensor \"", spec.name, "\"",
                                        files.size() > 1 ? Cat(" (nor in ", files.back().name(), ")") : std::string())};
}

}  // namespace

fs::path LpipsFolder() {
  const auto variable = [](const char* name) -> std::optional<fs::path> {
    const char* value = std::getenv(name);
    if (value == nullptr || *value == 0) return std::nullopt;
    return fs::path(value);
  };
  if (const auto folder = variable("ANCHORSPLAT_LPIPS")) return *folder;
  const fs::path below = fs::path("anchorsplat") / "lpips";
  if (const auto data = variable("XDG_DATA_HOME")) return *data / below;
  return variable("HOME").value_or(fs::path()) / ".local" / "share" / below;
}

Result<LpipsWeights> ReadLpipsWeights(LpipsNet net, const fs::path& folder) {
  const std::string name = LpipsNetName(net);
  const fs::path whole = folder / (name + ".safetensors");
  const fs::path backbone = folder / (name + ".backbone.pth"), heads = folder / (name + ".heads.pth");
  std::vector<TensorFile> files;
  if (Exists(whole)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(TensorFile file, TensorFile::Open(whole));
    files.push_back(std::move(file));
  } else if (Exists(backbone) && Exists(heads)) {
    for (const fs::path& path : {backbone, heads}) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(TensorFile file, TensorFile::Open(path));
      files.push_back(std::move(file));
    }
  } else {
    return Error{ErrorCode::kNotFound,
                 Cat("LPIPS missing: no weights of ", name, " in ", folder.string(), "; run scripts/fetch-lpips.sh")};
  }
  LpipsWeights weights{net, {}};
  for (const LpipsTensorSpec& spec : LpipsTensors(net)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(Buffer<float> values, ReadTensor(files, spec));
    weights.tensors.push_back(std::move(values));
  }
  return weights;
}

}  // namespace anchorsplat
