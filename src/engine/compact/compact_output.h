#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compact/copy_choice.h"
#include "core/buffer.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// The per-Gaussian arrays of a cloud.
inline constexpr std::array<Buffer<float> GaussianCloud::*, 5> kCloudArrays = {
    &GaussianCloud::means, &GaussianCloud::log_scales, &GaussianCloud::quats, &GaussianCloud::opacity_logits,
    &GaussianCloud::sh};

struct ChosenCopies {
  int64_t merged = 0;    // copies removed by merging, or because they were invisible
  int64_t left_out = 0;  // Gaussians dropped because there are more than max_gaussians even without copies
};

// The output of one block.
struct CompactPart {
  Buffer<int64_t> keys;  // sort key per row. k·count + g: copy k of Gaussian g of the input; copies·count + g: its
                         // stand-in, or g itself if not copied
  GaussianCloud cloud;
  int64_t copied = 0;  // Gaussians with copies. While none is merged, the rows of copy 0 come first
  int64_t made = 0;    // rows before merging, without stand-ins
};

// Collects a network's output block by block, in any order. Merges copies as soon as their block arrives and sorts all
// rows once at the end. If max_gaussians could be exceeded, merging is deferred to the last block: only then are the
// cheapest merges of all blocks known.
class CompactOutput {
 public:
  // `count` input Gaussians, up to `copies` output Gaussians each.
  CompactOutput(int64_t count, int64_t copies, const CopyChoice& choice);

  // Adds a block. Its rows: copy k of the first groups.count Gaussians before copy k + 1, then their stand-ins if any,
  // then one for each of the others. `rows`: the block's Gaussians in the input. Consumes the block, keeps its memory.
  void Add(const Buffer<int32_t>& rows, CopyGroups groups, GaussianCloud& block);

  // Add in two steps, with a part that can be saved between them. Merges what can be merged now …
  void Merge(const Buffer<int32_t>& rows, CopyGroups& groups, CompactPart& part);
  // … and adds the rest. `groups`: as Merge left them, or rebuilt for a part read from a file.
  void Append(const CompactPart& part, CopyGroups groups);
  // Append without copying, for a single part: copying would double the memory.
  void Take(CompactPart part, CopyGroups groups);

  // Whether merging is deferred to the last block, so that parts hold all copies.
  bool defers_merging() const { return defers_merging_; }

  // Returns copy k of all Gaussians before copy k + 1, then stand-ins and uncopied Gaussians, each in input order.
  GaussianCloud Finish(ChosenCopies& chosen);

 private:
  struct Piece {
    GaussianCloud cloud;
    Buffer<int64_t> keys;  // sort keys
  };
  Piece& PieceFor(int64_t rows, const GaussianCloud& block);
  void Plan(const CompactPart& part, int64_t first, CopyGroups groups);
  void MergeAll();

  int64_t count_, copies_;
  CopyChoice choice_;
  bool defers_merging_, merges_;
  int64_t made_ = 0;
  std::vector<Piece> pieces_;
  std::vector<CopyPlan> plans_;        // deferred
  std::vector<size_t> piece_of_plan_;  // ascending
  std::vector<Buffer<int32_t>> rows_of_plan_;
  CompactPart part_;
};

}  // namespace anchorsplat
