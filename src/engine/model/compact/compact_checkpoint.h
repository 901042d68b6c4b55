#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "model/compact/compact_output.h"

namespace anchorsplat {

struct CompactTask;

// What one block of a network's run came to.
struct CompactBlockResult {
  int64_t block = 0;
  int64_t outside = 0, partly = 0, not_finite = 0;  // as of CompactResult
  CompactPart part;
};

// All by which a run differs from another, as one JSON object of one level. `network`: fingerprint of its weights, and
// of those of the stand-ins.
std::string CheckpointSettings(const std::string& network, const GaussianCloud& cloud, const CompactTask& task);

// Whether what a file says is of a block of this run: rows of the block's own Gaussians, none twice, and all copies
// where they wait for the last block, with `stand_ins` those, too. `places`: of the input's Gaussians in the order of
// the blocks, of `block_gaussians` each.
bool IsOfBlock(const CompactBlockResult& result, const Buffer<int32_t>& places, int64_t block_gaussians, int64_t copies,
               bool waits, bool stand_ins);

// What the blocks of a network's run have made, one behind the other in a file, so that a run that ends before its end,
// in whatever way, is not lost: another one with the same settings reads them and makes the rest. Every block has a
// checksum. What a kill tore apart at the end, or what was damaged, is as if it had not been made, and what is behind
// it as well.
//
// The file belongs to one run at a time (fit/checkpoint_guard.h), and whoever wrote the result removes it.
class CompactCheckpoint {
 public:
  // Without `resume`, or where there is no file, an empty one takes the place of what is there. `settings`: all by
  // which a run differs from another, as one JSON object of one level. Errors: kBadArgument: it is of another run, with
  // the name of what differs; kBadFile: it is no checkpoint of a network, or a damaged one; kIo; those of OutputFile.
  static Result<CompactCheckpoint> Open(const std::filesystem::path& path, const std::string& settings, bool resume);

  CompactCheckpoint(CompactCheckpoint&& other) noexcept;
  CompactCheckpoint& operator=(CompactCheckpoint&&) = delete;
  ~CompactCheckpoint();

  // The next block; false: there is none that is whole. `of`: what it belongs to, for its degree and mode.
  Result<bool> Next(const GaussianCloud& of, CompactBlockResult& result);

  // Writes behind the last block that Next found. What cannot be written, as the disk is full, is a warning: then the
  // file stays as it is, and nothing more is written.
  void Append(const CompactBlockResult& result);

 private:
  CompactCheckpoint(std::filesystem::path path, int descriptor, uint64_t at, uint64_t size)
      : path_(std::move(path)), descriptor_(descriptor), at_(at), size_(size) {}

  std::filesystem::path path_;
  int descriptor_ = -1;
  uint64_t at_ = 0;    // end of the last block that is whole
  uint64_t size_ = 0;  // of the file
  bool full_ = false;
};

// Whether the file is one, by its beginning; then it counts as the command's own (io/input_record.h).
bool IsCompactCheckpoint(const std::filesystem::path& path);

}  // namespace anchorsplat
