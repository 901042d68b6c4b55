#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "core/result.h"
#include "model/published/published_config.h"
#include "model/published/published_network.h"
#include "model/shared/weights.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

// What the metadata of a checkpoint says about its architecture, read off its tensors: architecture, K, epsilon,
// grid_resolution, patch_size, encoder and decoder widths, blocks and heads.
std::map<std::string, std::string> ArchitectureMetadata(const PublishedConfig& config);

// A file of the network's weights (.pth of torch.save, .safetensors), checked against the network it describes.
class Checkpoint {
 public:
  // K, widths, stages and blocks are read from the tensors' shapes. Errors: those of TensorFile::Open; kBadFile with
  // the path when the file is no AnchorSplat checkpoint, when tensors are missing or belong to nothing (named), or when
  // one has another shape than its neighbours ask for (named, with both shapes). Tensors called num_batches_tracked may
  // be absent: inference does not need them. Metadata that says another architecture is kBadFile too: heads, patch size
  // and ε are in no shape. Values are looked at when they are loaded.
  static Result<Checkpoint> Open(const std::filesystem::path& path);

  const PublishedConfig& config() const { return config_; }
  const TensorFile& file() const { return file_; }

  // Reads from the file, which this object must outlive. Errors are those of TensorFile::ReadFloat32.
  WeightSource Weights() const;

 private:
  Checkpoint(TensorFile file, PublishedConfig config) : file_(std::move(file)), config_(std::move(config)) {}

  TensorFile file_;
  PublishedConfig config_;
};

// The network of a checkpoint, ready for inference. Errors: of Checkpoint::Open; weights that are NaN or infinite.
Result<PublishedNetwork> LoadPublishedNetwork(const std::filesystem::path& path,
                                              WeightPrecision precision = WeightPrecision::kFloat);

}  // namespace anchorsplat
