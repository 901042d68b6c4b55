#include "model/network_findings.h"

#include <span>
#include <utility>
#include <vector>

#include "compact/compact_network.h"
#include "core/file_system.h"
#include "formats/gsplat_checkpoint/gsplat_checkpoint.h"
#include "io/input_file.h"
#include "published/published_checkpoint_writer.h"
#include "reading/reading_model.h"
#include "tensors/tensor_file.h"
#include "upscale/upscaler.h"

namespace anchorsplat {

namespace {

struct ModelFindings {
  std::map<std::string, std::string> facts;
  std::vector<TensorSpec> learned;  // tensors of parameters
  size_t tensors = 0;               // all
};

Result<ModelFindings> LookAtCompactNetwork(const TensorFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const CompactNetwork network, LoadCompactNetwork(file));
  ModelFindings found{file.metadata(), CompactTensors(network.config()), file.tensors().size()};
  std::erase_if(found.learned, [](const TensorSpec& tensor) { return tensor.name.starts_with("domain."); });
  for (const auto& [key, value] : ToMetadata(network.config())) found.facts[key] = value;
  return found;
}

Result<ModelFindings> LookAtCheckpoint(const std::string& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Checkpoint checkpoint, Checkpoint::Open(path));
  ModelFindings found{checkpoint.file().metadata(), PublishedTensors(checkpoint.config()),
                      checkpoint.file().tensors().size()};
  std::erase_if(found.learned, [](const TensorSpec& tensor) {
    return tensor.counter || tensor.name.ends_with("running_mean") || tensor.name.ends_with("running_var");
  });
  for (const auto& [key, value] : ArchitectureMetadata(checkpoint.config())) found.facts[key] = value;
  return found;
}

// The program's other networks; `kind` says what for.
ModelFindings LookAtOther(const TensorFile& file, const std::string& kind) {
  ModelFindings found{file.metadata(), {}, file.tensors().size()};
  found.facts.erase("features");  // hundreds of names: bench reading --features
  found.facts["kind"] = kind;
  for (const TensorEntry& tensor : file.tensors()) found.learned.push_back({tensor.name, tensor.shape});
  return found;
}

Result<ModelFindings> LookAt(const std::string& path, const TensorFile& file) {
  if (IsCompactNetwork(file)) return LookAtCompactNetwork(file);
  if (ReadingModel::Load(file).ok()) return LookAtOther(file, "reads splats");
  if (Upscaler::Read(path).ok()) return LookAtOther(file, "enlarges pictures");
  return LookAtCheckpoint(path);
}

}  // namespace

bool LooksLikeNetwork(const std::filesystem::path& path) {
  if (!IsFile(path)) return false;  // a pipe can be read only once
  const auto in = InputFile::Open(path);
  const auto beginning = in.ok() ? in->Head(16) : Result<std::string>(in.error());
  if (!beginning.ok() || !LooksLikeTensorFile(std::as_bytes(std::span(*beginning)))) return false;
  const auto file = TensorFile::Open(path);
  if (file.ok()) return !HoldsGaussians(*file);
  const std::filesystem::path extension = path.extension();
  return extension == ".pth" || extension == ".safetensors";  // a broken one
}

Result<NetworkFindings> InspectNetwork(const std::string& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorFile file, TensorFile::Open(path));
  ANCHORSPLAT_ASSIGN_OR_RETURN(ModelFindings found, LookAt(path, file));
  NetworkFindings findings{path, std::move(found.facts), found.tensors, 0};
  for (const TensorSpec& tensor : found.learned) {
    int64_t size = 1;
    for (const int64_t side : tensor.shape) size *= side;
    findings.parameters += size;
  }
  return findings;
}

}  // namespace anchorsplat
