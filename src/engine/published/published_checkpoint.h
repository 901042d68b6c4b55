#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "core/result.h"
#include "network/weights.h"
#include "published/published_config.h"
#include "published/published_network.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

// Architecture metadata for a checkpoint: architecture, K, epsilon, grid_resolution, patch_size, encoder and decoder
// widths, blocks and heads.
std::map<std::string, std::string> ArchitectureMetadata(const PublishedConfig& config);

// A weights file of the published network (.pth of torch.save, or .safetensors), validated against its architecture.
class Checkpoint {
 public:
  // Opens a checkpoint; K, widths, stages and blocks follow from tensor shapes. Validates names and shapes; values are
  // checked when loaded. num_batches_tracked tensors are optional: inference does not need them.
  // Errors: those of TensorFile::Open; kBadFile with the path if this is no AnchorSplat checkpoint, if tensors are
  // missing or unknown (named), if a shape contradicts the others (named, with both shapes), or if the metadata names
  // another architecture (no shape encodes heads, patch size and ε).
  static Result<Checkpoint> Open(const std::filesystem::path& path);

  const PublishedConfig& config() const { return config_; }
  const TensorFile& file() const { return file_; }

  // Reads tensors from the file; this object must outlive the source. Errors: those of TensorFile::ReadFloat32.
  WeightSource Weights() const;

 private:
  Checkpoint(TensorFile file, PublishedConfig config) : file_(std::move(file)), config_(std::move(config)) {}

  TensorFile file_;
  PublishedConfig config_;
};

// Loads a checkpoint for inference. Errors: those of Checkpoint::Open; NaN or infinite weights.
Result<PublishedNetwork> LoadPublishedNetwork(const std::filesystem::path& path,
                                              WeightPrecision precision = WeightPrecision::kFloat);

}  // namespace anchorsplat
