#include "compact/compact_output.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "core/row_arrays.h"
#include "core/row_scatter.h"
#include "enhance/gaussian_budget.h"

namespace anchorsplat {

namespace {

constexpr int64_t kPieceRows = int64_t{1} << 20;

// Floats per Gaussian of kCloudArrays.
std::array<int64_t, 5> Widths(const GaussianCloud& cloud) { return {3, 3, 4, 1, cloud.sh_stride()}; }

// Counts the keys less than a given one.
class Ranks {
 public:
  explicit Ranks(int64_t keys) : bits_(static_cast<size_t>((keys + 63) / 64), 0) {}
  void Add(int64_t key) { bits_[static_cast<size_t>(key / 64)] |= uint64_t{1} << (key % 64); }
  void Count() {
    before_.resize(bits_.size());
    int32_t sum = 0;
    for (size_t i = 0; i < bits_.size(); ++i) {
      before_[i] = sum;
      sum += std::popcount(bits_[i]);
    }
  }
  int32_t Of(int64_t key) const {
    const auto word = static_cast<size_t>(key / 64);
    return before_[word] + std::popcount(bits_[word] & ((uint64_t{1} << (key % 64)) - 1));
  }

 private:
  Buffer<uint64_t> bits_;
  Buffer<int32_t> before_;
};

}  // namespace

CompactOutput::CompactOutput(int64_t count, int64_t copies, const CopyChoice& choice)
    : count_(count),
      copies_(copies),
      choice_(choice),
      defers_merging_(choice.max_gaussians > 0 && choice.max_gaussians < count * copies),
      merges_(copies > 1 && (defers_merging_ || choice.copies != copies)) {
  if (!defers_merging_) choice_.max_gaussians = 0;
}

CompactOutput::Piece& CompactOutput::PieceFor(int64_t rows, const GaussianCloud& block) {
  if (!pieces_.empty() &&
      pieces_.back().cloud.opacity_logits.capacity() >= static_cast<size_t>(pieces_.back().cloud.size() + rows)) {
    return pieces_.back();
  }
  Piece& piece = pieces_.emplace_back();
  const int64_t room = std::max(rows, std::min(kPieceRows, count_ * copies_));
  piece.cloud.sh_degree = block.sh_degree;
  piece.cloud.render_mode = block.render_mode;
  for (size_t a = 0; a < kCloudArrays.size(); ++a) {
    (piece.cloud.*kCloudArrays[a]).reserve(static_cast<size_t>(room * Widths(block)[a]));
  }
  piece.keys.reserve(static_cast<size_t>(room));
  return piece;
}

void CompactOutput::Add(const Buffer<int32_t>& rows, CopyGroups groups, GaussianCloud& block) {
  std::swap(part_.cloud, block);
  Merge(rows, groups, part_);
  Append(part_, std::move(groups));
  std::swap(part_.cloud, block);
}

void CompactOutput::Merge(const Buffer<int32_t>& rows, CopyGroups& groups, CompactPart& part) {
  GaussianCloud& block = part.cloud;
  part.copied = groups.count;
  part.made = block.size() - (groups.stand_ins ? part.copied : 0);
  part.keys.clear();
  for (int64_t k = 0; k < copies_ + (groups.stand_ins ? 1 : 0); ++k) {
    for (int64_t g = 0; g < part.copied; ++g) part.keys.push_back(k * count_ + rows[static_cast<size_t>(g)]);
  }
  for (auto alone = static_cast<size_t>(part.copied); alone < rows.size(); ++alone) {
    part.keys.push_back(copies_ * count_ + rows[alone]);
  }
  if (!merges_ || defers_merging_ || part.copied == 0) return;
  const bool stand_ins = groups.stand_ins;
  const CopyPlan plan(std::move(groups), choice_, block);
  if (plan.merged() == 0 && !stand_ins) return;
  std::vector<char> keep(static_cast<size_t>(block.size()), 1);
  plan.ApplyTo(block, keep);
  KeepMarked(keep, block);
  KeepRows(part.keys, 1, keep);
}

void CompactOutput::Append(const CompactPart& part, CopyGroups groups) {
  Piece& piece = PieceFor(part.cloud.size(), part.cloud);
  const int64_t first = piece.cloud.size();
  for (const auto array : kCloudArrays) {
    const Buffer<float>& from = part.cloud.*array;
    (piece.cloud.*array).insert((piece.cloud.*array).end(), from.begin(), from.end());
  }
  piece.keys.insert(piece.keys.end(), part.keys.begin(), part.keys.end());
  Plan(part, first, std::move(groups));
}

void CompactOutput::Take(CompactPart part, CopyGroups groups) {
  pieces_.push_back({std::move(part.cloud), std::move(part.keys)});
  Plan(part, 0, std::move(groups));
}

// Plans the merges of the part added last, if deferred. It begins at row `first` of the last piece.
void CompactOutput::Plan(const CompactPart& part, int64_t first, CopyGroups groups) {
  made_ += part.made;
  if (!merges_ || !defers_merging_ || part.copied == 0) return;
  const Piece& piece = pieces_.back();
  groups.first = first;
  plans_.emplace_back(std::move(groups), choice_, piece.cloud);
  piece_of_plan_.push_back(pieces_.size() - 1);
  const auto keys = piece.keys.begin() + first;
  rows_of_plan_.emplace_back(keys, keys + part.copied);  // of copy 0
}

void CompactOutput::MergeAll() {
  int64_t merged = 0;
  for (const CopyPlan& plan : plans_) merged += plan.merged();
  if (const int64_t over = made_ - merged - choice_.max_gaussians; defers_merging_ && over > 0) {
    MergeMore(plans_, over,
              [&](size_t plan, int64_t group) { return int64_t{rows_of_plan_[plan][static_cast<size_t>(group)]}; });
  }
  for (size_t p = 0, first = 0; p < pieces_.size(); ++p) {
    Piece& piece = pieces_[p];
    std::vector<char> keep(static_cast<size_t>(piece.cloud.size()), 1);
    for (; first < plans_.size() && piece_of_plan_[first] == p; ++first) plans_[first].ApplyTo(piece.cloud, keep);
    KeepMarked(keep, piece.cloud);
    KeepRows(piece.keys, 1, keep);
  }
  plans_.clear();
  rows_of_plan_.clear();
}

GaussianCloud CompactOutput::Finish(ChosenCopies& chosen) {
  if (!plans_.empty()) MergeAll();
  GaussianCloud out;
  Ranks ranks((copies_ + 1) * count_);
  int64_t total = 0;
  for (const Piece& piece : pieces_) {
    total += piece.cloud.size();
    for (const int64_t key : piece.keys) ranks.Add(key);
  }
  ranks.Count();
  Buffer<int32_t> places;
  places.reserve(static_cast<size_t>(total));
  for (Piece& piece : pieces_) {
    for (const int64_t key : piece.keys) places.push_back(ranks.Of(key));
    piece.keys = {};
  }
  for (size_t a = 0; a < kCloudArrays.size() && !pieces_.empty(); ++a) {
    out.sh_degree = pieces_.front().cloud.sh_degree;
    out.render_mode = pieces_.front().cloud.render_mode;
    std::vector<std::span<const float>> arrays;
    for (const Piece& piece : pieces_) arrays.emplace_back(piece.cloud.*kCloudArrays[a]);
    out.*kCloudArrays[a] = ScatterRows(arrays, Widths(out)[a], places);
    for (Piece& piece : pieces_) piece.cloud.*kCloudArrays[a] = {};
  }
  chosen.merged = made_ - total;
  chosen.left_out = DropLeastVisible(choice_.max_gaussians, out);
  pieces_.clear();
  return out;
}

}  // namespace anchorsplat
