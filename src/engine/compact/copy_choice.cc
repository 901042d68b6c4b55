#include "compact/copy_choice.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr int64_t kGroupsPerTask = 256;

// Whether to take the next step. `alive`: copies before it.
bool IsWanted(const CopyChoice& choice, int64_t alive, float cost) {
  return choice.copies ? alive > *choice.copies : cost <= choice.merge_cost;
}

// Appends the stand-in to the merge steps. `cost`: of the stand-in, replacing the total of all steps down to one copy.
// If the steps cost no more, they stay. Otherwise the remaining cost is spread evenly over the steps from the point
// where it is steepest, which is where the convex hull of the costs meets the stand-in.
void EndWithStandIn(double cost, std::span<CopyGroup::Step> steps) {
  double before = 0, greatest = -1;
  size_t from = 0;
  for (size_t s = 0; s < steps.size(); ++s) {
    const double each = (cost - before) / static_cast<double>(steps.size() - s);
    if (each > greatest) {
      greatest = each;
      from = s;
    }
    before += double{steps[s].cost};
  }
  if (!(cost < before)) return;
  for (CopyGroup::Step& step : steps.subspan(from)) step.cost = static_cast<float>(std::max(0.0, greatest));
}

}  // namespace

Status Validate(const CopyChoice& choice, int64_t made) {
  if (choice.copies && (*choice.copies < 1 || *choice.copies > made)) {
    return Error{ErrorCode::kBadArgument, Cat("--copies ", *choice.copies, ": must be 1 to ", made,
                                              ", the number that the network makes, or auto")};
  }
  if (!(choice.merge_cost >= 0) || !std::isfinite(choice.merge_cost)) {
    return Error{ErrorCode::kBadArgument, Cat("--merge-cost ", choice.merge_cost, " is not 0 or more")};
  }
  if (choice.max_gaussians < 0) {
    return Error{ErrorCode::kBadArgument, Cat("--max-gaussians ", choice.max_gaussians, " is negative")};
  }
  return {};
}

// Step costs become non-decreasing, in the order in which a group takes them.
CopyPlan::CopyPlan(CopyGroups groups, const CopyChoice& choice, const GaussianCloud& cloud)
    : groups_(std::move(groups)),
      invisible_(choice.invisible),
      steps_(static_cast<size_t>(groups_.count * (groups_.copies - 1))),
      chosen_(static_cast<size_t>(groups_.count), 0),
      usable_(static_cast<size_t>(groups_.stand_ins ? groups_.count : 0), 0) {
  const bool all_steps = choice.max_gaussians > 0 || groups_.stand_ins;
  ParallelFor(0, groups_.count, kGroupsPerTask, [&](int64_t begin, int64_t end) {
    CopyGroup group(groups_.copies, invisible_);
    for (int64_t g = begin; g < end; ++g) {
      group.Load(cloud, groups_.first + g, groups_.count, groups_.copies, PixelOf(g), /*colors=*/true);
      CopyGroup::Step* step = StepsOf(g);
      float most = 0;
      uint8_t& chosen = chosen_[static_cast<size_t>(g)];
      bool wanted = true;
      const bool single = !groups_.single.empty() && groups_.single[static_cast<size_t>(g)] != 0;
      for (; group.alive() > 1; ++step) {
        *step = group.Next();
        step->cost = most = std::max(most, step->cost);
        wanted = wanted && (single || IsWanted(choice, group.alive(), step->cost));
        if (wanted) ++chosen;
        if (!wanted && !all_steps) break;
        group.Apply(*step);
      }
      if (!groups_.stand_ins || groups_.copies == 1) continue;
      const double cost = kStandInShare * group.CostOfStandIn(cloud, StandInOf(g));
      if (!std::isfinite(cost)) continue;
      const std::span<CopyGroup::Step> steps(StepsOf(g), static_cast<size_t>(groups_.copies - 1));
      usable_[static_cast<size_t>(g)] = 1;
      EndWithStandIn(cost, steps);
      if (single || choice.copies) continue;
      chosen = static_cast<uint8_t>(
          std::ranges::find_if(steps, [&](const CopyGroup::Step& s) { return !(s.cost <= choice.merge_cost); }) -
          steps.begin());
    }
  });
}

int64_t CopyPlan::merged() const {
  int64_t sum = 0;
  for (const uint8_t chosen : chosen_) sum += chosen;
  return sum;
}

void CopyPlan::ApplyTo(GaussianCloud& cloud, std::vector<char>& keep, std::vector<int64_t>* into) const {
  ParallelFor(0, groups_.count, kGroupsPerTask, [&](int64_t begin, int64_t end) {
    CopyGroup group(groups_.copies, invisible_);
    for (int64_t g = begin; g < end; ++g) {
      const int64_t chosen = chosen_[static_cast<size_t>(g)];
      if (StandsIn(g)) {
        for (int64_t k = 0; k < groups_.copies; ++k) {
          keep[static_cast<size_t>(groups_.first + k * groups_.count + g)] = 0;
        }
        continue;
      }
      if (groups_.stand_ins) keep[static_cast<size_t>(StandInOf(g))] = 0;
      if (chosen == 0) continue;
      group.Load(cloud, groups_.first + g, groups_.count, groups_.copies, PixelOf(g), /*colors=*/false);
      for (int64_t s = 0; s < chosen; ++s) group.Apply(StepsOf(g)[s]);
      group.Write(cloud, keep, into);
    }
  });
}

void MergeMore(std::span<CopyPlan> plans, int64_t more, const std::function<int64_t(size_t plan, int64_t group)>& row) {
  if (more <= 0) return;
  Buffer<float> costs;
  for (const CopyPlan& plan : plans) {
    for (int64_t g = 0; g < plan.groups(); ++g) {
      for (int64_t s = plan.chosen_[static_cast<size_t>(g)]; s < plan.groups_.copies - 1; ++s) {
        costs.push_back(plan.StepsOf(g)[s].cost);
      }
    }
  }
  if (more >= std::ssize(costs)) {
    for (CopyPlan& plan : plans) std::ranges::fill(plan.chosen_, static_cast<uint8_t>(plan.groups_.copies - 1));
    return;
  }
  const auto last = costs.begin() + (more - 1);
  std::nth_element(costs.begin(), last, costs.end());
  const float most = *last;
  int64_t equal = more - std::count_if(costs.begin(), costs.end(), [&](float cost) { return cost < most; });
  struct Equal {
    int64_t row;
    size_t plan;
    int64_t group;
  };
  std::vector<Equal> equals;
  for (size_t p = 0; p < plans.size(); ++p) {
    CopyPlan& plan = plans[p];
    for (int64_t g = 0; g < plan.groups(); ++g) {
      uint8_t& chosen = plan.chosen_[static_cast<size_t>(g)];
      while (chosen < plan.groups_.copies - 1 && plan.StepsOf(g)[chosen].cost < most) ++chosen;
      if (chosen < plan.groups_.copies - 1 && plan.StepsOf(g)[chosen].cost == most) equals.push_back({row(p, g), p, g});
    }
  }
  std::ranges::sort(equals, {}, &Equal::row);
  for (const Equal& one : equals) {
    CopyPlan& plan = plans[one.plan];
    uint8_t& chosen = plan.chosen_[static_cast<size_t>(one.group)];
    for (; equal > 0 && chosen < plan.groups_.copies - 1 && plan.StepsOf(one.group)[chosen].cost == most; --equal) {
      ++chosen;
    }
  }
}

}  // namespace anchorsplat
