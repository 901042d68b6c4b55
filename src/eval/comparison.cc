#include "eval/comparison.h"

#include <filesystem>

#include "core/log.h"
#include "core/text.h"
#include "metrics/compare.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {

Result<std::vector<std::vector<size_t>>> MatchSources(std::span<ViewSource* const> sources,
                                                      const ViewSource& reference) {
  std::vector<std::vector<size_t>> out;
  for (const ViewSource* source : sources) {
    if (source->names().size() == 1 && reference.names().size() == 1 && source->is_pictures() &&
        reference.is_pictures()) {
      out.push_back({0});
      continue;
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<ViewPair> pairs, MatchViews(source->names(), reference.names()));
    std::vector<size_t>& partner = out.emplace_back(reference.names().size());
    for (const ViewPair& pair : pairs) partner[pair.b] = pair.a;
  }
  return out;
}

Result<std::vector<Comparison>> CompareToReference(std::span<ViewSource* const> sources, ViewSource& reference) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto partners, MatchSources(sources, reference));
  std::vector<Comparison> out(sources.size());
  Progress progress("compare", static_cast<int64_t>(reference.names().size()));
  for (size_t r = 0; r < reference.names().size(); ++r) {
    const std::string name = std::filesystem::path(reference.names()[r]).stem().string();
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image truth, reference.Load(r));
    for (size_t s = 0; s < sources.size(); ++s) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const Image image, sources[s]->Load(partners[s][r]));
      if (image.width != truth.width || image.height != truth.height) {
        return Error{ErrorCode::kBadArgument,
                     Cat("view ", name, ": ", sources[s]->names()[partners[s][r]], " is ", image.width, "x",
                         image.height, " and ", reference.names()[r], " is ", truth.width, "x", truth.height,
                         "; sizes must agree (--size sets that of renders)")};
      }
      ViewScore score{name, 0, 0};
      ANCHORSPLAT_ASSIGN_OR_RETURN(score.psnr, Psnr(image, truth));
      ANCHORSPLAT_ASSIGN_OR_RETURN(score.ssim, Ssim(image, truth));
      out[s].views.push_back(score);
    }
    progress.Advance();
  }
  for (Comparison& comparison : out) {
    for (const ViewScore& view : comparison.views) {
      comparison.mean_psnr += view.psnr / static_cast<double>(comparison.views.size());
      comparison.mean_ssim += view.ssim / static_cast<double>(comparison.views.size());
    }
  }
  return out;
}

}  // namespace anchorsplat
