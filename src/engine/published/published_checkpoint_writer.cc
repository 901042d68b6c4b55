#include "published/published_checkpoint_writer.h"

#include "tensors/safetensors.h"

namespace anchorsplat {

Status ConvertCheckpoint(const std::filesystem::path& from, const std::filesystem::path& to,
                         const WriteOptions& options) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Checkpoint checkpoint, Checkpoint::Open(from));
  std::map<std::string, std::string> metadata = checkpoint.file().metadata();
  for (const auto& [key, value] : ArchitectureMetadata(checkpoint.config())) metadata[key] = value;
  return WriteSafetensors(to, checkpoint.file().tensors(), metadata, options);
}

}  // namespace anchorsplat
