#include "model/compact/copy_choice.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/log.h"
#include "core/parallel.h"
#include "core/text.h"
#include "formats/row_arrays.h"
#include "model/compact/copy_group.h"
#include "model/shared/most_visible.h"

namespace anchorsplat {

namespace {

constexpr int64_t kGroupsPerTask = 256;

Status Check(const CopyGroups& groups, const CopyChoice& choice) {
  if (choice.copies && (*choice.copies < 1 || *choice.copies > groups.copies)) {
    return Error{ErrorCode::kBadArgument, Cat("--copies ", *choice.copies, ": the network makes ", groups.copies,
                                              ", so it is 1 to ", groups.copies, " or auto")};
  }
  if (!(choice.merge_cost >= 0) || !std::isfinite(choice.merge_cost)) {
    return Error{ErrorCode::kBadArgument, Cat("--merge-cost ", choice.merge_cost, " is not 0 or more")};
  }
  if (choice.max_gaussians < 0) {
    return Error{ErrorCode::kBadArgument, Cat("--max-gaussians ", choice.max_gaussians, " is negative")};
  }
  return {};
}

// Goes on with the next step? `alive`: before it.
bool IsWanted(const CopyChoice& choice, int64_t alive, float cost) {
  return choice.copies ? alive > *choice.copies : cost <= choice.merge_cost;
}

// Merges of all groups in the order in which each would go on, so that what they cost never falls.
class MergePlan {
 public:
  MergePlan(const CopyGroups& groups, const CopyChoice& choice, const GaussianCloud& cloud)
      : groups_(groups),
        steps_(static_cast<size_t>(groups.count * (groups.copies - 1))),
        chosen_(static_cast<size_t>(groups.count), 0) {
    ParallelFor(0, groups.count, kGroupsPerTask, [&](int64_t begin, int64_t end) {
      CopyGroup group(groups.copies, choice.invisible);
      for (int64_t g = begin; g < end; ++g) {
        group.Load(cloud, g, groups.count, groups.copies, PixelOf(g), /*colors=*/true);
        CopyGroup::Step* step = StepsOf(g);
        float most = 0;
        int64_t& chosen = chosen_[static_cast<size_t>(g)];
        bool wanted = true;
        const bool single = !groups_.single.empty() && groups_.single[static_cast<size_t>(g)] != 0;
        for (; group.alive() > 1; ++step) {
          *step = group.Next();
          step->cost = most = std::max(most, step->cost);
          wanted = wanted && (single || IsWanted(choice, group.alive(), step->cost));
          if (wanted) ++chosen;
          if (!wanted && choice.max_gaussians == 0) break;
          group.Do(*step);
        }
      }
    });
  }

  int64_t Chosen() const {
    int64_t sum = 0;
    for (const int64_t chosen : chosen_) sum += chosen;
    return sum;
  }

  // The cheapest of the others, `more` of them or all there are.
  void Add(int64_t more) {
    std::vector<float> costs;
    for (int64_t g = 0; g < groups_.count; ++g) {
      for (int64_t s = chosen_[static_cast<size_t>(g)]; s < groups_.copies - 1; ++s)
        costs.push_back(StepsOf(g)[s].cost);
    }
    if (more >= std::ssize(costs)) {
      std::fill(chosen_.begin(), chosen_.end(), groups_.copies - 1);
      return;
    }
    const auto last = costs.begin() + (more - 1);
    std::nth_element(costs.begin(), last, costs.end());
    const float most = *last;
    int64_t equal = more - std::count_if(costs.begin(), costs.end(), [&](float cost) { return cost < most; });
    for (int64_t g = 0; g < groups_.count; ++g) {
      int64_t& chosen = chosen_[static_cast<size_t>(g)];
      for (; chosen < groups_.copies - 1 && StepsOf(g)[chosen].cost <= most; ++chosen) {
        if (StepsOf(g)[chosen].cost == most && equal-- <= 0) break;
      }
    }
  }

  void Carry(const CopyChoice& choice, GaussianCloud& cloud, std::vector<char>& keep) const {
    ParallelFor(0, groups_.count, kGroupsPerTask, [&](int64_t begin, int64_t end) {
      CopyGroup group(groups_.copies, choice.invisible);
      for (int64_t g = begin; g < end; ++g) {
        const int64_t chosen = chosen_[static_cast<size_t>(g)];
        if (chosen == 0) continue;
        group.Load(cloud, g, groups_.count, groups_.copies, PixelOf(g), /*colors=*/false);
        for (int64_t s = 0; s < chosen; ++s) group.Do(StepsOf(g)[s]);
        group.Write(cloud, keep);
      }
    });
  }

 private:
  double PixelOf(int64_t g) const {
    return groups_.pixel_sizes[groups_.pixel_sizes.size() == 1 ? 0 : static_cast<size_t>(g)];
  }
  const CopyGroup::Step* StepsOf(int64_t g) const { return steps_.data() + g * (groups_.copies - 1); }
  CopyGroup::Step* StepsOf(int64_t g) { return steps_.data() + g * (groups_.copies - 1); }

  CopyGroups groups_;
  Buffer<CopyGroup::Step> steps_;
  Buffer<int64_t> chosen_;  // steps of each group that are done
};

void KeepMarked(const std::vector<char>& keep, GaussianCloud& cloud) {
  KeepRows(cloud.means, 3, keep);
  KeepRows(cloud.log_scales, 3, keep);
  KeepRows(cloud.quats, 4, keep);
  KeepRows(cloud.opacity_logits, 1, keep);
  KeepRows(cloud.sh, cloud.sh_stride(), keep);
}

}  // namespace

Result<ChosenCopies> ChooseCopies(const CopyGroups& groups, const CopyChoice& choice, GaussianCloud& cloud) {
  ANCHORSPLAT_RETURN_IF_ERROR(Check(groups, choice));
  ChosenCopies done;
  const int64_t before = cloud.size(), most = choice.max_gaussians;
  const bool all = choice.copies && *choice.copies == groups.copies && (most == 0 || before <= most);
  if (groups.count > 0 && groups.copies > 1 && !all) {
    MergePlan plan(groups, choice, cloud);
    if (const int64_t over = before - plan.Chosen() - most; most > 0 && over > 0) plan.Add(over);
    std::vector<char> keep(static_cast<size_t>(before), 1);
    plan.Carry(choice, cloud, keep);
    KeepMarked(keep, cloud);
    done.merged = before - cloud.size();
  }
  if (most > 0 && cloud.size() > most) {
    std::vector<char> keep(static_cast<size_t>(cloud.size()), 0);
    for (const int64_t row : MostVisible(cloud, most)) keep[static_cast<size_t>(row)] = 1;
    done.left_out = cloud.size() - most;
    LogWarning(Cat("--max-gaussians ", WithThousands(most), " are fewer than there are without any copies: the ",
                   WithThousands(done.left_out), " Gaussians of the least opacity × size are left out"));
    KeepMarked(keep, cloud);
  }
  return done;
}

}  // namespace anchorsplat
