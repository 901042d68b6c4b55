#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "model/compact/copy_group.h"

namespace anchorsplat {

// What a merge may cost where nobody says otherwise: pixels of the closer view times the square of a colour in 0–1, of
// MergeCost(). Chosen on training objects (docs/results/copies.md).
inline constexpr double kMergeCost = 1e-4;
// Of the network for standard fits: each Gaussian that goes costs them less.
inline constexpr double kMergeCostOfStandard = 1e-3;
// Where refinement goes on: what it begins with has to show all, and is split again.
inline constexpr double kMergeCostOfStart = 2e-5;

// What a stand-in's difference from the copies counts for. It was trained to look like the truth and not like them, so
// that most of the difference is none of the truth's. Chosen on training objects, too.
inline constexpr double kStandInShare = 0.2;

// How many of a network's copies live.
struct CopyChoice {
  std::optional<int64_t> copies =
      std::nullopt;                // at most so many of each Gaussian; nothing: as many as cost more than `merge_cost`
  double merge_cost = kMergeCost;  // ≥ 0
  int64_t max_gaussians = 0;       // in all; 0: no bound
  float invisible = 0;             // copies of less opacity go first, and 1/255 at least
};

// Errors (kBadArgument): more copies than a network makes (`made`), or less than one; a cost or a bound that is
// negative.
Status Validate(const CopyChoice& choice, int64_t made);

// Copies of `count` Gaussians: copy k of the g-th is row first + k·count + g of a cloud. With stand-ins, row
// first + copies·count + g is one that can take the place of all copies of the g-th; otherwise it goes.
struct CopyGroups {
  int64_t count = 0;
  int64_t copies = 1;             // 1–64
  Buffer<float> pixel_sizes;      // of the closer view, world units, one for all or one per group
  std::vector<char> single = {};  // not 0: all its copies are merged into one; one per group, empty: none
  int64_t first = 0;
  bool stand_ins = false;
};

// Merges copies of one Gaussian, always the pair that can be spared best (model/compact/merge_gaussians.h): until the
// next pair would cost too much or there are no more than CopyChoice::copies. Where max_gaussians is set, it knows what
// the merges beyond that cost as well. A stand-in takes the place of all copies that are left where that is worth it:
// where its cost, less that of the merges before, is no more than merge_cost for each Gaussian that it saves; and
// wherever one copy is to stay. The same bits for any number of threads.
class CopyPlan {
 public:
  CopyPlan(CopyGroups groups, const CopyChoice& choice, const GaussianCloud& cloud);

  int64_t groups() const { return groups_.count; }
  int64_t merged() const;  // copies that go, but for one where a stand-in comes

  // Writes the merged copies into the rows of `cloud` that stay, and 0 into keep[row] of the others: copies that are
  // gone, and stand-ins for which there is no need. `into`, where it is asked for, one per row: of merged groups what
  // CopyGroup::Write says.
  void Carry(GaussianCloud& cloud, std::vector<char>& keep, std::vector<int64_t>* into = nullptr) const;

 private:
  friend void MergeMore(std::span<CopyPlan> plans, int64_t more,
                        const std::function<int64_t(size_t plan, int64_t group)>& row);

  double PixelOf(int64_t g) const {
    return groups_.pixel_sizes[groups_.pixel_sizes.size() == 1 ? 0 : static_cast<size_t>(g)];
  }
  const CopyGroup::Step* StepsOf(int64_t g) const { return steps_.data() + g * (groups_.copies - 1); }
  int64_t StandInOf(int64_t g) const { return groups_.first + groups_.copies * groups_.count + g; }
  bool StandsIn(int64_t g) const {
    return groups_.stand_ins && usable_[static_cast<size_t>(g)] != 0 &&
           chosen_[static_cast<size_t>(g)] == groups_.copies - 1;
  }
  CopyGroup::Step* StepsOf(int64_t g) { return steps_.data() + g * (groups_.copies - 1); }

  CopyGroups groups_;
  float invisible_;
  Buffer<CopyGroup::Step> steps_;
  Buffer<uint8_t> chosen_;  // steps of each group that are done
  Buffer<uint8_t> usable_;  // whether each group's stand-in can be one; empty: there are none
};

// Adds the cheapest merges that none of the plans has, `more` of them or all there are: at least one copy of each
// Gaussian stays. Of equally cheap ones those of the first Gaussians, by row(plan, group), which is unique.
void MergeMore(std::span<CopyPlan> plans, int64_t more, const std::function<int64_t(size_t plan, int64_t group)>& row);

}  // namespace anchorsplat
