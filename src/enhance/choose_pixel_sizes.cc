#include "enhance/choose_pixel_sizes.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/log.h"
#include "core/render_mode.h"
#include "core/statistics.h"
#include "core/text.h"
#include "enhance/pixel_size.h"
#include "enhance/pixel_size_guard.h"
#include "enhance/pixel_sizes_of_things.h"
#include "fit/training_views.h"
#include "render/constants.h"

namespace anchorsplat {

namespace {

// Cameras and estimate further apart than this are worth a word: one of them does not belong to this splat.
constexpr double kSuspiciousRatio = 1.5;
// Cameras whose pixels are so many times larger than the splat may look like at most do not belong to it. Fits to sharp
// pictures that are antialiased are taken for 0.42 of their pixels and more (160; by MCMC of 2,000 steps one for 0.29).
constexpr double kImpossible = 2.5, kImpossibleOfAntialiased = 2;
// Antialiased fits to soft pictures are taken for 0.3 to 0.7 of their pixels, as they have lost next to nothing, and
// even their small Gaussians are 1.8 to 3.5 times as large as what they are taken for (all 17). Those of fits to sharp
// ones that are taken for so little are 0.5 to 1.4 times as large (one of twenty is at 3.1). Small things of few
// Gaussians may be taken for less.
constexpr double kSofterThanCameras = 0.7, kSoftest = 0.28, kSmallOfSoft = 1.7;

// Without a tag an antialiased splat may look classic, and its estimate is a third of its pixel then: cameras would
// widen it by six times too much. Few classic ones are taken for so little.
constexpr double kLeastUntagged = 0.38;

// As IsSharperThanFitsTo, of antialiased ones that are softer.
bool IsSofterThanFitsTo(const GaussianCloud& cloud, double pixel, const PixelSizeFinding& found) {
  return cloud.render_mode == RenderMode::kAntialiased && !found.contradicted() &&
         found.size < kSofterThanCameras * pixel && found.size > kSoftest * pixel &&
         found.small_axis > kSmallOfSoft * found.size;
}

bool ShowsNothing(const GaussianCloud& cloud) {
  return std::ranges::none_of(cloud.opacity_logits, [](float logit) { return Sigmoid(logit) >= kMinAlpha; });
}

void ScaleTo(double median, CameraPixelSizes& sizes) {
  const auto factor = static_cast<float>(median / sizes.median);
  for (float& own : sizes.sizes) own *= factor;
  sizes.median *= factor;
}

// `says`: there is width to give back, so that it matters.
Status PixelSizesFromTrainingCameras(const EnhanceOptions& options, bool says, EnhanceInput& input,
                                     EnhanceReport& report) {
  std::optional<int> train_width = options.train_width;
  if (train_width) {
    int widest = 0;
    for (const Camera& camera : options.cameras->cameras) widest = std::max(widest, camera.intrinsics.width);
    if (*train_width > widest) {
      return Error{ErrorCode::kBadArgument, Cat("--train-width ", *train_width,
                                                " has no effect: the cameras' views are only ", widest, " wide")};
    }
  }
  if (!train_width) {
    train_width = AssumedTrainWidth(*options.cameras);
    if (train_width) {
      LogWarning(Cat("the cameras are wider than ", *train_width, " pixels; assuming that training shrank them to ",
                     *train_width, " as INRIA's trainer does. If not, give the true width with --train-width"));
    }
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraPixelSizes from_cameras,
                               PixelSizesFromCameras(input.cloud, *options.cameras, train_width, options.camera_rule));
  if (from_cameras.unseen == input.cloud.size()) {
    return Error{
        ErrorCode::kBadArgument,
        "no Gaussian lies in any of the cameras' views: are these cameras of this splat, in its unit and axes?"};
  }
  if (from_cameras.unseen > 0) {
    const std::string text = Cat(WithThousands(from_cameras.unseen), " of ", WithThousands(input.cloud.size()),
                                 " Gaussians lie outside all views; their pixel size is that of the nearest camera");
    2 * from_cameras.unseen > input.cloud.size() ? LogWarning(text + ". Are these cameras of this splat?")
                                                 : LogInfo(text);
  }
  report.camera_rule = from_cameras.rule == CameraPixelRule::kMedian ? "median" : "smallest";
  if (!from_cameras.why.empty()) {
    LogInfo(Cat("--camera-rule ", report.camera_rule, ": ", from_cameras.why));
  }
  report.pixel_size_source = "cameras";
  const auto found = says ? FindPixelSize(input.cloud) : Result<PixelSizeFinding>(Error{});
  if (found.ok()) {
    input.showing = found->estimate.showing;
    input.softness = found->estimate.softness;
    const double ratio = found->size / from_cameras.median;
    // Whoever says a mode or a strength means these cameras.
    const bool said = options.filter_strength || IsGiven(options, "mode");
    const bool sharper =
        (!IsCompensated(input.cloud.render_mode) && IsSharperThanFitsTo(from_cameras.median, *found)) ||
        LiesTooCloseFor(from_cameras.median, *found);
    const bool untagged_and_finer =
        !input.cloud.render_mode && found->estimate.size < kLeastUntagged * from_cameras.median;
    const double largest = std::max(found->largest, found->estimate.high);
    const bool antialiased = input.cloud.render_mode == RenderMode::kAntialiased;
    const bool impossible = !LiesAsFitsTo(from_cameras.median, *found) &&
                            from_cameras.median > (antialiased ? kImpossibleOfAntialiased : kImpossible) * largest;
    const bool softer = !impossible && IsSofterThanFitsTo(input.cloud, from_cameras.median, *found);
    if (!said && softer) {
      LogWarning(Cat("the cameras say a training pixel of ", from_cameras.median,
                     " (median), but the splat looks like one of soft pictures, out of focus or enlarged, which has "
                     "lost less: the width of pixels of ",
                     found->size, " is given back. --mode antialiased says that the pictures were sharp"));
      ScaleTo(found->size, from_cameras);
      report.pixel_size_source = "estimated";
    } else if (!said && (sharper || impossible || untagged_and_finer)) {
      const double size = found->contradicted() ? found->size : found->largest;
      LogWarning(Cat("the cameras say a training pixel of ", from_cameras.median,
                     " (median), but the splat is sharper than a fit to such pixels: like one to pixels of ", size,
                     ", and only that much width is given back. Are these its training cameras, at the size and in the "
                     "unit it was trained in (--train-width)",
                     input.cloud.render_mode ? "" : ", or was it trained with antialiasing (--mode antialiased)",
                     "? --mode or --filter-strength says that they are right all the same"));
      ScaleTo(size, from_cameras);
      report.pixel_size_source = found->contradicted() ? kCautiousPixelSize : "estimated";
      if (found->contradicted()) {
        // Where these cameras are far off, so may be how they differ from Gaussian to Gaussian.
        const Buffer<float> cautious = CautiousPixelSizes(input.cloud, *found);
        for (size_t i = 0; i < from_cameras.sizes.size(); ++i) {
          from_cameras.sizes[i] = std::min(from_cameras.sizes[i], cautious[i]);
        }
      }
    } else if ((found->sure() && (ratio > kSuspiciousRatio || ratio < 1 / kSuspiciousRatio)) ||
               from_cameras.median > kSuspiciousRatio * found->estimate.high) {
      LogWarning(Cat("the cameras say a training pixel of ", from_cameras.median,
                     " (median), the splat itself looks like ", found->size,
                     ": are these its training cameras, at the size it was trained at (--train-width)?"));
    }
  }
  report.train_width = train_width;
  report.pixel_size = from_cameras.median;
  input.pixel_sizes = std::move(from_cameras.sizes);
  return {};
}

// Pictures to refine against come with the cameras that took them, and are as large as they were in training.
Status PixelSizesFromPictures(const EnhanceOptions& options, bool says, EnhanceInput& input, EnhanceReport& report) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      TrainingViews project,
      OpenProject(options.refine.images,
                  {.hold_out = 0, .downscale = options.refine.downscale, .origin = options.refine.origin}));
  EnhanceOptions with_cameras = options;
  with_cameras.cameras.emplace().cameras = std::move(project.train);
  with_cameras.camera_rule = CameraPixelRule::kMedian;
  ANCHORSPLAT_RETURN_IF_ERROR(PixelSizesFromTrainingCameras(with_cameras, says, input, report));
  if (report.pixel_size_source == "cameras") report.pixel_size_source = "pictures";
  return {};
}

// Outlines of what has been enhanced say nothing about the pixels of the rest.
Result<PixelSizeFinding> FindPixelSizeInside(const Region& region, const GaussianCloud& cloud) {
  std::vector<int64_t> inside;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (region.Holds(cloud.means.data() + 3 * i)) inside.push_back(i);
  }
  if (inside.empty()) return FindPixelSize(cloud);  // which is refused later on
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud part, Subset(cloud, inside));
  return FindPixelSize(part);
}

constexpr std::string_view kWillDoBetter = "--cameras or --pixel-size will do better";

void SayWhatWasFound(std::span<const ThingPixelSize> things) {
  const std::string text = Cat("the splat is made of ", InWords(things), "; ", kWillDoBetter);
  ContradictionsOf(things).empty() ? LogInfo(text) : LogWarning(text);
}

void SayWhatWasFound(const PixelSizeFinding& found) {
  const PixelSizeEstimate& estimate = found.estimate;
  if (found.contradicted()) {
    std::string contradictions;
    for (const std::string& sentence : found.contradictions) {
      contradictions += (contradictions.empty() ? "" : "; and ") + sentence;
    }
    LogWarning(Cat("outlines say a training pixel of ", estimate.size, ", but ", contradictions,
                   ". So that nothing is blurred, ",
                   found.size < estimate.size ? "a smaller pixel is taken, " : "no larger pixel is taken than ",
                   found.size, found.least < found.size ? " at most" : "", "; ", kWillDoBetter,
                   found.no_one_pixel ? ". In a room or a street the pixels of what is near and of what is far differ "
                                        "many times: no single size is right there, and only cameras know them"
                                      : ""));
    return;
  }
  const std::string soft = found.SoftnessInWords();
  const std::string size =
      Cat("estimated size of a training pixel: ", estimate.size, " (likely ", estimate.low, " to ", estimate.high, ")",
          soft.empty() ? "" : ", " + soft,
          found.part ? Cat("; ", found.CutsInWords(), ", and to be safe a smaller one is taken, ", found.size) : "",
          found.closer > 0 ? "; where Gaussians lie much closer than elsewhere a smaller one is taken" : "");
  if (found.rough()) {
    LogWarning(
        Cat(size, ". That is rough: this splat says little about the pixels it was trained at; ", kWillDoBetter));
    return;
  }
  LogInfo(Cat(size, ", and nothing else about the splat contradicts it; --cameras or --pixel-size make it exact"));
}

}  // namespace

Status ChoosePixelSizes(const EnhanceOptions& options, bool pictures, bool says, EnhanceInput& input,
                        EnhanceReport& report) {
  if (options.pixel_size && !(*options.pixel_size > 0 && std::isfinite(*options.pixel_size))) {
    return Error{ErrorCode::kBadArgument, Cat("pixel size ", *options.pixel_size, " is not a positive length")};
  }
  if (options.pixel_size && options.cameras) {
    return Error{ErrorCode::kBadArgument,
                 "a pixel size and cameras were given; the cameras already say the pixel size"};
  }
  if (options.train_width && !options.cameras) {
    return Error{ErrorCode::kBadArgument, "--train-width says how cameras were shrunk; it needs --cameras"};
  }
  if (!input.cloud.empty() && ShowsNothing(input.cloud)) {
    LogWarning(Cat("all of its ", WithThousands(input.cloud.size()),
                   " Gaussians are less opaque than 1/255: nothing of the splat shows, and it stays as it is"));
    report.pixel_size_source = kUnknownPixelSize;
    return {};
  }
  if (options.cameras) return PixelSizesFromTrainingCameras(options, says, input, report);
  if (options.pixel_size) {
    report.pixel_size = *options.pixel_size;
    report.pixel_size_source = "given";
    // It chooses the network, too.
    if (says && !IsCompensated(input.cloud.render_mode)) {
      const auto estimate = EstimatePixelSize(input.cloud);
      if (estimate.ok()) {
        input.showing = estimate->showing;
        // Too small ones harm nobody.
        if (report.pixel_size > kSuspiciousRatio * estimate->high) {
          LogWarning(Cat("a training pixel of ", report.pixel_size, " was given, the splat itself looks like ",
                         estimate->size, " (likely ", estimate->low, " to ", estimate->high,
                         "): is it the world size of a pixel of the training views, in the splat's unit?"));
        }
      }
    }
  } else if (pictures) {
    return PixelSizesFromPictures(options, says, input, report);
  } else {
    const bool part_alone = options.region && input.partly_enhanced;
    const auto found = part_alone ? FindPixelSizeInside(*options.region, input.cloud) : FindPixelSize(input.cloud);
    if (!found.ok()) {
      LogWarning(found.error().message + ": the splat stays as it is; --pixel-size or --cameras would tell");
      report.pixel_size_source = kUnknownPixelSize;
      return {};
    }
    report.finding = *found;
    input.showing = found->estimate.showing;
    input.softness = found->estimate.softness;
    report.pixel_size = found->size;
    report.pixel_size_source = found->contradicted() ? kCautiousPixelSize : "estimated";
    PixelSizesOfThings of_things;
    if (!part_alone) {
      of_things = FindPixelSizesOfThings(input.cloud, *found, !IsGiven(options, "mode") && !options.filter_strength);
    }
    if (!of_things.things.empty()) {
      input.pixel_sizes = of_things.sizes;
      report.pixel_size = double{Quantile(of_things.sizes, 0.5)};
      const bool doubtful = !ContradictionsOf(of_things.things).empty();
      report.pixel_size_source = doubtful ? kCautiousPixelSize : "estimated";
      if (doubtful && std::ranges::count(of_things.sure, 1) > 0) input.sure = std::move(of_things.sure);
      report.things = std::move(of_things.things);
      if (says) SayWhatWasFound(report.things);
      return {};
    }
    if (says) SayWhatWasFound(*found);
    if (!found->is_one()) {
      input.pixel_sizes = CautiousPixelSizes(input.cloud, *found);
      return {};
    }
  }
  input.pixel_sizes.assign(1, static_cast<float>(report.pixel_size));
  return {};
}

}  // namespace anchorsplat
