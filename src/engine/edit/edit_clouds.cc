#include "edit/edit_clouds.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/parallel.h"
#include "core/text.h"
#include "edit/edit_steps.h"
#include "edit/merge.h"
#include "edit/moved_rows.h"

namespace anchorsplat {

namespace {

// Copies the kept rows of `from` to `to` from row `begin`, moved; SH it lacks become zero.
void CopyMoved(const CloudView& from, const EditedSplat& splat, int64_t begin, GaussianCloud& to) {
  const RowMover mover(splat.world, splat.origin, to.origin, splat.sh_degree);
  const std::vector<int64_t> places = PlacesOfBlocks(splat, begin);
  const int64_t harmonics = int64_t{3} * ShCoefficients(splat.sh_degree);
  ParallelFor(0, from.size(), kRowsPerBlock, [&](int64_t first, int64_t last) {
    const int64_t place = places[static_cast<size_t>(first / kRowsPerBlock)];
    int64_t at = place;
    for (int64_t i = first; i < last; ++i) {
      if (!splat.has(i)) continue;
      std::copy_n(from.means.data() + 3 * i, 3, to.means.data() + 3 * at);
      std::copy_n(from.log_scales.data() + 3 * i, 3, to.log_scales.data() + 3 * at);
      std::copy_n(from.quats.data() + 4 * i, 4, to.quats.data() + 4 * at);
      to.opacity_logits[static_cast<size_t>(at)] = from.opacity_logits[static_cast<size_t>(i)];
      float* const sh = to.sh.data() + at * to.sh_stride();
      std::copy_n(from.sh.data() + i * from.sh_stride(), harmonics, sh);
      std::fill(sh + harmonics, sh + to.sh_stride(), 0.0f);
      ++at;
    }
    mover.Move(to, place, at);
  });
}

}  // namespace

Result<EditedCloud> EditClouds(std::span<const CloudView> clouds, std::span<const EditRun> runs) {
  const ExtraProperties none;
  std::vector<std::unique_ptr<MemoryRows>> rows;
  std::vector<EditedSplat> splats;
  std::vector<std::optional<RenderMode>> modes;
  for (const CloudView& cloud : clouds) {
    ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
    rows.push_back(std::make_unique<MemoryRows>(cloud, none));
    splats.push_back({.name = clouds.size() == 1 ? "the cloud" : Cat("cloud ", splats.size() + 1),
                      .rows = rows.back().get(),
                      .extras = &none,
                      .origin = cloud.origin,
                      .sh_degree = cloud.sh_degree,
                      .comments = {cloud.comments.begin(), cloud.comments.end()},
                      .kept = cloud.size()});
    modes.push_back(cloud.render_mode);
  }
  EditedCloud edited;
  for (const EditRun& run : runs) {
    std::string input;
    if (run.count < splats.size()) {
      input = run.count == 1 ? splats[run.first].name : Cat("clouds ", run.first + 1, " to ", run.first + run.count);
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(auto steps,
                                 ApplyActions(std::span(splats).subspan(run.first, run.count), run.actions, input));
    std::ranges::move(steps, std::back_inserter(edited.steps));
  }
  DropPlaces(splats);
  int64_t gaussians = 0;
  int degree = 0;
  for (const EditedSplat& splat : splats) {
    gaussians += splat.kept;
    degree = std::max(degree, splat.sh_degree);
  }
  GaussianCloud& cloud = edited.cloud;
  ANCHORSPLAT_ASSIGN_OR_RETURN(cloud.origin, ChooseEditedOrigin(splats));
  cloud.comments = MergedComments(splats);
  cloud.render_mode = MergedMode(modes);
  cloud.Resize(gaussians, degree);
  int64_t begin = 0;
  for (size_t k = 0; k < splats.size(); ++k) {
    CopyMoved(clouds[k], splats[k], begin, cloud);
    begin += splats[k].kept;
  }
  return edited;
}

}  // namespace anchorsplat
