#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "compact/copy_group.h"
#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// Default maximum cost of a merge (MergeCost): closer-view pixels × squared colour difference, colours 0–1. Chosen on
// training objects (docs/benchmarks.md#copies).
inline constexpr double kMergeCost = 3e-4;
// Default when refinement follows: its starting splat must show everything and is densified again.
inline constexpr double kMergeCostOfStart = 2e-5;

// Weight of a stand-in's difference from the copies. The stand-in was trained to match the truth, not the copies, so
// most of that difference is no error. Chosen on training objects.
inline constexpr double kStandInShare = 0.2;

// How many of a network's copies stay.
struct CopyChoice {
  std::optional<int64_t> copies = std::nullopt;  // at most this many per Gaussian; unset: while merges cost more than
                                                 // `merge_cost`
  double merge_cost = kMergeCost;                // ≥ 0
  int64_t max_gaussians = 0;                     // in total; 0: no limit
  float invisible = 0;                           // copies below this opacity, and at least 1/255, go first
};

// Errors (kBadArgument): copies outside 1 … `made` (what the network makes); a negative cost or limit.
Status Validate(const CopyChoice& choice, int64_t made);

// Layout of the copies of `count` Gaussians in a cloud: copy k of Gaussian g is row first + k·count + g. With
// stand-ins, row first + copies·count + g may replace all copies of g, and is dropped if it does not.
struct CopyGroups {
  int64_t count = 0;
  int64_t copies = 1;             // 1–64
  Buffer<float> pixel_sizes;      // of the closer view, world units, one for all or one per group
  std::vector<char> single = {};  // one per group; not 0: merge all its copies into one. Empty: none
  int64_t first = 0;
  bool stand_ins = false;
};

// Plans which copies of each Gaussian to merge, cheapest pair first (compact/merge_gaussians.h), until the next
// merge costs too much and no more than CopyChoice::copies are left. With max_gaussians set it also records the costs
// of further merges. A stand-in replaces the remaining copies if its cost, minus that of the merges done, is at most
// merge_cost per Gaussian saved; and whenever only one copy is to stay. The same bits for any number of threads.
class CopyPlan {
 public:
  CopyPlan(CopyGroups groups, const CopyChoice& choice, const GaussianCloud& cloud);

  int64_t groups() const { return groups_.count; }
  int64_t merged() const;  // Gaussians saved: copies removed, minus stand-ins used

  // Writes merged copies to the rows of `cloud` that stay and sets keep[row] = 0 for removed copies and unused
  // stand-ins. `into`, if not null, has one entry per row and is filled for merged groups as CopyGroup::Write does.
  void ApplyTo(GaussianCloud& cloud, std::vector<char>& keep, std::vector<int64_t>* into = nullptr) const;

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
  Buffer<uint8_t> chosen_;  // number of steps to apply per group
  Buffer<uint8_t> usable_;  // whether each group's stand-in is valid; empty without stand-ins
};

// Adds the `more` cheapest merges not yet planned, or all there are; one copy of each Gaussian stays. Ties go to the
// smallest row(plan, group), which must be unique.
void MergeMore(std::span<CopyPlan> plans, int64_t more, const std::function<int64_t(size_t plan, int64_t group)>& row);

}  // namespace anchorsplat
