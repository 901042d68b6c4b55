#include <nlohmann/json.hpp>
#include <utility>

#include "core/log.h"
#include "core/text.h"
#include "fit/initial_cloud.h"
#include "formats/cloud_io.h"
#include "request/fit_flags.h"

namespace anchorsplat {

namespace {

nlohmann::json ToJson(const ViewQuality& quality) {
  return {{"views", quality.views}, {"psnr", quality.psnr}, {"ssim", quality.ssim}};
}

}  // namespace

Result<ChosenStart> ChooseFitStart(const FitFlags& flags, const TrainingViews& views, const std::string& project,
                                   uint64_t seed, const GaussianCloud* splat) {
  if (splat != nullptr) return ChosenStart{SubsampleEvenly(PointsOf(*splat, views.origin), flags.init_points), "splat"};
  if (!flags.init_splat.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud cloud, ReadCloud(flags.init_splat));
    InitialPoints points = PointsOf(cloud, views.origin);
    if (points.size() < cloud.size()) {
      LogWarning(Cat(flags.init_splat, ": ", WithThousands(cloud.size() - points.size()), " of ",
                     WithThousands(cloud.size()), " Gaussians are unusable and skipped (see `info`)"));
    }
    return ChosenStart{SubsampleEvenly(points, flags.init_points), "splat"};
  }
  if (flags.init == FitInit::kPoints && views.points.size() == 0) {
    return Error{ErrorCode::kBadArgument, Cat(project, " has no points for --init points; use --init view or random")};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(InitialPoints points,
                               InitialPointsOf(flags.init, views, flags.init_points, seed, flags.init_extent));
  return ChosenStart{std::move(points), NameOf(flags.init, views)};
}

Result<FirstGaussians> MakeFirstGaussians(const FitFlags& flags, const TrainingViews& views, const ChosenStart& start,
                                          FitOptions& options) {
  FirstGaussians first;
  ANCHORSPLAT_ASSIGN_OR_RETURN(first.cloud, InitialCloud(start.points, views.scene_scale, StartOptions(options)));
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      first.shell, AddFarShell(views, start.points, flags.shell, start.origin == "points", options, first.cloud));
  return first;
}

nlohmann::json ToJson(const FitOptions& options, const std::string& origin, const AddedShell& added,
                      const FitReport& r) {
  const auto& t = r.times;
  nlohmann::json json = {
      {"steps", r.steps},
      {"resumed_at", r.resumed_at},
      {"initial_points", origin},
      {"shell",
       {{"gaussians", added.gaussians},
        {"on_sphere", added.shell.on_sphere},
        {"radius", added.shell.radius},
        {"share", added.shell.open_share},
        {"why", added.shell.why}}},
      {"settings", nlohmann::json::parse(ToJsonText(options))},
      {"scene_scale", r.scene_scale},
      {"gaussians",
       {{"in", r.gaussians_in},
        {"out", r.gaussians_out},
        {"duplicated", r.duplicated},
        {"split", r.split},
        {"pruned", r.pruned},
        {"relocated", r.relocated},
        {"added", r.added}}},
      {"loss", r.loss},
      {"seconds", r.seconds},
      {"stages",
       {{"load", t.load},
        {"render", t.objective.render},
        {"loss", t.objective.loss},
        {"backward", t.objective.backward},
        {"adam", t.adam},
        {"densify", t.densify}}},
  };
  json["train"] = ToJson(r.train);
  json["held_out"] = r.held_out.views > 0 ? ToJson(r.held_out) : nlohmann::json();
  return json;
}

}  // namespace anchorsplat
