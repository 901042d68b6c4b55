#include "enhance/choose_treatment.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <iterator>
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
#include "enhance/known_pixels.h"
#include "fit/pixel_model.h"
#include "reading/places.h"
#include "reading/treatment.h"
#include "render/constants.h"

namespace anchorsplat {

namespace {

// Closer views than this lose with a network against the filter: 0.2 dB at 1.1, 0.3 at 1.2.
constexpr double kLeastUpscaleOfNetworks = 1.35;
// With more components, they are not read one by one.
constexpr size_t kMostParts = 12;
// Relative to the whole splat's pixel: too small to add visible width.
constexpr double kNextToNothing = 0.02;

bool ShowsNothing(const GaussianCloud& cloud) {
  return std::ranges::none_of(cloud.opacity_logits, [](float logit) { return Sigmoid(logit) >= kMinAlpha; });
}

// Reads the region's Gaussians; outlines of already enhanced ones say nothing about the others' pixels.
Result<Reading> ReadInside(const Region& region, const GaussianCloud& cloud, const ReadingModel& model) {
  std::vector<int64_t> inside;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (region.Contains(cloud.means.data() + 3 * i)) inside.push_back(i);
  }
  if (inside.empty()) return Read(cloud, model);  // an empty region is rejected later
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud part, Subset(cloud, inside));
  return Read(part, model);
}

bool HasNetwork(const MethodPlan& plan) {
  return plan.method->adds_detail || (plan.start != nullptr && plan.start->adds_detail);
}

// Reads each component by itself, as merged splats may come from several trainings, and subject and background have
// different pixels. Returns the pixel sizes in words; empty if there is only one component.
std::string ReadParts(const MethodPlan& plan, TreatmentRequest request, const Treatment& of_whole,
                      const ReadingModel& model, EnhanceInput& input, EnhanceReport& report) {
  const CloudComponents components = FindComponents(input.cloud);
  if (components.component.empty() || components.count < 2 || static_cast<size_t>(components.count) > kMostParts)
    return "";
  std::vector<std::vector<int64_t>> rows(static_cast<size_t>(components.count) + 1);  // the last: in no component
  for (int64_t i = 0; i < input.cloud.size(); ++i) {
    const int32_t part = components.component[static_cast<size_t>(i)];
    rows[part < 0 ? rows.size() - 1 : static_cast<size_t>(part)].push_back(i);
  }
  request.mode = of_whole.mode;
  std::vector<Treatment> treatments;
  Buffer<float> used;
  double least = of_whole.pixel > 0 ? of_whole.pixel : report.reading->low;
  const double nothing = kNextToNothing * report.reading->pixel;
  for (size_t k = 0; k + 1 < rows.size(); ++k) {
    LeaveIfAbandoned();
    const auto part = Subset(input.cloud, rows[k]);
    const auto reading = part.ok() ? Read(*part, model) : Result<Reading>(part.error());
    Treatment& treatment = treatments.emplace_back();
    if (reading.ok()) treatment = Treat(*reading, request);
    if (treatment.method != TreatmentMethod::kNone) used.push_back(static_cast<float>(treatment.pixel));
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
  Buffer<float> sharpened;
  std::ranges::copy_if(input.pixel_sizes, std::back_inserter(sharpened), [=](float size) { return size > nothing; });
  if (!sharpened.empty()) report.pixel_size = double{Quantile(sharpened, 0.5)};
  const auto taken = std::ranges::count(by_network, 1);
  if (plan.start == nullptr && plan.method->adds_detail && taken < std::ssize(by_network)) {
    input.by_network = std::move(by_network);
  }
  std::string text = "Leaving";
  if (!used.empty()) {
    const auto [least_used, most_used] = std::ranges::minmax(used);
    text = Cat("Using ", least_used, least_used < most_used ? Cat(" to ", most_used) : "", " in");
  }
  const int64_t some = used.empty() ? components.count : std::ssize(used);
  return Cat(text, some < components.count ? Cat(" ", some, " of") : "", " its ", components.count, " separate parts");
}

// Pixel sizes per place: parts seen from near have smaller pixels than parts seen from afar. Returns them in words;
// empty if they do not vary.
std::string ReadPlaces(const ReadingModel& model, EnhanceInput& input, EnhanceReport& report) {
  Buffer<float> ratios = PixelRatios(input.cloud, model);
  if (ratios.empty()) return "";
  for (float& ratio : ratios) ratio *= static_cast<float>(report.pixel_size);
  input.pixel_sizes = ratios;
  report.pixel_size_range = {double{Quantile(ratios, 0.1)}, double{Quantile(ratios, 0.9)}};
  return Cat("Using ", report.pixel_size_range->first, " to ", report.pixel_size_range->second,
             ", as it varies across the splat");
}

// ". --model and --copies have no effect", of those that were given; empty: none was.
std::string WithoutEffect(const EnhanceOptions& options, std::initializer_list<const char*> of) {
  std::vector<std::string> names;
  for (const char* name : of) {
    if (IsGiven(options, name)) names.push_back(Cat("--", name));
  }
  std::string text;
  for (size_t k = 0; k < names.size(); ++k) text += (k == 0 ? "" : k + 1 < names.size() ? ", " : " and ") + names[k];
  return text.empty() ? text : Cat(". ", text, names.size() > 1 ? " have" : " has", " no effect");
}

// A splat that has lost nothing stays as it is, whatever was asked for.
void SayTheSplatStays(const EnhanceOptions& options, const std::string& why) {
  LogWarning(Cat("left unchanged: ", why,
                 WithoutEffect(options, {"pixel-size", "model", "copies", "merge-cost", "prune-opacity"})));
}

void SayNothingIsDone(const EnhanceOptions& options, const EnhanceReport& report, std::optional<RenderMode> tag) {
  const Reading& reading = *report.reading;
  const std::string_view mode = tag ? NameOf(*tag) : "classic";
  SayTheSplatStays(options, HasFullWidth(reading.likeliest())
                                ? Cat("looks like ", DescribeProvenance(reading),
                                      ", which needs no sharpening. --mode ", mode, " enhances it anyway")
                                : Cat("looks like ", DescribeProvenance(reading),
                                      ", which no method is sure to improve. Pass --cameras or --pixel-size, or "
                                      "--mode ",
                                      mode, " to enhance it anyway"));
}

// `sizes`: pixel sizes that vary, in words; may be empty.
void SayWhatIsTaken(const Treatment& treatment, const std::string& sizes, const EnhanceReport& report) {
  const Reading& reading = *report.reading;
  std::string text = Cat("looks like ", DescribeProvenance(reading));
  if (report.pixel_size_source == PixelSizeSource::kRead) {
    text += Cat(". Estimated training pixel: ", reading.pixel, " (likely ", reading.low, " to ", reading.high, "). ",
                sizes.empty()
                    ? Cat("Using ", treatment.pixel, treatment.gain > 0 ? ", which should look best" : " to be safe")
                    : sizes,
                ". Pass --cameras or --pixel-size for the exact size");
  }
  LogInfo(text);
}

// The filter in the place of a network that nobody asked for.
void LeaveNetworkOut(const EnhanceOptions& options, MethodPlan& plan) {
  if (!HasNetwork(plan)) return;
  const std::string name = plan.Name();
  const bool starts = plan.start != nullptr && plan.start->adds_detail;
  const std::string text =
      Cat(starts ? "starting from" : "using", " the filter, which should do better here than the network. --method ",
          name, " forces the network");
  const std::string pointless = WithoutEffect(options, {"model", "copies", "merge-cost", "prune-opacity"});
  pointless.empty() ? LogInfo(text) : LogWarning(text + pointless);
  if (starts) plan.start = nullptr;
  if (plan.method->adds_detail) plan.method = &FilterMethod();
}

// What the file itself says about lost width; empty: nothing.
std::string_view LostNothing(const GaussianCloud& cloud) {
  if (IsFittedToPixelAreas(cloud)) return "its comments say it was fitted with --pixel area and needs no sharpening";
  if (IsMarkedEnhanced(cloud)) return "its comments say it is already enhanced";
  if (IsMarkedPartEnhanced(cloud))
    return "its comments say part of it is already enhanced (--region enhances another part)";
  return "";
}

// A wrong pixel size costs most of the gain. Of a width that was not given, a warning was already printed.
void SayIfUnlike(const EnhanceOptions& options, const EnhanceReport& report) {
  const Reading& reading = *report.reading;
  const double pixel = report.pixel_size;
  if (reading.strangeness > 1 || (pixel >= reading.low && pixel <= reading.high)) return;
  if (report.train_width && !options.train_width) return;
  const bool given = report.pixel_size_source == PixelSizeSource::kGiven;
  LogInfo(Cat(given ? "--pixel-size " : "the cameras' pixel size, ", pixel, given ? "" : ",",
              " is outside the splat's own estimate (", reading.low, " to ", reading.high, ")",
              given || pixel > reading.high ? "" : ". If it was fitted to smaller pictures, pass their --train-width"));
}

}  // namespace

Status ChooseTreatment(const EnhanceOptions& options, MethodPlan& plan, EnhanceInput& input, EnhanceReport& report) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckPixelOptions(options));
  GaussianCloud& cloud = input.cloud;
  if (ShowsNothing(cloud)) {
    LogWarning(
        Cat("left unchanged: all ", WithThousands(cloud.size()), " Gaussians are invisible (opacity below 1/255)"));
    report.pixel_size_source = PixelSizeSource::kUnknown;
    return {};
  }
  const bool closer = options.upscale > 1;
  const bool said = options.mode.has_value() || options.filter_strength.has_value();
  const std::string_view lost_nothing = options.filter_strength ? "" : LostNothing(cloud);
  const bool stays = closer && !plan.method->invents(options);  // unchanged if there is no width to restore
  if (!lost_nothing.empty() && stays) {
    SayTheSplatStays(options, Cat(lost_nothing, ". --filter-strength F enhances it anyway"));
  }
  const bool part_alone = options.region && input.partly_enhanced;
  const ReadingModel& model = options.reading_model == nullptr ? ReadingModel::Shipped() : *options.reading_model;
  const auto reading = part_alone ? ReadInside(*options.region, cloud, model) : Read(cloud, model);
  if (reading.ok()) report.reading = *reading;
  const bool with_pictures = plan.method->takes_start && !options.refine.images.empty();
  ANCHORSPLAT_ASSIGN_OR_RETURN(KnownPixels known, FindKnownPixels(options, with_pictures, said,
                                                                  reading.ok() ? &*reading : nullptr, input, report));
  if (!reading.ok() && !known.pixel) {
    LogWarning(Cat("left unchanged: the pixel size cannot be estimated (", reading.error().message,
                   "). Pass --cameras or --pixel-size"));
    report.pixel_size_source = PixelSizeSource::kUnknown;
    return {};
  }

  const bool auto_chosen = !plan.chosen_by.empty();
  TreatmentRequest request{.mode = cloud.render_mode,
                           .mode_is_given = said,
                           .pixel = known.pixel,
                           .filter = auto_chosen || !HasNetwork(plan),
                           .network = HasNetwork(plan)};
  // A given strength refers to the render mode in the file.
  if (options.filter_strength) request.mode = cloud.render_mode.value_or(RenderMode::kClassic);
  if (auto_chosen && options.upscale < kLeastUpscaleOfNetworks) request.network = false;
  Treatment treatment;
  if (!lost_nothing.empty()) {
    treatment.pixel = known.pixel.value_or(reading.ok() ? reading->pixel : 0);
  } else if (reading.ok() && !(known.pixel && reading->strangeness > 1)) {
    treatment = Treat(*reading, request);
  } else {  // unreadable, or unlike the training set: a given pixel is believed
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
    LogWarning(Cat("a filter strength of ", input.filter_strength,
                   " changes nothing: the pixels of the closer view already "
                   "add ",
                   ShownStrength(options.upscale, cloud.render_mode), ". Pass more"));
  }
  report.filter_strength = input.filter_strength;
  const double taken = !none ? treatment.pixel : reading.ok() ? reading->pixel : 0;
  report.pixel_size = known.pixel.value_or(taken);
  input.pixel_sizes = std::move(known.sizes);
  if (input.pixel_sizes.empty()) input.pixel_sizes.assign(1, static_cast<float>(taken));
  std::string sizes;
  if (!none && !known.pixel && !part_alone && !options.filter_strength) {
    sizes = ReadParts(plan, request, treatment, model, input, report);
    if (sizes.empty()) sizes = ReadPlaces(model, input, report);
  }
  if (closer && lost_nothing.empty() && reading.ok()) {
    if (none && !stays) {
      LogInfo(Cat("looks like ", DescribeProvenance(*reading), ", which needs no sharpening; only detail is added"));
    } else if (none && !options.filter_strength) {
      SayNothingIsDone(options, report, cloud.render_mode);
    } else if (!(said && known.pixel)) {  // else nothing was taken from the reading
      SayWhatIsTaken(treatment, sizes, report);
    }
  }
  if (closer && !none && known.pixel && reading.ok() && lost_nothing.empty() && treatment.pixel == *known.pixel) {
    SayIfUnlike(options, report);
  }
  input.pixel_size = report.pixel_size;
  return {};
}

}  // namespace anchorsplat
