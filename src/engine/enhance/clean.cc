#include "enhance/clean.h"

#include <utility>
#include <vector>

#include "core/log.h"
#include "core/splat_comments.h"
#include "core/text.h"
#include "fit/training_views.h"

namespace anchorsplat {

Status Clean(const EnhanceOptions& options, GaussianCloud& cloud, EnhanceReport& report) {
  CameraSet set;
  if (options.cameras) set = *options.cameras;
  if (!options.refine.images.empty() && (set.cameras.empty() || !set.background)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(
        TrainingViews project,
        OpenProject(options.refine.images,
                    {.hold_out = 0, .downscale = options.refine.downscale, .origin = options.refine.origin}));
    if (set.cameras.empty()) set.cameras = std::move(project.train);
    if (!set.background) set.background = project.background;
  }
  if (set.cameras.empty()) {
    LogWarning(
        "--clean without --cameras checks views from outside only, and may remove parts of a scene that was seen from "
        "within. Pass --cameras");
  }
  UnseenOptions unseen{.seed = options.seed};
  unseen.background =
      options.background.value_or(set.background.value_or(BackgroundOf(cloud.comments).value_or(unseen.background)));
  ANCHORSPLAT_ASSIGN_OR_RETURN(report.cleaned, FindUnseen(cloud, set.cameras, unseen));
  if (options.region) {
    std::erase_if(report.cleaned->rows,
                  [&](int64_t i) { return !options.region->Contains(cloud.means.data() + 3 * i); });
  }
  const UnseenGaussians& found = *report.cleaned;
  const auto count = static_cast<int64_t>(found.rows.size());
  LogInfo(Cat(
      "cleaned: ", WithThousands(count), " of ", WithThousands(cloud.size()), " background-coloured Gaussians removed",
      count == 0 ? std::string()
                 : Cat("; each of ", found.views, " views still matches with ", Fixed(found.psnr, 1), " dB or more")));
  if (count == 0) return {};
  if (count == cloud.size()) {
    return Error{ErrorCode::kBadArgument,
                 "--clean would remove every Gaussian. Pass the background of the training views with --background"};
  }
  std::vector<int64_t> kept;
  auto gone = found.rows.begin();
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (gone != found.rows.end() && *gone == i) {
      ++gone;
    } else {
      kept.push_back(i);
    }
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(cloud, Subset(cloud, kept));
  return {};
}

}  // namespace anchorsplat
