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
#include "enhance/model_settings.h"
#include "enhance/pixel_size.h"
#include "enhance/refine_options.h"
#include "enhance/unseen_gaussians.h"
#include "reading/reading.h"

namespace anchorsplat {

struct EnhanceMethod;

// What every method is told. Spaces: the cloud in stored space, lengths in world units.
struct EnhanceOptions {
  // Ways to enhance that there are; null: BasicMethods(). model/model_method.h has those with networks. Not owned.
  const std::vector<EnhanceMethod>* methods = nullptr;
  // What splats are read with; null: the program's own model. Others are for measuring. Not owned.
  const ReadingModel* reading_model = nullptr;
  // The name of one of them, or "auto": what a reading of the splat says is best, of those that are ready. Or two,
  // "A+B": B begins where A ended, if it can (EnhanceMethod::takes_start).
  std::string method = "auto";
  // Instead of a method, for those who know none: "fast", an instant one; "good", that and gentle refinement; "best",
  // refinement with the pictures of refine.images, "good" where there are none. Empty: `method` says.
  std::string quality;
  // What the user gave, by the names that the command line has for it ("filter-strength"). CheckOptions refuses those
  // that would change nothing.
  std::vector<std::string> given;
  // How the splat was rasterized in training, by the caller, who wants it enhanced as such; else its tag says it, or a
  // reading of the splat.
  std::optional<RenderMode> mode;
  double upscale = 4;                     // u ≥ 1: how many times closer the splat will be seen
  std::optional<double> filter_strength;  // f of the filter; DefaultFilterStrength otherwise
  std::optional<double> pixel_size;       // p_LR for all Gaussians; from `cameras`, from the pictures to refine
                                          // against, or read off the splat otherwise
  std::optional<CameraSet> cameras;       // the training cameras
  std::optional<int> train_width;         // pixels; see AssumedTrainWidth
  CameraPixelRule camera_rule = CameraPixelRule::kAuto;
  RefineOptions refine;
  RefineControl control;  // of methods that take long
  ModelSettings model;    // of networks
  // Before all else: Gaussians that nobody misses over the training background are taken out. Of the views of `cameras`
  // or of the pictures to refine against, else of views all around.
  bool clean = false;
  // Gaussians of the result at most; 0: no bound. SetBudget (enhance/gaussian_budget.h) tells the methods'
  // own options.
  int64_t max_gaussians = 0;
  // Only what lies in there is enhanced. The rest stays bit by bit, behind it, and a splat of which only a part was is
  // marked as enhanced in part.
  std::optional<Region> region;
  std::optional<std::array<float, 3>> background;  // of the training views, for `clean` and refinement; what the
                                                   // cameras say otherwise, else the splat's comment, else black
  uint64_t seed = 0;
};

// Whether the caller named the option, by its name without dashes.
bool IsGiven(const EnhanceOptions& options, std::string_view name);

// Where pixel sizes are from.
enum class PixelSizeSource {
  kNone,      // of methods that need none
  kGiven,     // the caller says it
  kCameras,   // the training cameras
  kPictures,  // the cameras of the pictures to refine against
  kRead,      // a reading of the splat
  kUnknown,   // nobody knows: the splat has been left as it is
};
std::string_view NameOf(PixelSizeSource source);  // "", "given", "cameras", "pictures", "read", "unknown"

// What was done with a thing that lies apart from others.
struct PartTreatment {
  int64_t gaussians = 0;
  double pixel_size = 0;  // that was taken, world units
  bool by_network = false;
};

// Something that a method has to tell: whether it was so; counts, which are whole; measurements, which are not.
using FactValue = std::variant<bool, int64_t, double>;
using Fact = std::pair<std::string, FactValue>;

// What one method did; "A+B" are two steps.
struct StepReport {
  std::string method;
  int64_t dropped = 0;             // Gaussians that it could not read
  bool interrupted = false;        // stopped by the user; its result is valid all the same
  std::optional<RefinePlan> plan;  // of a refinement
  std::vector<Fact> facts;  // what else it has to tell, by name: the steps of a refinement, the anchors of a network
};

// What was done, for people and for --json.
struct EnhanceReport {
  std::string method;
  std::string quality;  // as it was asked for
  int64_t gaussians_in = 0;
  int64_t dropped = 0;                     // rows with values that are not finite, and what the steps dropped
  std::optional<UnseenGaussians> cleaned;  // of those that are not dropped
  int64_t gaussians_out = 0;
  int64_t region_in = 0;                // Gaussians in the region, where there is one …
  std::optional<int64_t> kept_outside;  // … and those outside, which are part of the result
  double upscale = 1;
  double filter_strength = 0;
  double pixel_size = 0;  // p_LR, the median when there is one per Gaussian
  // 10 and 90 % quantiles where a reading says that pixels differ across the splat.
  std::optional<std::pair<double, double>> pixel_size_range;
  PixelSizeSource pixel_size_source = PixelSizeSource::kNone;
  std::optional<Reading> reading;    // of the splat, or of its region; nothing where too little shows
  std::vector<PartTreatment> parts;  // things that lie apart, each read by itself; none where all is one
  std::string camera_rule;           // "smallest" or "median" where it came from cameras
  std::optional<int> train_width;    // pixels, given or assumed; nothing when the cameras' own size was taken
  std::vector<StepReport> steps;     // in their order; none where the splat was left alone
  bool interrupted = false;          // one of them was
  double seconds = 0;                // of the method itself
  double seconds_in_all = 0;         // with what is found out before, without reading and writing
};

// Whether a method that invents did so.
bool IsInvented(const EnhanceReport& report);

// The cloud as methods get it: rows that are not finite are gone; p_LR is known to those that need it.
struct EnhanceInput {
  GaussianCloud cloud;
  Buffer<float> pixel_sizes;  // one for all, or one per Gaussian
  double pixel_size = 0;      // their median
  double showing = 1;         // Reading::showing; 1 where nothing was read
  double filter_strength = 0;
  std::vector<char> by_network;   // [N], where a network is not for all: whether it is for this one; else empty
  bool partly_enhanced = false;   // of another part it says that it has been enhanced: only what is inside tells
  std::vector<char> inside;       // which of the cloud's Gaussians are enhanced: results are of these; empty: all
  GaussianCloud start;            // what the method before it made, of "A+B"; else empty
  bool start_has_detail = false;  // EnhanceMethod::adds_detail of that method
  bool is_refined = false;        // refinement goes on from what the method makes
};

// How a method is about to be used.
struct MethodUse {
  const EnhanceOptions& options;
  const EnhanceMethod* start = nullptr;  // the method before it
};

// An option that changes what a method does.
struct MethodOption {
  std::string name;  // as in EnhanceOptions::given
  // What it still needs for that, as the end of "it works only …": "with --images". Nothing, empty: it works.
  std::function<std::string(const MethodUse&)> lacks;
};

// A way to enhance. `ready` says whether it can run with these options alone (weights there, images given, …) and is
// what "auto" asks; `rank` orders them, higher is better.
struct EnhanceMethod {
  std::string name;
  std::string summary;  // one line for --help
  int rank = 0;
  bool takes_start = false;  // looks at EnhanceInput::start
  // Named alone it begins with the best instant method, if that one adds detail.
  std::function<bool(const EnhanceOptions&)> begins_with_best = [](const EnhanceOptions&) { return false; };
  bool adds_detail = false;  // shows more than the splat does, not only what it shows with other widths
  bool invents = false;  // also where a splat has lost nothing there is something to do: what it adds was never seen
  // Keeps what EnhanceOptions::control names: null for methods that keep nothing. Tells such a file from others, and
  // the file is the command's own from then on.
  bool (*is_checkpoint)(const std::filesystem::path&) = nullptr;
  bool keeps_when_asked = false;      // only where a checkpoint is named, or --resume says that there may be one
  std::vector<MethodOption> options;  // all that it looks at: this is the only place that says so
  // False: EnhanceInput::pixel_sizes may be empty, nothing is read. Asked once the method is ready. An error: it
  // could not run.
  std::function<Result<bool>(const EnhanceOptions&)> needs_pixel_size = [](const EnhanceOptions&) { return true; };
  // About how many Gaussians come of `count`, for what has to be known before the work begins.
  std::function<int64_t(int64_t count, const EnhanceOptions&)> expected = [](int64_t count, const EnhanceOptions&) {
    return count;
  };
  // Of one Gaussian on one core, about; 0: nobody knows before the work.
  std::function<double(const EnhanceOptions&)> seconds = [](const EnhanceOptions&) { return 0.0; };
  std::function<Status(const EnhanceOptions&)> ready;
  std::function<Result<GaussianCloud>(EnhanceInput, const EnhanceOptions&, StepReport&)> run;
};

const EnhanceMethod& FilterMethod();
// Those that need no weights: the filter, and refinement without and with pictures.
const std::vector<EnhanceMethod>& BasicMethods();
const std::vector<EnhanceMethod>& MethodsOf(const EnhanceOptions& options);

// --upscale, and those that say pixel sizes and the filter's strength.
std::vector<MethodOption> WidthOptions(const std::function<std::string(const MethodUse&)>& lacks = {});

// Which methods `method` and `quality` lead to.
struct MethodPlan {
  const EnhanceMethod* method = nullptr;  // never null
  const EnhanceMethod* start = nullptr;   // the one whose result it begins with, if there is one
  std::string chosen_by;                  // "auto" or "--quality …"; empty when the user named the method
  std::string Name() const;               // "refine", "model+refine"
  // Whether its last method keeps a checkpoint, as these options are.
  bool KeepsCheckpoint(const EnhanceOptions& options) const;
};

// kBadArgument: methods or qualities that there are none of, a method that is not ready or cannot go on from another's
// result, a quality and a method that is another, pictures for a quality that looks at none.
Result<MethodPlan> PlanEnhancement(const EnhanceOptions& options);

// kBadArgument: that, or something `given` that has no effect with this plan; says with what it would have one. Names
// that no method knows are of no concern here.
Status CheckOptions(const EnhanceOptions& options);

// About how many Gaussians Enhance() makes of `count`; `count` where no method can be chosen.
int64_t ExpectedGaussians(int64_t count, const EnhanceOptions& options);

// About how long it takes on `threads` cores; nothing where that depends on more than their number, as of refinements.
std::optional<double> ExpectedSeconds(int64_t count, const EnhanceOptions& options, int threads);

// With what the error of a splat begins of which no Gaussian can be drawn. Enhance() knows no file name to put before.
inline constexpr std::string_view kNoneUsable = "none of the ";

struct Enhanced {
  GaussianCloud cloud;
  EnhanceReport report;
};

// Runs the method. Logs what it assumed: what the splat was read as, training width, why one is left alone, how many
// rows were dropped. A result that was given
// width back says so in its comments (core/splat_comments.h). kBadArgument: that of CheckOptions, both pixel_size and
// cameras, upscale < 1; kBadFile: no usable Gaussian; and whatever the method reports.
Result<Enhanced> Enhance(GaussianCloud cloud, const EnhanceOptions& options);

}  // namespace anchorsplat
