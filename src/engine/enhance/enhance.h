#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/region.h"
#include "core/result.h"
#include "enhance/method_option.h"
#include "enhance/model_settings.h"
#include "enhance/pixel_size.h"
#include "enhance/refine_options.h"
#include "enhance/unseen_gaussians.h"
#include "reading/reading.h"

namespace anchorsplat {

// Input of every method. The cloud is in stored space, lengths are in world units.
struct EnhanceOptions {
  // Available methods; null: BasicMethods(). model/model_method.h has those with networks. Not owned.
  const std::vector<EnhanceMethod>* methods = nullptr;
  // Model that reads splats; null: the built-in one. Others serve measurements. Not owned.
  const ReadingModel* reading_model = nullptr;
  // Name of a method, or "auto": the one that a reading of the splat finds best among those that are ready. "A+B" runs
  // A, then B on its result, if B supports that (EnhanceMethod::takes_start).
  std::string method = "auto";
  // Alternative to `method`: "fast", an instant method; "good", that plus gentle refinement; "best", refinement with
  // the pictures of refine.images, or without pictures "detail". Empty: `method` decides.
  std::string quality;
  // Options the user set, by their command-line names ("filter-strength"). CheckOptions rejects those without effect.
  std::vector<std::string> given;
  // Render mode in training, set by the caller, which overrides the reading. Unset: the splat's tag, or else its
  // reading.
  std::optional<RenderMode> mode;
  double upscale = 4;                     // u ≥ 1: how many times closer the splat will be seen
  std::optional<double> filter_strength;  // f of the filter; unset: DefaultFilterStrength
  std::optional<double> pixel_size;       // p_LR for all Gaussians; unset: from `cameras`, from the pictures to refine
                                          // against, or read off the splat
  std::optional<CameraSet> cameras;       // training cameras
  std::optional<int> train_width;         // of the widest, pixels; unset: see FindKnownPixels
  CameraPixelRule camera_rule = CameraPixelRule::kAuto;
  RefineOptions refine;
  RefineControl control;  // of long-running methods
  ModelSettings model;    // of networks
  // First removes Gaussians that cannot be seen over the training background (FindUnseen), in the views of `cameras` or
  // of the pictures to refine against, or else in views all around.
  bool clean = false;
  // Maximum number of Gaussians in the result; 0: no limit. SetBudget (enhance/gaussian_budget.h) also sets the
  // methods' own options.
  int64_t max_gaussians = 0;
  // Enhances only Gaussians in this region. The others are appended unchanged, bit by bit, and the splat is marked as
  // partly enhanced.
  std::optional<Region> region;
  std::optional<std::array<float, 3>> background;  // of the training views, for `clean` and refinement; unset: from the
                                                   // cameras, else from the splat's comment, else black
  uint64_t seed = 0;
  // Called before the planned methods run, unless they leave the splat unchanged or the filter replaces them. May be
  // null.
  std::function<void()> starting;
};

// Whether the user set the option with this name (without dashes).
bool IsGiven(const EnhanceOptions& options, std::string_view name);

// Where pixel sizes come from.
enum class PixelSizeSource {
  kNone,      // the method needs none
  kGiven,     // the caller
  kCameras,   // the training cameras
  kPictures,  // the cameras of the pictures to refine against
  kRead,      // a reading of the splat
  kUnknown,   // none found: the splat is left unchanged
};
std::string_view NameOf(PixelSizeSource source);  // "", "given", "cameras", "pictures", "read", "unknown"

// How one component of a splat was treated.
struct PartTreatment {
  int64_t gaussians = 0;
  double pixel_size = 0;  // assumed, world units
  bool by_network = false;
};

// A fact reported by a method: a flag, a count, or a measurement.
using FactValue = std::variant<bool, int64_t, double>;
using Fact = std::pair<std::string, FactValue>;

// What one method did; "A+B" has two steps.
struct StepReport {
  std::string method;
  int64_t dropped = 0;             // unreadable Gaussians
  bool interrupted = false;        // stopped by the user; the result is still valid
  std::optional<RefinePlan> plan;  // of a refinement
  std::vector<Fact> facts;         // further facts by name, such as refinement steps or a network's anchors
};

// What was done, for the log and for --json.
struct EnhanceReport {
  std::string method;
  std::string quality;  // as requested
  int64_t gaussians_in = 0;
  int64_t dropped = 0;                     // non-finite rows, and those dropped by the steps
  std::optional<UnseenGaussians> cleaned;  // rows numbered without the dropped ones
  int64_t gaussians_out = 0;
  int64_t region_in = 0;                // Gaussians in the region, if there is one …
  std::optional<int64_t> kept_outside;  // … and outside, which are part of the result
  double upscale = 1;
  double filter_strength = 0;
  double pixel_size = 0;  // p_LR; the median if it differs per Gaussian
  // 10 and 90 % quantiles, if the reading found that pixels differ across the splat.
  std::optional<std::pair<double, double>> pixel_size_range;
  PixelSizeSource pixel_size_source = PixelSizeSource::kNone;
  std::optional<Reading> reading;    // of the splat or its region; unset if too little is visible
  std::vector<PartTreatment> parts;  // separate components, each read by itself; empty if there is one
  std::string camera_rule;           // "smallest" or "median" if cameras were used
  std::optional<int> train_width;    // pixels, given, assumed or read off the splat; unset: the cameras' own
  std::vector<StepReport> steps;     // in order; empty if the splat was left alone
  bool interrupted = false;          // whether a step was interrupted
  double seconds = 0;                // of the methods
  double seconds_in_all = 0;         // including preparation, without reading and writing files
};

// Whether a method ran that invents detail.
bool IsInvented(const EnhanceReport& report);

// The input of one method. Non-finite rows are gone; pixel sizes are known if the method needs them.
struct EnhanceInput {
  GaussianCloud cloud;
  Buffer<float> pixel_sizes;         // p_LR, world units, one for all or one per Gaussian
  double pixel_size = 0;             // their median
  std::optional<CameraSet> cameras;  // training cameras at the size used in training, if they were given
  std::optional<int> times_larger;   // RefineInput::times_larger
  double filter_strength = 0;
  std::vector<char> by_network;   // [N] whether to use the network for each Gaussian; empty: for all
  bool partly_enhanced = false;   // another part is marked as enhanced, so only Gaussians inside count for readings
  std::vector<char> in_region;    // [N] Gaussians to enhance; the result contains only these. Empty: all
  GaussianCloud start;            // result of method A of "A+B"; else empty
  bool start_has_detail = false;  // adds_detail of method A
  bool is_refined = false;        // refinement follows this method
};

// A way to enhance. `ready` reports whether it can run with these options alone (weights present, images given, …);
// "auto" considers only ready ones. Higher `rank` is better.
struct EnhanceMethod {
  std::string name;
  std::string summary;  // one line for --help
  int rank = 0;
  bool takes_start = false;  // uses EnhanceInput::start
  // Whether, named alone, it starts from the best instant method's result, if that method adds detail.
  std::function<bool(const EnhanceOptions&)> starts_from_best = [](const EnhanceOptions&) { return false; };
  bool adds_detail = false;  // shows new detail, not just the splat's own at other widths
  // Whether it adds detail that was never observed, so that it applies even to splats that lost nothing.
  std::function<bool(const EnhanceOptions&)> invents = [](const EnhanceOptions&) { return false; };
  // Recognises this method's checkpoints and registers them as the command's own files. Null: writes no checkpoints.
  bool (*is_checkpoint)(const std::filesystem::path&) = nullptr;
  bool checkpoints_on_request = false;  // writes checkpoints only if one is named, or with --resume
  std::vector<MethodOption> options;    // every option that affects it; the only list
  // Whether EnhanceInput::pixel_sizes is needed; if not, the splat is not read. Called after `ready`. Errors prevent
  // the run.
  std::function<Result<bool>(const EnhanceOptions&)> needs_pixel_size = [](const EnhanceOptions&) { return true; };
  // Estimated number of Gaussians made of `count`.
  std::function<int64_t(int64_t count, const EnhanceOptions&)> expected_gaussians =
      [](int64_t count, const EnhanceOptions&) { return count; };
  // Estimated seconds per Gaussian on one core; 0: unknown in advance.
  std::function<double(const EnhanceOptions&)> seconds_per_gaussian = [](const EnhanceOptions&) { return 0.0; };
  std::function<Status(const EnhanceOptions&)> ready;
  std::function<Result<GaussianCloud>(EnhanceInput, const EnhanceOptions&, StepReport&)> run;
};

const EnhanceMethod& FilterMethod();
// Methods without weights: the filter, and refinement without and with pictures.
const std::vector<EnhanceMethod>& BasicMethods();
const std::vector<EnhanceMethod>& MethodsOf(const EnhanceOptions& options);

// --upscale, pixel sizes and filter strength.
std::vector<MethodOption> WidthOptions(const std::function<std::string(const MethodUse&)>& lacks = {});
// --max-gaussians.
MethodOption BudgetOption();

// The methods chosen by `method` and `quality`.
struct MethodPlan {
  const EnhanceMethod* method = nullptr;  // never null
  const EnhanceMethod* start = nullptr;   // the method that runs before it, or null
  std::string chosen_by;                  // "auto" or "--quality …"; empty if the user named the method
  std::string Name() const;               // "refine", "model+refine"
  // Whether the last method writes a checkpoint with these options.
  bool KeepsCheckpoint(const EnhanceOptions& options) const;
};

// Chooses the methods. Errors (kBadArgument): an unknown method or quality; a method that is not ready or cannot start
// from another's result; a quality that contradicts the method; pictures with a quality that ignores them.
Result<MethodPlan> PlanEnhancement(const EnhanceOptions& options);

// Errors (kBadArgument): those of PlanEnhancement; an option in `given` without effect on this plan (the message says
// what would give it one). Ignores names that no method knows.
Status CheckOptions(const EnhanceOptions& options);

// Estimated number of Gaussians that Enhance() makes of `count`; `count` if no method can be chosen.
int64_t ExpectedGaussians(int64_t count, const EnhanceOptions& options);

// Estimated duration on `threads` cores; unset if it depends on more than the count, as for refinements.
std::optional<double> ExpectedSeconds(int64_t count, const EnhanceOptions& options, int threads);

// Start of the error message for a splat without drawable Gaussians. Enhance() knows no file name to prepend.
inline constexpr std::string_view kNoneUsable = "none of the ";

struct Enhanced {
  GaussianCloud cloud;
  EnhanceReport report;
};

// Enhances a splat. Logs its assumptions: the splat's reading, training width, why a splat is left alone, the number of
// dropped rows. A result with restored width is marked in its comments (core/splat_comments.h).
// Errors: kBadArgument: those of CheckOptions, pixel_size together with cameras, upscale < 1; kBadFile: no usable
// Gaussian; those of the method.
Result<Enhanced> Enhance(GaussianCloud cloud, const EnhanceOptions& options);

}  // namespace anchorsplat
