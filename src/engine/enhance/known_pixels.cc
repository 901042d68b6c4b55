#include "enhance/known_pixels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "cameras/photograph.h"
#include "core/log.h"
#include "core/statistics.h"
#include "core/text.h"
#include "enhance/pixel_size.h"
#include "enhance/refine_poses.h"
#include "enhance/refine_views.h"
#include "fit/training_views.h"

namespace anchorsplat {

namespace {

// Cameras do not belong to the splat if their pixels are this many times larger than its own, with 99 % certainty.
constexpr double kFarOff = 2;
// One-sided 99 % over two-sided 80 % half-interval of a Laplace distribution: ln 50 / ln 5.
constexpr double kCertain = 2.43;
constexpr int64_t kComparedViews = 6;

void Shrink(double factor, CameraSet& cameras) {
  for (Camera& camera : cameras.cameras) camera.intrinsics = Scaled(camera.intrinsics, factor);
}

// How many times larger per side pictures are than those the splat was fitted to, by how well they match it at each
// size and, if that does not settle it, by its reading. Unset if they do not tell, as of compensated splats. Looks at
// kComparedViews of them.
Result<std::optional<int>> TimesLarger(const EnhanceOptions& options, const CameraSet& pictures, const Reading* reading,
                                       const GaussianCloud& cloud) {
  RefineOptions refine = options.refine;
  if (options.background) refine.background = options.background;
  CameraSet compared = pictures;
  compared.cameras = SubsampleEvenly(pictures.cameras, kComparedViews);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PictureAgreement agreement, MeasureSizes(compared, refine, cloud));
  if (agreement.smaller == 1) return std::optional<int>();
  if (const double best = std::max(agreement.psnr, agreement.smaller_psnr); best < kLeastInputPsnr) {
    if (options.cameras)
      LogInfo(Cat("not using the pictures of --cameras: they match the splat at no size (", Fixed(best, 1), " dB)"));
    return std::optional<int>();
  }
  const int times = TimesLarger(agreement);
  if (times > 1 || reading == nullptr || agreement.smaller_psnr <= agreement.psnr) return std::optional(times);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraPixelSizes sizes,
                               PixelSizesFromCameras(cloud, pictures, options.camera_rule));
  const std::array<double, 2> shrinks = {1, 1.0 / agreement.smaller};
  const bool is_smaller = LikeliestShrink(*reading, double{sizes.median}, shrinks) < 1;
  return std::optional(is_smaller ? agreement.smaller : 1);
}

// Width in training over that of the cameras, measured on their pictures.
struct MeasuredWidth {
  double shrink = 1;
  bool is_bound = false;  // the pictures are smaller than the cameras say, and match best as they are: or it was larger
};

// Unset if the pictures do not tell.
Result<std::optional<MeasuredWidth>> MeasureWidth(const EnhanceOptions& options, const Reading* reading,
                                                  const GaussianCloud& cloud) {
  CameraSet pictures;
  pictures.background = options.cameras->background;
  std::vector<Camera> views = options.cameras->cameras;
  std::erase_if(views, [](const Camera& camera) { return camera.image.empty(); });
  double matched = 1;
  for (Camera camera : SubsampleEvenly(views, kComparedViews)) {
    const int width = camera.intrinsics.width;
    if (!MatchPhotograph(camera).ok()) continue;  // the others tell as well
    matched = static_cast<double>(camera.intrinsics.width) / width;
    pictures.cameras.push_back(std::move(camera));
  }
  if (pictures.cameras.empty()) return std::optional<MeasuredWidth>();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::optional<int> times, TimesLarger(options, pictures, reading, cloud));
  if (!times) return std::optional<MeasuredWidth>();
  return std::optional(MeasuredWidth{matched / *times, *times == 1 && matched < 1});
}

// Reduces input.cameras to the size of the training, as far as that is known or likely.
Status ShrinkToTraining(const EnhanceOptions& options, const Reading* reading, EnhanceInput& input,
                        EnhanceReport& report) {
  const CameraSet& given = *options.cameras;
  const int widest = WidestOf(given.cameras);
  input.cameras = given;
  const auto shrink = [&](double factor) {
    input.cameras = given;
    Shrink(factor, *input.cameras);
    const int width = WidestOf(input.cameras->cameras);
    report.train_width = width < widest ? std::optional(width) : std::nullopt;
  };
  if (options.train_width) {
    shrink(static_cast<double>(*options.train_width) / widest);
    return {};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::optional<MeasuredWidth> measured,
                               MeasureWidth(options, reading, input.cloud));
  const bool is_bound = measured && measured->is_bound;
  if (measured && measured->shrink < 1 && !is_bound) {
    shrink(measured->shrink);
    LogInfo(Cat("the splat was fitted to pictures ", *report.train_width, " pixels wide, not ", widest,
                ": they match it best at that size"));
    return {};
  }
  if (is_bound) {
    shrink(measured->shrink);
  } else {
    report.train_width = AssumedTrainWidth(given);
    if (report.train_width) input.cameras = AtTrainWidth(given, *report.train_width);
  }
  if (reading != nullptr && (!measured || is_bound)) {
    const double assumed = report.train_width.value_or(widest);
    ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraPixelSizes sizes,
                                 PixelSizesFromCameras(input.cloud, *input.cameras, options.camera_rule));
    std::vector<double> shrinks;  // relative to what is assumed
    if (report.train_width) shrinks.push_back(1);
    for (const double part : kPictureShrinks) {
      const double relative = part * widest / assumed;
      if (!is_bound || relative > 1) shrinks.push_back(relative);
    }
    const double likeliest = LikeliestShrink(*reading, double{sizes.median}, shrinks);
    if (likeliest != 1 && 2 * sizes.unseen <= input.cloud.size()) {
      shrink(likeliest * assumed / widest);
      if (report.train_width) {
        LogWarning(Cat("using the cameras at ", *report.train_width, " pixels wide, not ", widest,
                       ", as the splat looks fitted to such pictures. Pass --train-width if it was not"));
      }
      return {};
    }
  }
  if (is_bound) {
    LogInfo(
        Cat("using the cameras at ", *report.train_width, " pixels wide, the size of their pictures, not ", widest));
  } else if (report.train_width) {
    LogWarning(Cat("assuming that training shrank the views to ", *report.train_width,
                   " pixels, as INRIA's trainer does. If it did not, pass their width with --train-width"));
  }
  return {};
}

// The only check of cameras: whether the splat's own pixels were certainly far smaller than theirs.
bool AreFarOff(double median, const Reading* reading) {
  if (reading == nullptr || reading->strangeness > 1) return false;
  const double half = std::log(reading->high / reading->pixel);
  return std::log(median / reading->pixel) > std::log(kFarOff) + kCertain * half;
}

// Pixel sizes of input.cameras.
Result<KnownPixels> PixelsOfCameras(CameraPixelRule rule, const Reading* reading, EnhanceInput& input,
                                    EnhanceReport& report) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraPixelSizes sizes, PixelSizesFromCameras(input.cloud, *input.cameras, rule));
  if (sizes.unseen == input.cloud.size()) {
    return Error{ErrorCode::kBadArgument,
                 "no camera sees any of the Gaussians: pass the cameras of this splat, in its unit and axes"};
  }
  if (sizes.unseen > 0) {
    const std::string text = Cat(WithThousands(sizes.unseen), " of ", WithThousands(input.cloud.size()),
                                 " Gaussians lie outside all views; using the pixel size of the nearest camera");
    2 * sizes.unseen > input.cloud.size() ? LogWarning(text + ". Check that --cameras belong to this splat")
                                          : LogInfo(text);
  }
  report.camera_rule = sizes.rule == CameraPixelRule::kMedian ? "median" : "smallest";
  if (!sizes.why.empty()) LogInfo(Cat("using --camera-rule ", report.camera_rule, ", as ", sizes.why));
  if (AreFarOff(double{sizes.median}, reading)) {
    LogWarning(Cat("ignoring the cameras: their training pixel, ", sizes.median,
                   ", is far larger than the splat's own, ", reading->pixel,
                   ". Check their unit and width (--train-width), or pass --mode to trust them"));
    report.pixel_size_source = PixelSizeSource::kRead;
    return KnownPixels{};
  }
  return KnownPixels{std::move(sizes.sizes), double{sizes.median}};
}

}  // namespace

Status CheckPixelOptions(const EnhanceOptions& options) {
  if (options.pixel_size && !(*options.pixel_size > 0 && std::isfinite(*options.pixel_size))) {
    return Error{ErrorCode::kBadArgument, Cat("pixel size ", *options.pixel_size, " is not a positive length")};
  }
  if (options.pixel_size && options.cameras) {
    return Error{ErrorCode::kBadArgument,
                 "a pixel size and cameras exclude each other: cameras already give the pixel size"};
  }
  if (!options.train_width) return {};
  if (!options.cameras) return Error{ErrorCode::kBadArgument, "--train-width needs --cameras"};
  const int widest = WidestOf(options.cameras->cameras);
  if (*options.train_width <= widest) return {};
  return Error{ErrorCode::kBadArgument, Cat("--train-width ", *options.train_width,
                                            " has no effect: the views are only ", widest, " pixels wide")};
}

Result<KnownPixels> FindKnownPixels(const EnhanceOptions& options, bool with_pictures, bool believed,
                                    const Reading* reading, EnhanceInput& input, EnhanceReport& report) {
  if (believed) reading = nullptr;
  if (options.cameras) {
    report.pixel_size_source = PixelSizeSource::kCameras;
    ANCHORSPLAT_RETURN_IF_ERROR(ShrinkToTraining(options, reading, input, report));
    return PixelsOfCameras(options.camera_rule, reading, input, report);
  }
  if (options.pixel_size) {
    report.pixel_size_source = PixelSizeSource::kGiven;
    return KnownPixels{{static_cast<float>(*options.pixel_size)}, options.pixel_size};
  }
  report.pixel_size_source = PixelSizeSource::kRead;
  if (!with_pictures) return KnownPixels{};
  report.pixel_size_source = PixelSizeSource::kPictures;
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      TrainingViews project,
      OpenProject(options.refine.images,
                  {.hold_out = 0, .downscale = options.refine.downscale, .origin = options.refine.origin}));
  input.cameras.emplace().cameras = std::move(project.train);
  input.cameras->background = project.background;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::optional<int> times,
                               TimesLarger(options, *input.cameras, reading, input.cloud));
  input.times_larger = times.value_or(1);
  Shrink(1.0 / *input.times_larger, *input.cameras);
  if (*input.times_larger > 1) report.train_width = WidestOf(input.cameras->cameras);
  auto known = PixelsOfCameras(options.camera_rule, reading, input, report);
  input.cameras.reset();  // refinement opens the pictures itself
  return known;
}

}  // namespace anchorsplat
