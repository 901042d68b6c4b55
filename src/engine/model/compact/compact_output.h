#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "model/compact/copy_choice.h"

namespace anchorsplat {

// All that a cloud has per Gaussian.
inline constexpr std::array<Buffer<float> GaussianCloud::*, 5> kCloudArrays = {
    &GaussianCloud::means, &GaussianCloud::log_scales, &GaussianCloud::quats, &GaussianCloud::opacity_logits,
    &GaussianCloud::sh};

struct ChosenCopies {
  int64_t merged = 0;    // copies that are gone: others stand for them, or they were invisible
  int64_t left_out = 0;  // Gaussians that are gone, as there are more than max_gaussians without copies
};

// What a network makes of a block.
struct CompactPart {
  Buffer<int64_t> keys;  // by which the rows of all blocks are ordered: k·count + g of copy k of Gaussian g of the
                         // input, copies·count + g of a stand-in for its copies, and of one that stands alone
  GaussianCloud cloud;
  int64_t inside = 0;  // Gaussians that have copies; where all of these are there, the rows of copy 0 come first
  int64_t made = 0;    // rows before copies were merged, without stand-ins
};

// What a network makes of a splat, gathered block by block in any order. Copies are merged as soon as their block is
// there, and what is left is written one behind the other and put in order once, at the end. Where max_gaussians may be
// less than all copies, these wait for the last block: what is cheapest among all is not known before.
class CompactOutput {
 public:
  // `count` Gaussians become at most `copies` each.
  CompactOutput(int64_t count, int64_t copies, const CopyChoice& choice);

  // Of the block's first groups.count Gaussians copy k of all before copy k + 1, then their stand-ins, if there are,
  // then one of each of the others.
  // `rows`: all its Gaussians in the input. The block is used up, but keeps its memory.
  void Add(const Buffer<int32_t>& rows, CopyGroups groups, GaussianCloud& block);

  // The same in two steps, between which a part may be kept for another run: merges what can be merged now …
  void Merge(const Buffer<int32_t>& rows, CopyGroups& groups, CompactPart& part);
  // … and adds what is left. `groups` are those of Merge; of a part that was kept made anew.
  void Append(const CompactPart& part, CopyGroups groups);
  // Append without a copy, which takes memory for as much once more: of what is the only part there is.
  void Take(CompactPart part, CopyGroups groups);

  // Whether all copies wait for the last block, so that parts have all of them.
  bool waits() const { return waits_; }

  // Copy k of all Gaussians before copy k + 1, then stand-ins and those that stand alone, each in the order of the
  // input.
  GaussianCloud Finish(ChosenCopies& chosen);

 private:
  struct Piece {
    GaussianCloud cloud;
    Buffer<int64_t> keys;  // by which rows are ordered
  };
  Piece& PieceFor(int64_t rows, const GaussianCloud& block);
  void Plan(const CompactPart& part, int64_t first, CopyGroups groups);
  void MergeAll();

  int64_t count_, copies_;
  CopyChoice choice_;
  bool waits_, merges_;
  int64_t made_ = 0;
  std::vector<Piece> pieces_;
  std::vector<CopyPlan> plans_;        // that wait
  std::vector<size_t> piece_of_plan_;  // ascending
  std::vector<Buffer<int32_t>> rows_of_plan_;
  CompactPart part_;
};

}  // namespace anchorsplat
