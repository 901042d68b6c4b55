#pragma once

#include <utility>
#include <vector>

#include "compact/compact_output.h"
#include "compact/copy_choice.h"
#include "enhance/gaussian_budget.h"

namespace anchorsplat {

// Chooses among the copies of a whole cloud at once. Choosing block by block must give the same.
inline Result<ChosenCopies> ChooseCopies(CopyGroups groups, const CopyChoice& choice, GaussianCloud& cloud) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(choice, groups.copies));
  const int64_t made = cloud.size() - (groups.stand_ins ? groups.count : 0);
  std::vector<CopyPlan> plans;
  plans.emplace_back(std::move(groups), choice, cloud);
  ChosenCopies done;
  const int64_t over = made - plans.front().merged() - choice.max_gaussians;
  if (choice.max_gaussians > 0) MergeMore(plans, over, [](size_t, int64_t group) { return group; });
  std::vector<char> keep(static_cast<size_t>(cloud.size()), 1);
  plans.front().ApplyTo(cloud, keep);
  KeepMarked(keep, cloud);
  done.merged = made - cloud.size();
  done.left_out = DropLeastVisible(choice.max_gaussians, cloud);
  return done;
}

}  // namespace anchorsplat
