#include "enhance/gaussian_budget.h"

#include "core/log.h"
#include "core/most_visible.h"
#include "core/row_arrays.h"
#include "core/text.h"
#include "enhance/enhance.h"

namespace anchorsplat {

void SetBudget(EnhanceOptions& options, int64_t max_gaussians) {
  options.max_gaussians = options.model.options.max_gaussians = options.refine.max_gaussians = max_gaussians;
}

void KeepMarked(const std::vector<char>& keep, GaussianCloud& cloud) {
  KeepRows(cloud.means, 3, keep);
  KeepRows(cloud.log_scales, 3, keep);
  KeepRows(cloud.quats, 4, keep);
  KeepRows(cloud.opacity_logits, 1, keep);
  KeepRows(cloud.sh, cloud.sh_stride(), keep);
}

int64_t DropLeastVisible(int64_t most, GaussianCloud& cloud) {
  const int64_t over = cloud.size() - most;
  if (most == 0 || over <= 0) return 0;
  std::vector<char> keep(static_cast<size_t>(cloud.size()), 0);
  for (const int64_t row : MostVisible(cloud, most)) keep[static_cast<size_t>(row)] = 1;
  LogWarning(Cat("--max-gaussians ", WithThousands(most), ": dropped the ", WithThousands(over),
                 over == 1 ? " Gaussian" : " Gaussians", " with the least opacity × size"));
  KeepMarked(keep, cloud);
  return over;
}

}  // namespace anchorsplat
