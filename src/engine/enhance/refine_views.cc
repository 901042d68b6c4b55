#include "enhance/refine_views.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/log.h"
#include "core/splat_comments.h"
#include "core/text.h"
#include "enhance/enlarged_targets.h"
#include "enhance/refine_poses.h"
#include "enhance/refiner.h"
#include "fit/view_exposure.h"
#include "fit/view_pose.h"
#include "metrics/image_metrics.h"
#include "render/constant_cloud.h"
#include "render/shown_range.h"

namespace anchorsplat {

namespace {

constexpr int64_t kCheckViews = 8;
constexpr int64_t kResidualViews = 64;
constexpr int kCheckAlignSteps = 4;
constexpr int kHeldOutByDefault = 8;
constexpr double kSeen = 0.3;     // dB
constexpr double kPerfect = 100;  // dB of identical pictures, for means

std::array<float, 3> BackgroundFor(const RefineOptions& options, const std::optional<std::array<float, 3>>& of_cameras,
                                   const GaussianCloud& cloud) {
  if (options.background) return *options.background;
  return of_cameras.value_or(BackgroundOf(cloud.comments).value_or(std::array<float, 3>{}));
}

// Whether a fit was trained on the held-out views too: they match as well as the others.
bool HasSeen(double seen_psnr, double held_out_psnr) { return held_out_psnr > seen_psnr - kSeen; }

Result<RefineViews> OpenPictures(const RefineInput& input, const RefineOptions& options, RenderOptions render) {
  const ProjectOptions as_asked = {.hold_out = options.hold_out.value_or(kHeldOutByDefault),
                                   .downscale = options.downscale,
                                   .origin = options.origin};
  ANCHORSPLAT_ASSIGN_OR_RETURN(TrainingViews project, OpenProject(options.images, as_asked));
  if (!project.without_picture.empty()) {
    return Error{ErrorCode::kBadArgument,
                 Cat("--images ", options.images.string(), ": ", project.without_picture.size(), " of its ",
                     project.without_picture.size() + project.train.size() + project.held_out.size(),
                     " cameras have no picture, such as ", Printable(project.without_picture.front()),
                     ". Remove cameras without a picture, or pass the right project")};
  }
  render.background = BackgroundFor(options, project.background, input.cloud);
  PictureCache pictures(project.train, render.background);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PictureAgreement agreement, MeasureAgreement(input.cloud, render, pictures));
  // At the size of the training: at full size, needles may hide everything.
  const int times = input.times_larger.value_or(TimesLarger(agreement));
  const auto matched = [&](const PictureAgreement& views) { return times > 1 ? views.smaller_psnr : views.psnr; };
  LogInfo(Cat(project.train.size(), " views with pictures, ", project.held_out.size(),
              " held out; renders of the splat match them with ", Fixed(matched(agreement), 2), " dB"));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckAgreement(agreement, kLeastInputPsnr, options.align));
  if (!options.hold_out && !project.held_out.empty()) {
    PictureCache held_out(project.held_out, render.background);
    ANCHORSPLAT_ASSIGN_OR_RETURN(const PictureAgreement others, MeasureAgreement(input.cloud, render, held_out));
    if (HasSeen(matched(agreement), matched(others))) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(
          TrainingViews all,
          OpenProject(options.images, {.hold_out = 0, .downscale = options.downscale, .origin = options.origin}));
      // A project with its own test views always holds those out.
      if (all.held_out.empty()) {
        LogInfo(Cat("training on all views: the splat was fitted to the held-out ones, too (they match with ",
                    Fixed(matched(others), 2), " dB). --hold-out N holds some out"));
        project = std::move(all);
        pictures = PictureCache(project.train, render.background);
      }
    }
  }
  const auto& check = project.held_out.empty() ? project.train : project.held_out;
  return RefineViews{RefineTargets(std::move(pictures)),
                     RefineTargets(PictureCache(SubsampleEvenly(check, kCheckViews), render.background)),
                     agreement.psnr,
                     times,
                     project.scene_scale,
                     render};
}

Result<RefineViews> OpenSplat(const RefineInput& input, const RefineOptions& options, RenderOptions render) {
  RefinePoses poses;
  render.background = BackgroundFor(options, input.cameras ? input.cameras->background : std::nullopt, input.cloud);
  if (input.cameras && !input.cameras->cameras.empty()) {
    poses = RefinePosesAlong(input.cameras->cameras, options.between, kCheckViews);
    if (!poses.apart) {
      LogInfo("no room between these cameras for extra views: checking the result on the training views");
    }
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(
        poses, RefinePosesAround(input.cloud, input.pixel_size, options.poses, kCheckViews, input.seed));
  }
  for (const Camera& camera : poses.check) {
    const std::string warning = EmptyPictureReason(input.cloud, camera, render, std::nullopt);
    if (warning.empty()) continue;
    LogWarning(Cat(warning, " Refinement cannot use such views"));
    break;
  }
  const double scale = SceneScale(poses.train);
  const auto splat = std::make_shared<const GaussianCloud>(input.cloud);
  return RefineViews{RefineTargets(splat, render, std::move(poses.train)),
                     RefineTargets(splat, render, std::move(poses.check)),
                     std::nullopt,
                     1,
                     scale,
                     render};
}

}  // namespace

Result<PictureAgreement> MeasureSizes(const CameraSet& cameras, const RefineOptions& options,
                                      const GaussianCloud& cloud) {
  RenderOptions render = DisplayOptions(cloud);
  render.background = BackgroundFor(options, cameras.background, cloud);
  PictureCache pictures(cameras.cameras, render.background);
  return MeasureSizes(cloud, render, pictures);
}

Result<RefineViews> OpenRefineViews(const RefineInput& input, const RefineOptions& options) {
  const RenderOptions render = DisplayOptions(input.cloud);
  return options.images.empty() ? OpenSplat(input, options, render) : OpenPictures(input, options, render);
}

Status EnlargeViews(const std::filesystem::path& file, int factor, const GaussianCloud& start, RefineViews& views) {
  std::shared_ptr<Upscaler> shared;
  if (!file.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(Upscaler network, Upscaler::Read(file));
    shared = std::make_shared<Upscaler>(std::move(network));
  }
  const auto splat = std::make_shared<const GaussianCloud>(start);
  for (RefineTargets* targets : {&views.train, &views.check}) {
    *targets =
        RefineTargets(std::make_unique<EnlargedTargets>(std::move(*targets), shared, factor, splat, views.render));
  }
  return {};
}

Result<Consistency> MeasureConsistency(const GaussianCloud& cloud, double upscale, const GaussianCloud& input,
                                       const RefineOptions& options, RefineViews& views) {
  RefineTargets& targets = views.check;
  ConstantCloud still(cloud);
  ViewObjective objective;
  PoseAligner aligner;
  RefineTarget target;
  Consistency sum;
  const auto count = static_cast<int64_t>(targets.views().size());
  for (int64_t view = 0; view < count; ++view) {
    const Camera& camera = targets.views()[static_cast<size_t>(view)];
    const PixelBox window = ChooseWindow(camera, input, 0, view);  // equal for every cloud measured
    ANCHORSPLAT_RETURN_IF_ERROR(targets.Load(view, window, target));
    Camera seen = Crop(camera, window);
    const ObjectiveOptions as_seen{.render = views.render, .loss = {}, .pixel = AreaModel(upscale)};
    if (options.align) {
      if (!target.ignored.empty()) {
        ANCHORSPLAT_RETURN_IF_ERROR(objective.Show(as_seen, still, seen));
        FillIgnored(target.ignored, objective.rendered(), target.picture);
      }
      ANCHORSPLAT_ASSIGN_OR_RETURN(seen, aligner.Align(cloud, RaysOf(PixelModel{1, upscale}, views.render), seen, seen,
                                                       target.picture, options.exposure, kCheckAlignSteps));
    }
    ANCHORSPLAT_RETURN_IF_ERROR(objective.Show(as_seen, still, seen));
    Image shown = objective.rendered();
    FillIgnored(target.ignored, shown, target.picture);
    if (options.exposure) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewExposure exposure, EstimateExposure(shown, target.picture));
      RemoveExposure(exposure, target.picture);
    }
    Clamp01(shown);
    for (size_t i = 0; i < target.ignored.size(); ++i) {
      if (target.ignored[i] == 0) continue;
      for (int c = 0; c < 3; ++c) shown.channel(c)[i] = target.picture.channel(c)[i];
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double psnr, Psnr(shown, target.picture));
    sum.psnr += std::min(psnr, kPerfect);
    const Result<double> ssim = Ssim(shown, target.picture);
    sum.ssim += ssim.ok() ? *ssim : 0;  // 0 if too small for its window
  }
  if (count == 0) return Consistency{};
  return Consistency{sum.psnr / static_cast<double>(count), sum.ssim / static_cast<double>(count)};
}

Result<std::vector<double>> Residuals(const GaussianCloud& cloud, double upscale, RefineViews& views) {
  const PixelModel one_ray{1, upscale};
  RenderOptions render = RaysOf(one_ray, views.render);
  render.gradient = true;

  ConstantCloud still(cloud);
  Rasterizer rasterizer;
  RenderOutput output;
  RenderGradient off;
  CloudGradient weighted;
  RefineTarget target;
  std::vector<double> residuals(static_cast<size_t>(cloud.size()), 0.0);
  const auto stride = static_cast<size_t>(cloud.sh_stride());
  const auto count = static_cast<int64_t>(views.train.views().size());
  const int64_t looked_at = std::min(count, kResidualViews);
  for (int64_t i = 0; i < looked_at; ++i) {
    const int64_t view = i * count / looked_at;
    const Camera& camera = views.train.views()[static_cast<size_t>(view)];
    const PixelBox window = ChooseWindow(camera, cloud, 0, view);
    ANCHORSPLAT_RETURN_IF_ERROR(views.train.Load(view, window, target));
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(still, Crop(camera, window), render, output));
    off.color = output.color;
    for (size_t k = 0; k < off.color.pixels.size(); ++k) {
      off.color.pixels[k] = std::abs(off.color.pixels[k] - target.picture.pixels[k]);
    }
    for (size_t k = 0; k < target.ignored.size(); ++k) {
      for (int c = 0; c < 3 && target.ignored[k] != 0; ++c) off.color.channel(c)[k] = 0;
    }
    off.box = {0, 0, off.color.width, off.color.height};
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Backward(still, off, weighted));
    for (size_t k = 0; k < residuals.size(); ++k) {
      for (size_t c = 0; c < 3; ++c) residuals[k] += double{weighted.sh[k * stride + c]};
    }
  }
  return residuals;
}

}  // namespace anchorsplat
