#include "model/checkpoint_writer.h"

#include "core/text.h"
#include "formats/safetensors.h"

namespace anchorsplat {

namespace {

std::string List(const std::vector<int64_t>& values) {
  std::string out;
  for (const int64_t value : values) out += (out.empty() ? "" : ",") + std::to_string(value);
  return out;
}

}  // namespace

std::map<std::string, std::string> ArchitectureMetadata(const NetworkConfig& config) {
  return {{"architecture", "AnchorSplat: Point Transformer V3 U-Net and six residual heads"},
          {"K", std::to_string(config.copies)},
          {"epsilon", Cat(kAnchorOffsetScale)},
          {"grid_resolution", std::to_string(kGridResolution)},
          {"patch_size", std::to_string(config.patch_size)},
          {"encoder_channels", List(config.encoder_channels)},
          {"encoder_blocks", List(config.encoder_blocks)},
          {"encoder_heads", List(config.encoder_heads)},
          {"decoder_channels", List(config.decoder_channels)},
          {"decoder_blocks", List(config.decoder_blocks)},
          {"decoder_heads", List(config.decoder_heads)}};
}

Status ConvertCheckpoint(const std::filesystem::path& from, const std::filesystem::path& to,
                         const WriteOptions& options) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Checkpoint checkpoint, Checkpoint::Open(from));
  std::map<std::string, std::string> metadata = checkpoint.file().metadata();
  for (const auto& [key, value] : ArchitectureMetadata(checkpoint.config())) metadata[key] = value;
  return WriteSafetensors(to, checkpoint.file().tensors(), metadata, options);
}

}  // namespace anchorsplat
