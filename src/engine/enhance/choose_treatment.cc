#include "enhance/choose_treatment.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/log.h"
#include "core/render_mode.h"
#include "core/run_context.h"
#include "core/splat_comments.h"
#include "core/statistics.h"
#include "core/text.h"
#include "enhance/cloud_components.h"
#include "enhance/filter.h"
#include "enhance/pixel_size.h"
#include "fit/pixel_model.h"
#include "fit/training_views.h"
#include "reading/places.h"
#include "reading/treatment.h"
#include "render/constants.h"

namespace anchorsplat {

namespace {

// Nearer than that a network takes something from what the filter has: 0.2 dB at 1.1, 0.3 at 1.2.
constexpr double kLeastUpscaleOfNetworks = 1.35;
// Cameras whose pixels are so many times larger than those of the splat, at 99 % certainty, are not its own.
constexpr double kFarOff = 2;
// Half an interval of 99 % on one side over half of one of 80 % on both, of a Laplace distribution: ln 50 / ln 5.
constexpr double kCertain = 2.43;
// Things of which more cannot be read one by one.
constexpr size_t kMostParts = 12;
// Of the pixel of the whole: gives no width that anybody sees.
constexpr double kNextToNothing = 0.02;

bool ShowsNothing(const GaussianCloud& cloud) {
  return std::ranges::none_of(cloud.opacity_logits, [](float logit) { return Sigmoid(logit) >= kMinAlpha; });
}

// The splat of which cameras or the caller say the pixel, or of which it is read.
struct KnownPixels {
  Buffer<float> sizes;          // one or [N]; empty: they are read
  std::optional<double> pixel;  // their median
};

Result<CameraPixelSizes> PixelsOfCameras(const EnhanceOptions& options, const EnhanceInput& input,
                                         EnhanceReport& report) {
  std::optional<int> train_width = options.train_width;
  if (train_width) {
    int widest = 0;
    for (const Camera& camera : options.cameras->cameras) widest = std::max(widest, camera.intrinsics.width);
    if (*train_width > widest) {
      return Error{ErrorCode::kBadArgument, Cat("--train-width ", *train_width,
                                                " has no effect: the cameras' views are only ", widest, " wide")};
    }
  } else {
    train_width = AssumedTrainWidth(*options.cameras);
    if (train_width) {
      LogWarning(Cat("the cameras are wider than ", *train_width, " pixels; assuming that training shrank them to ",
                     *train_width, " as INRIA's trainer does. If not, give the true width with --train-width"));
    }
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraPixelSizes sizes,
                               PixelSizesFromCameras(input.cloud, *options.cameras, train_width, options.camera_rule));
  if (sizes.unseen == input.cloud.size()) {
    return Error{
        ErrorCode::kBadArgument,
        "no Gaussian lies in any of the cameras' views: are these cameras of this splat, in its unit and axes?"};
  }
  if (sizes.unseen > 0) {
    const std::string text = Cat(WithThousands(sizes.unseen), " of ", WithThousands(input.cloud.size()),
                                 " Gaussians lie outside all views; their pixel size is that of the nearest camera");
    2 * sizes.unseen > input.cloud.size() ? LogWarning(text + ". Are these cameras of this splat?") : LogInfo(text);
  }
  report.camera_rule = sizes.rule == CameraPixelRule::kMedian ? "median" : "smallest";
  if (!sizes.why.empty()) LogInfo(Cat("--camera-rule ", report.camera_rule, ": ", sizes.why));
  report.train_width = train_width;
  return sizes;
}

// The one test of cameras: whether the splat says, with certainty, that its pixels were far smaller.
bool AreFarOff(double median, const Result<Reading>& reading) {
  if (!reading.ok() || reading->strangeness > 1) return false;
  const double half = std::log(reading->high / reading->pixel);
  return std::log(median / reading->pixel) > std::log(kFarOff) + kCertain * half;
}

Result<KnownPixels> PixelsFrom(const EnhanceOptions& options, bool said, const Result<Reading>& reading,
                               const EnhanceInput& input, EnhanceReport& report) {
  KnownPixels known;
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraPixelSizes sizes, PixelsOfCameras(options, input, report));
  if (!said && AreFarOff(double{sizes.median}, reading)) {
    LogWarning(Cat("the cameras say a training pixel of ", sizes.median, ", the splat itself ", reading->pixel,
                   ", which is taken. Are they its training cameras, in its unit and at the width of its training "
                   "(--train-width)? --mode says that they are"));
    report.pixel_size_source = PixelSizeSource::kRead;
    return known;
  }
  known.pixel = double{sizes.median};
  known.sizes = std::move(sizes.sizes);
  return known;
}

// What the caller knows of its pixels.
Result<KnownPixels> FindKnownPixels(const EnhanceOptions& options, bool with_pictures, bool said,
                                    const Result<Reading>& reading, const EnhanceInput& input, EnhanceReport& report) {
  if (options.cameras) {
    report.pixel_size_source = PixelSizeSource::kCameras;
    return PixelsFrom(options, said, reading, input, report);
  }
  if (options.pixel_size) {
    report.pixel_size_source = PixelSizeSource::kGiven;
    return KnownPixels{{static_cast<float>(*options.pixel_size)}, options.pixel_size};
  }
  if (with_pictures) {  // they come with the cameras that took them, and are as large as they were in training
    ANCHORSPLAT_ASSIGN_OR_RETURN(
        TrainingViews project,
        OpenProject(options.refine.images,
                    {.hold_out = 0, .downscale = options.refine.downscale, .origin = options.refine.origin}));
    EnhanceOptions with_cameras = options;
    with_cameras.cameras.emplace().cameras = std::move(project.train);
    with_cameras.camera_rule = CameraPixelRule::kMedian;
    report.pixel_size_source = PixelSizeSource::kPictures;
    return PixelsFrom(with_cameras, said, reading, input, report);
  }
  report.pixel_size_source = PixelSizeSource::kRead;
  return KnownPixels{};
}

Status CheckPixelOptions(const EnhanceOptions& options) {
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
  return {};
}

// Outlines of what has been enhanced say nothing about the pixels of the rest.
Result<Reading> ReadInside(const Region& region, const GaussianCloud& cloud, const ReadingModel& model) {
  std::vector<int64_t> inside;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (region.Holds(cloud.means.data() + 3 * i)) inside.push_back(i);
  }
  if (inside.empty()) return Read(cloud, model);  // which is refused later on
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud part, Subset(cloud, inside));
  return Read(part, model);
}

bool HasNetwork(const MethodPlan& plan) {
  return plan.method->adds_detail || (plan.start != nullptr && plan.start->adds_detail);
}

// Things that lie apart, as of merged splats, may each have a training of their own: each is read by itself. Nothing
// where all is one.
void ReadParts(const MethodPlan& plan, TreatmentRequest request, const Treatment& of_whole, const ReadingModel& model,
               EnhanceInput& input, EnhanceReport& report) {
  const CloudComponents components = FindComponents(input.cloud);
  if (components.component.empty() || components.count < 2 || static_cast<size_t>(components.count) > kMostParts)
    return;
  std::vector<std::vector<int64_t>> rows(static_cast<size_t>(components.count) + 1);  // at last what is no part
  for (int64_t i = 0; i < input.cloud.size(); ++i) {
    const int32_t part = components.component[static_cast<size_t>(i)];
    rows[part < 0 ? rows.size() - 1 : static_cast<size_t>(part)].push_back(i);
  }
  request.mode = of_whole.mode;
  std::vector<Treatment> treatments;
  double least = of_whole.pixel > 0 ? of_whole.pixel : report.reading->low;
  const double nothing = kNextToNothing * report.reading->pixel;
  for (size_t k = 0; k + 1 < rows.size(); ++k) {
    LeaveIfAbandoned();
    const auto part = Subset(input.cloud, rows[k]);
    const auto reading = part.ok() ? Read(*part, model) : Result<Reading>(part.error());
    Treatment& treatment = treatments.emplace_back();
    if (reading.ok()) treatment = Treat(*reading, request);
    if (treatment.method == TreatmentMethod::kNone) treatment.pixel = nothing;
    least = std::min(least, treatment.pixel);
    report.parts.push_back({std::ssize(rows[k]), treatment.pixel, treatment.method == TreatmentMethod::kNetwork});
  }
  treatments.push_back({.method = TreatmentMethod::kFilter, .mode = of_whole.mode, .pixel = least});
  input.pixel_sizes.assign(static_cast<size_t>(input.cloud.size()), static_cast<float>(nothing));
  std::vector<char> by_network(input.pixel_sizes.size(), 0);
  for (size_t k = 0; k < rows.size(); ++k) {
    for (const int64_t i : rows[k]) {
      input.pixel_sizes[static_cast<size_t>(i)] = static_cast<float>(treatments[k].pixel);
      by_network[static_cast<size_t>(i)] = treatments[k].method == TreatmentMethod::kNetwork ? 1 : 0;
    }
  }
  Buffer<float> sizes = input.pixel_sizes;
  report.pixel_size = double{Quantile(sizes, 0.5)};
  const auto taken = std::ranges::count(by_network, 1);
  if (plan.start == nullptr && plan.method->adds_detail && taken < std::ssize(by_network)) {
    input.by_network = std::move(by_network);
  }
  LogInfo(Cat("made of ", components.count, " things that lie apart, each read by itself"));
}

// What cameras saw from near has smaller pixels than what they saw from afar.
void ReadPlaces(const ReadingModel& model, EnhanceInput& input, EnhanceReport& report) {
  Buffer<float> ratios = PixelRatios(input.cloud, model);
  if (ratios.empty()) return;
  for (float& ratio : ratios) ratio *= static_cast<float>(report.pixel_size);
  input.pixel_sizes = ratios;
  report.pixel_size_range = {double{Quantile(ratios, 0.1)}, double{Quantile(ratios, 0.9)}};
  LogInfo(Cat("training pixels differ across the splat: ", report.pixel_size_range->first, " to ",
              report.pixel_size_range->second, " are taken"));
}

void SayNothingIsDone(const EnhanceReport& report, std::optional<RenderMode> tag) {
  const Reading& reading = *report.reading;
  const std::string_view mode = tag ? NameOf(*tag) : "classic";
  LogWarning(HasItsWidth(reading.likeliest())
                 ? Cat("left as it is: looks like ", LooksInWords(reading), ", which has its width. --mode ", mode,
                       " enhances it all the same")
                 : Cat("left as it is: looks like ", LooksInWords(reading),
                       ", and nothing is sure to make it better. --cameras or --pixel-size says more about it, --mode ",
                       mode, " enhances it all the same"));
}

void SayWhatIsTaken(const Treatment& treatment, const EnhanceReport& report) {
  const Reading& reading = *report.reading;
  std::string text = Cat("looks like ", LooksInWords(reading));
  if (report.pixel_size_source == PixelSizeSource::kRead) {
    text += Cat(", training pixel ", reading.pixel, " (", reading.low, " to ", reading.high, "); ", treatment.pixel,
                treatment.gain > 0 ? " is taken, from which most is expected" : " is taken, to be safe",
                ". --cameras or --pixel-size makes it exact");
  }
  LogInfo(text);
}

// Of options that were given.
void SayWhatHasNoEffect(const EnhanceOptions& options, std::initializer_list<const char*> of, std::string_view why) {
  std::string names;
  int count = 0;
  for (const char* name : of) {
    if (!IsGiven(options, name)) continue;
    names += Cat(count++ > 0 ? ", --" : "--", name);
  }
  if (count > 0) LogWarning(Cat(names, count > 1 ? " have" : " has", " no effect: ", why));
}

// A splat that has lost nothing stays as it is, whatever was asked for.
void SayTheSplatStays(const EnhanceOptions& options) {
  SayWhatHasNoEffect(options, {"pixel-size", "model", "copies", "merge-cost", "prune-opacity"},
                     "the splat stays as it is");
}

// The filter in the place of a network that nobody asked for.
void LeaveNetworkOut(const EnhanceOptions& options, MethodPlan& plan) {
  if (!HasNetwork(plan)) return;
  const std::string name = plan.Name();
  LogInfo(Cat("the filter instead of ", name, ", as more is expected of it (--method ", name, " takes the network)"));
  SayWhatHasNoEffect(options, {"model", "copies", "merge-cost", "prune-opacity"}, "the filter is taken");
  if (plan.start != nullptr && plan.start->adds_detail) plan.start = nullptr;
  if (plan.method->adds_detail) plan.method = &FilterMethod();
}

// What the file itself says; empty: nothing.
std::string_view LostNothing(const GaussianCloud& cloud) {
  if (IsFittedToPixelAreas(cloud)) return "it says that it was fitted to the areas of pixels and has lost no width";
  if (IsMarkedEnhanced(cloud)) return "it says that it has been enhanced before";
  if (IsMarkedPartEnhanced(cloud)) return "it says that a part of it has been enhanced before (--region takes another)";
  return "";
}

}  // namespace

Status ChooseTreatment(const EnhanceOptions& options, MethodPlan& plan, EnhanceInput& input, EnhanceReport& report) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckPixelOptions(options));
  GaussianCloud& cloud = input.cloud;
  if (ShowsNothing(cloud)) {
    LogWarning(Cat("left as it is: all of its ", WithThousands(cloud.size()),
                   " Gaussians are less opaque than 1/255, and nothing of it shows"));
    report.pixel_size_source = PixelSizeSource::kUnknown;
    return {};
  }
  const bool closer = options.upscale > 1;
  const bool said = options.mode.has_value() || options.filter_strength.has_value();
  const std::string_view lost_nothing = options.filter_strength ? "" : LostNothing(cloud);
  const bool stays = closer && !plan.method->invents;  // where there is no width to give back
  if (!lost_nothing.empty() && stays) {
    LogWarning(Cat("left as it is: ", lost_nothing, ". --filter-strength F enhances it all the same"));
    SayTheSplatStays(options);
  }
  const bool part_alone = options.region && input.partly_enhanced;
  const ReadingModel& model = options.reading_model == nullptr ? ReadingModel::Shipped() : *options.reading_model;
  const auto reading = part_alone ? ReadInside(*options.region, cloud, model) : Read(cloud, model);
  if (reading.ok()) {
    report.reading = *reading;
    input.showing = reading->showing;
  }
  const bool with_pictures = plan.method->takes_start && !options.refine.images.empty();
  ANCHORSPLAT_ASSIGN_OR_RETURN(KnownPixels known,
                               FindKnownPixels(options, with_pictures, said, reading, input, report));
  if (!reading.ok() && !known.pixel) {
    LogWarning(
        Cat("left as it is: ", reading.error().message, ", too little to read. --pixel-size or --cameras tells"));
    report.pixel_size_source = PixelSizeSource::kUnknown;
    return {};
  }

  const bool auto_chosen = !plan.chosen_by.empty();
  TreatmentRequest request{.mode = cloud.render_mode,
                           .mode_is_said = said,
                           .pixel = known.pixel,
                           .filter = auto_chosen || !HasNetwork(plan),
                           .network = HasNetwork(plan)};
  // A strength is one of a splat as its file says it is.
  if (options.filter_strength) request.mode = cloud.render_mode.value_or(RenderMode::kClassic);
  if (auto_chosen && options.upscale < kLeastUpscaleOfNetworks) request.network = false;
  Treatment treatment;
  if (!lost_nothing.empty()) {
    treatment.pixel = known.pixel.value_or(reading.ok() ? reading->pixel : 0);
  } else if (reading.ok() && !(known.pixel && reading->strangeness > 1)) {
    treatment = Treat(*reading, request);
  } else {  // too few to read, or like nothing that was learned from: who knows its pixels is believed
    treatment = {.method = request.network ? TreatmentMethod::kNetwork : TreatmentMethod::kFilter,
                 .mode = cloud.render_mode.value_or(RenderMode::kClassic),
                 .pixel = *known.pixel};
  }

  const bool none = treatment.method == TreatmentMethod::kNone;
  if (treatment.method == TreatmentMethod::kFilter && auto_chosen) LeaveNetworkOut(options, plan);
  if (closer && !none && !cloud.render_mode && treatment.mode == RenderMode::kAntialiased) {
    cloud.render_mode = treatment.mode;
  }
  input.filter_strength =
      options.filter_strength.value_or(none ? 0 : DefaultFilterStrength(options.upscale, cloud.render_mode));
  if (options.filter_strength && closer && *options.filter_strength > 0 &&
      *options.filter_strength <= ShownStrength(options.upscale, cloud.render_mode)) {
    LogWarning(Cat("a strength of ", input.filter_strength, " is no more than what the closer view's own pixels add (",
                   ShownStrength(options.upscale, cloud.render_mode), "): nothing changes"));
  }
  report.filter_strength = input.filter_strength;
  const double taken = !none ? treatment.pixel : reading.ok() ? reading->pixel : 0;
  report.pixel_size = known.pixel.value_or(taken);
  input.pixel_sizes = std::move(known.sizes);
  if (input.pixel_sizes.empty()) input.pixel_sizes.assign(1, static_cast<float>(taken));
  if (closer && lost_nothing.empty() && reading.ok()) {
    if (none && !stays) {
      LogInfo(Cat("looks like ", LooksInWords(*reading), ": no width is given back"));
    } else if (none && !options.filter_strength) {
      SayNothingIsDone(report, cloud.render_mode);
      SayTheSplatStays(options);
    } else if (!(said && known.pixel)) {  // else nothing was taken from the reading
      SayWhatIsTaken(treatment, report);
    }
  }
  if (!none && !known.pixel && !part_alone && !options.filter_strength) {
    ReadParts(plan, request, treatment, model, input, report);
    if (report.parts.empty()) ReadPlaces(model, input, report);
  }
  input.pixel_size = report.pixel_size;
  return {};
}

}  // namespace anchorsplat
