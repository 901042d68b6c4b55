#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "compact/compact_output.h"
#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

struct CompactTask;

// The output of one block.
struct CompactBlockResult {
  int64_t block = 0;
  int64_t unlike_training = 0, partly_unlike_training = 0, not_finite = 0;  // as in CompactResult
  CompactPart part;
};

// Everything that distinguishes this run from others, as a flat JSON object. `network`: fingerprint of the weights of
// the network and, if used, of the stand-in network.
std::string CheckpointSettings(const std::string& network, const GaussianCloud& cloud, const CompactTask& task);

// Whether a result read from a file can be block `result.block` of this run: its rows are that block's Gaussians, none
// twice, with all copies if `merging_deferred` and all stand-ins if `stand_ins`. `places`: rows of the input in block
// order, `block_gaussians` per block.
bool FitsBlock(const CompactBlockResult& result, const Buffer<int32_t>& places, int64_t block_gaussians, int64_t copies,
               bool merging_deferred, bool stand_ins);

// Saves finished blocks to a file, one after another, so that an interrupted run can resume with the same settings.
// Every block has a checksum. Reading stops at the first torn or damaged block; that one and all later ones are
// computed again.
//
// One run uses the file at a time (fit/checkpoint_guard.h). Whoever writes the final result deletes it.
class CompactCheckpoint {
 public:
  // Opens the file to resume from it. Replaces it with an empty one if `resume` is false or the file is missing.
  // `settings`: from CheckpointSettings.
  // Errors: kBadArgument if it belongs to another run (names the setting that differs); kBadFile if it is no checkpoint
  // of a network, or damaged; kIo; those of OutputFile.
  static Result<CompactCheckpoint> Open(const std::filesystem::path& path, const std::string& settings, bool resume);

  CompactCheckpoint(CompactCheckpoint&& other) noexcept;
  CompactCheckpoint& operator=(CompactCheckpoint&&) = delete;
  ~CompactCheckpoint();

  // Reads the next block; false if no intact one is left. `of`: the input cloud, for SH degree and render mode.
  Result<bool> Next(const GaussianCloud& of, CompactBlockResult& result);

  // Writes after the last block that Next read. If writing fails (disk full), warns once, keeps what is there and
  // ignores later calls.
  void Append(const CompactBlockResult& result);

 private:
  CompactCheckpoint(std::filesystem::path path, int descriptor, uint64_t at, uint64_t size)
      : path_(std::move(path)), descriptor_(descriptor), at_(at), size_(size) {}

  std::filesystem::path path_;
  int descriptor_ = -1;
  uint64_t at_ = 0;    // end of the last intact block
  uint64_t size_ = 0;  // of the file
  bool full_ = false;
};

// Whether the file starts like a checkpoint. If so, registers it as the command's own (io/input_record.h).
bool IsCompactCheckpoint(const std::filesystem::path& path);

}  // namespace anchorsplat
