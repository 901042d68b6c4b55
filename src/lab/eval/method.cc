#include "eval/method.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <ctime>
#include <memory>
#include <set>

#include "compact/copy_choice.h"
#include "compact/shipped_network.h"
#include "core/log.h"
#include "core/splat_comments.h"
#include "core/text.h"
#include "enhance/enhance.h"
#include "enhance/filter.h"
#include "enhance/gaussian_budget.h"
#include "eval/bicubic_fit.h"
#include "eval/filter_sweep.h"
#include "metrics/bicubic.h"
#include "metrics/image_metrics.h"
#include "model/any_network.h"
#include "model/model_method.h"
#include "model/network_options.h"
#include "published/enhance_with_published.h"
#include "reading/reading_model.h"
#include "render/constant_cloud.h"
#include "render/rasterizer.h"
#include "render/shown_range.h"
#include "tensors/tensor_file.h"
#include "upscale/enlarge_picture.h"
#include "upscale/upscaler.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

// Default strength as in `enhance`, by the splat's stated render mode.
double DefaultStrength(const BenchmarkObject& object) {
  return IsMarkedFullWidth(object.low) ? 0 : DefaultFilterStrength(object.upscale(), object.low.render_mode);
}

EvalMethod Raw() {
  return {"raw", "",
          [](const MethodTask& task) -> Result<MethodViews> { return SplatViews(task.object, task.object.low); }};
}

EvalMethod Filter(const std::string& name, std::optional<double> strength) {
  return {name, strength ? Cat("f ", *strength) : "default f",
          [strength](const MethodTask& task) -> Result<MethodViews> {
            const auto begin = Clock::now();
            ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraPixelSizes sizes, TruePixelSizes(task.object));
            GaussianCloud cloud = task.object.low;
            const double f = strength.value_or(DefaultStrength(task.object));
            const auto grown = ApplyFilter(cloud, sizes.sizes, {.upscale = task.object.upscale(), .strength = f});
            if (!grown.ok()) return grown.error();
            const double seconds = SecondsSince(begin);
            MethodViews views = SplatViews(task.object, std::move(cloud));
            views.seconds = seconds;
            views.facts = {{"f", f}, {"pixel_size", static_cast<double>(sizes.median)}};
            return views;
          }};
}

EvalMethod FilterBest() {
  return {"filter-best", "", [](const MethodTask& task) -> Result<MethodViews> {
            ANCHORSPLAT_ASSIGN_OR_RETURN(const double best, BestFilterStrength(task));
            return Filter("filter-best", best).prepare(task);
          }};
}

// Enlarges a low-resolution render to the camera's size.
using Enlarger = std::function<Result<Image>(const Image&, const Pinhole& high)>;

EvalMethod Enlarged(const std::string& name, const std::string& settings, const Enlarger& enlarge) {
  return {name, settings, [enlarge](const MethodTask& task) -> Result<MethodViews> {
            const BenchmarkObject& object = task.object;
            const auto rasterizer = std::make_shared<Rasterizer>();
            const auto still = std::make_shared<ConstantCloud>(object.low);
            MethodViews views;
            views.render = [&object, rasterizer, still, enlarge](size_t view) -> Result<Image> {
              RenderOptions options = DisplayOptions(object.low);
              options.background = object.background;
              RenderOutput output;
              ANCHORSPLAT_RETURN_IF_ERROR(rasterizer->Render(*still, object.LowCamera(view), options, output));
              Clamp01(output.color);
              return enlarge(output.color, object.views[view].intrinsics);
            };
            return views;
          }};
}

EvalMethod Upsample() {
  return Enlarged("upsample", "",
                  [](const Image& low, const Pinhole& high) { return EnlargeBicubic(low, high.width, high.height); });
}

EvalMethod Bicubic(int64_t steps) {
  return {"bicubic", Cat(steps, " steps"), [steps](const MethodTask& task) -> Result<MethodViews> {
            ANCHORSPLAT_ASSIGN_OR_RETURN(BicubicFit fit, FitEnlargedPictures(task, steps));
            MethodViews views = SplatViews(task.object, std::move(fit.cloud));
            views.seconds = fit.seconds;
            views.facts = {{"train_psnr", fit.train_psnr}};
            return views;
          }};
}

// Identity of a file version; equal texts mean the same file.
Result<std::string> Identity(const fs::path& path) {
  std::error_code code;
  const auto size = fs::file_size(path, code);
  if (code) return Error{ErrorCode::kNotFound, Cat(path.string(), ": no such file")};
  return Cat(path.string(), " ", size, " ", fs::last_write_time(path, code).time_since_epoch().count());
}

// The method of an upscaling network.
Result<EvalMethod> Upscaled(const fs::path& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string identity, Identity(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(Upscaler read, Upscaler::Read(file));
  const auto upscaler = std::make_shared<Upscaler>(std::move(read));
  return Enlarged(file.stem().string(), identity, [upscaler](const Image& low, const Pinhole& high) -> Result<Image> {
    const int factor = high.width / low.width;
    if (factor * low.width != high.width || factor * low.height != high.height) {
      return Error{ErrorCode::kBadArgument, Cat("an upscaler needs a whole factor: ", low.width, " x ", low.height,
                                                " cannot become ", high.width, " x ", high.height)};
    }
    return EnlargePicture(*upscaler, low, {.factor = factor});
  });
}

bool IsUpscaler(const fs::path& file) {
  const auto opened = TensorFile::Open(file);
  if (!opened.ok()) return false;
  const auto format = opened->metadata().find("format");
  return format != opened->metadata().end() && format->second == kUpscalerFormat;
}

// The cost by which networks choose among copies, unless a cost is given.
std::string CostText() { return Cat(" cost ", kMergeCost); }

Result<EvalMethod> Model(const fs::path& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string identity, Identity(file));
  const auto network = std::make_shared<std::optional<AnyNetwork>>();  // loaded with the first object
  return EvalMethod{
      file.stem().string(), Cat(identity, CostText()), [file, network](const MethodTask& task) -> Result<MethodViews> {
        if (!*network) {
          ANCHORSPLAT_ASSIGN_OR_RETURN(*network, LoadAnyNetwork(file));
        }
        const auto begin = Clock::now();
        GaussianCloud cloud;
        StepReport report;
        if (const auto* packed = std::get_if<PublishedNetwork>(&**network)) {
          ANCHORSPLAT_ASSIGN_OR_RETURN(PublishedResult result, EnhanceWithPublishedNetwork(task.object.low, *packed));
          cloud = std::move(result.cloud);
        } else {
          ANCHORSPLAT_ASSIGN_OR_RETURN(CameraPixelSizes sizes, TruePixelSizes(task.object));
          EnhanceInput input;
          input.cloud = task.object.low;
          input.pixel_sizes = std::move(sizes.sizes);
          input.filter_strength = DefaultStrength(task.object);
          ANCHORSPLAT_ASSIGN_OR_RETURN(cloud,
                                       EnhanceWithCompactNetwork(std::move(input), task.object.upscale(),
                                                                 std::get<CompactNetwork>(**network), {}, report));
        }
        const double seconds = SecondsSince(begin);
        MethodViews views = SplatViews(task.object, std::move(cloud));
        views.seconds = seconds;
        views.facts = std::move(report.facts);
        return views;
      }};
}

// Low-resolution cameras without held-out views.
CameraSet TrainingCameras(const BenchmarkObject& object) {
  if (!object.low_intrinsics.empty()) return object.low_cameras;  // captures have only training cameras here
  const auto label = [](const Camera& camera) { return fs::path(camera.name).filename(); };
  std::set<fs::path> held_out;
  for (const size_t view : object.held_out) held_out.insert(label(object.views[view]));
  CameraSet cameras = object.low_cameras;
  std::erase_if(cameras.cameras, [&](const Camera& camera) { return held_out.contains(label(camera)); });
  cameras.background = object.background;
  return cameras;
}

// A method of enhance/enhance.h with options.
struct NamedMethod {
  std::string word;  // as given by the user
  std::string name;
  bool by_default = false;  // chosen by the program, with `name` as the outcome
  bool auto_pixel_size =
      false;  // NAME-auto: it gets no cameras, p_LR is read off the splat, as for a user who has the splat alone
  EnhanceOptions options;  // with the list that the method belongs to, the quality, and what `word` sets
  std::string files;       // Identity of those that `word` names

  bool TakesPictures() const { return options.quality == "best" || name.ends_with("refine-images"); }

  // See EvalMethod; the refinement part is empty for other methods.
  std::string Settings() const {
    RefineOptions with_pictures = options.refine;
    if (TakesPictures()) with_pictures.images = "the object's";
    const bool refines = name.find("refine") != std::string::npos || name.ends_with("detail");
    std::string settings = by_default ? Cat(name, " ") : "";
    settings += refines ? Cat(ToJsonText(with_pictures), " revision ", kRefineRevision) : "";
    settings += Cat(files, " reading ", ReadingModel::ShippedIdentity(), " ");  // the reading may leave a splat alone
    // Refinement with pictures also starts from a network's result.
    if (name.starts_with("model") || name == "refine-images") settings += ShippedNetworkIdentity() + CostText();
    return settings;
  }
};

// Parses the f of a filter in `word`.
Result<double> ParseStrength(const std::string& word, std::string_view value) {
  double f = 0;
  const char* end = value.data() + value.size();
  const auto [stop, code] = std::from_chars(value.data(), end, f);
  if (code == std::errc() && stop == end && f >= 0 && f <= kMaxFilterStrength) return f;
  return Error{ErrorCode::kBadArgument,
               Cat("--methods ", Printable(word), ": f must be a number from 0 to ", kMaxFilterStrength)};
}

// The options that a word can set.
std::vector<MethodOption> KnownOptions() {
  std::vector<MethodOption> known = RefinementOptions();
  for (const auto& more : {NetworkOptions(), PublishedScriptOptions()}) {
    known.insert(known.end(), more.begin(), more.end());
  }
  std::erase_if(known, [](const MethodOption& option) {
    return option.name == "images" || option.name == "hold-out" || option.name == "downscale";
  });
  return known;
}

Status SetOptionOf(NamedMethod& method, const std::string& key, const std::string& value) {
  const auto bad = [&](const std::string& why) {
    return Error{ErrorCode::kBadArgument, Cat("--methods ", Printable(method.word), ": ", why)};
  };
  if (key == "images" || key == "hold-out" || key == "downscale") {
    return bad(key + " cannot be set, as the benchmark chooses the pictures, their size and the held-out views");
  }
  if (key == "f") {
    ANCHORSPLAT_ASSIGN_OR_RETURN(method.options.filter_strength, ParseStrength(method.word, value));
    method.options.given.emplace_back("filter-strength");
    return {};
  }
  const std::vector<MethodOption> known = KnownOptions();
  const Status set = SetOption(known, key, value, method.options);
  if (!set.ok()) return bad(set.error().message);
  SetBudget(method.options, method.options.max_gaussians);
  const auto option = std::ranges::find(known, method.options.given.back(), &MethodOption::name);
  if (std::holds_alternative<fs::path*>(option->value(method.options))) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string identity, Identity(value));
    method.files += Cat(" ", key, " ", identity);
  }
  return {};
}

// Rejects options without effect.
Status CheckGiven(const NamedMethod& method) {
  EnhanceOptions options = method.options;
  options.method = method.name;
  if (method.name.ends_with("refine-images")) options.refine.images = "the object's";
  if (!method.auto_pixel_size) options.cameras.emplace();
  return CheckOptions(options);
}

constexpr std::string_view kAuto = "-auto";

// Parses NAME or NAME-auto, optionally with @KEY=VALUE@KEY=VALUE…; unset if there is no such method.
Result<std::optional<NamedMethod>> ParseNamed(const std::string& word, const std::vector<EnhanceMethod>& methods) {
  NamedMethod method;
  method.options.methods = &methods;
  method.word = word;
  const size_t name_end = std::min(word.find('@'), word.size());
  method.name = word.substr(0, name_end);
  if (method.name.ends_with(kAuto)) {
    method.auto_pixel_size = true;
    method.name.resize(method.name.size() - kAuto.size());
  }
  // One name, or two joined by "+".
  const auto known = [&](const std::string& name) {
    return std::ranges::find(methods, name, &EnhanceMethod::name) != methods.end();
  };
  const size_t plus = method.name.find('+');
  if (!known(method.name.substr(0, plus)) || (plus != std::string::npos && !known(method.name.substr(plus + 1)))) {
    return std::optional<NamedMethod>();
  }
  if (method.auto_pixel_size && method.name.ends_with("refine-images")) {
    return Error{ErrorCode::kBadArgument,
                 Cat("--methods ", Printable(word),
                     ": -auto has no effect, as the cameras of the pictures give the pixel size")};
  }
  if (word.size() > name_end && method.name == "filter") {
    return Error{ErrorCode::kBadArgument,
                 Cat("--methods ", Printable(word), ": only networks, refine and refine-images have options")};
  }
  for (size_t at = name_end; at < word.size();) {
    const size_t end = std::min(word.find('@', at + 1), word.size());
    const std::string option = word.substr(at + 1, end - at - 1);
    const size_t equals = option.find('=');
    if (equals != std::string::npos) {
      ANCHORSPLAT_RETURN_IF_ERROR(SetOptionOf(method, option.substr(0, equals), option.substr(equals + 1)));
    }
    const std::vector<std::string>& given = method.options.given;
    if (equals == std::string::npos || std::ranges::count(given, given.back()) > 1) {
      return Error{ErrorCode::kBadArgument,
                   Cat("--methods ", Printable(word), ": options must be @KEY=VALUE, each once")};
    }
    at = end;
  }
  const Status valid = CheckGiven(method);
  if (!valid.ok()) {
    return Error{ErrorCode::kBadArgument, Cat("--methods ", Printable(word), ": ", valid.error().message)};
  }
  return std::optional<NamedMethod>(std::move(method));
}

// Processor seconds of all threads.
double ProcessorSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

bool ChosenByItself(const NamedMethod& method) {
  EnhanceOptions options;
  options.methods = method.options.methods;
  const auto plan = PlanEnhancement(options);
  return plan.ok() && plan->Name() == method.name;
}

EvalMethod Named(const NamedMethod& method) {
  return {method.word, method.Settings(), [method](const MethodTask& task) -> Result<MethodViews> {
            EnhanceOptions options = method.options;
            options.method = method.name;
            // Like a user with nothing but the splat: if the program would choose this method itself, it may also skip
            // it.
            if (method.by_default || (method.auto_pixel_size && ChosenByItself(method))) options.method = "auto";
            options.upscale = task.object.upscale();
            if (!method.auto_pixel_size) {
              options.cameras = TrainingCameras(task.object);
              options.train_width = WidestOf(options.cameras->cameras);  // known exactly
            }
            if (method.TakesPictures()) {
              options.refine.images = task.object.low_project;
              options.refine.hold_out = task.object.hold_out;
              options.refine.downscale = task.object.downscale;
            }
            options.camera_rule = task.object.camera_rule;
            options.seed = task.seed;
            const double begin = ProcessorSeconds();
            ANCHORSPLAT_ASSIGN_OR_RETURN(Enhanced enhanced, Enhance(task.object.low, options));
            MethodViews views = SplatViews(task.object, std::move(enhanced.cloud));
            views.seconds = enhanced.report.seconds;
            for (const StepReport& step : enhanced.report.steps) {
              // For "A+B", facts of B keep their names; those of A are prefixed.
              const bool last = &step == &enhanced.report.steps.back();
              for (const auto& [name, value] : step.facts) {
                views.facts.emplace_back(last ? name : Cat(step.method, "_", name), value);
              }
            }
            views.facts.emplace_back("processor_seconds", ProcessorSeconds() - begin);
            if (method.auto_pixel_size) {
              ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraPixelSizes truth, TruePixelSizes(task.object));
              views.facts.emplace_back("pixel_size_ratio",
                                       enhanced.report.pixel_size / static_cast<double>(truth.median));
            }
            return views;
          }};
}

// Parses the words for the program's default choice or a quality; unset for others.
Result<std::optional<NamedMethod>> ParseDefault(const std::string& word, const std::vector<EnhanceMethod>& methods) {
  if (word != "auto" && word != "fast" && word != "good" && word != "best") return std::optional<NamedMethod>();
  NamedMethod method;
  method.word = word;
  method.by_default = true;
  method.options.methods = &methods;
  if (word != "auto") method.options.quality = word;
  EnhanceOptions options = method.options;
  if (method.TakesPictures()) options.refine.images = "the object's";
  ANCHORSPLAT_ASSIGN_OR_RETURN(const MethodPlan plan, PlanEnhancement(options));
  method.name = plan.Name();
  return std::optional<NamedMethod>(std::move(method));
}

}  // namespace

MethodViews SplatViews(const BenchmarkObject& object, GaussianCloud cloud) {
  struct State {
    explicit State(GaussianCloud splat) : cloud(std::move(splat)), options(DisplayOptions(cloud)) {}
    GaussianCloud cloud;
    ConstantCloud still{cloud};
    Rasterizer rasterizer;
    RenderOptions options;
    bool warned = false;  // of an empty view; once is enough
  };
  const auto state = std::make_shared<State>(std::move(cloud));
  state->options.background = object.background;
  MethodViews views;
  views.gaussians = state->cloud.size();
  views.render = [&object, state](size_t view) -> Result<Image> {
    RenderOutput output;
    const Camera& camera = object.views[view];
    ANCHORSPLAT_RETURN_IF_ERROR(state->rasterizer.Render(state->still, camera, state->options, output));
    if (!state->warned) {
      const std::string warning =
          EmptyPictureReason(state->cloud, camera, state->options, state->rasterizer.statistics().visible);
      if (!warning.empty()) LogWarning(Cat(object.name, ": ", warning));
      state->warned = !warning.empty();
    }
    return std::move(output.color);
  };
  return views;
}

Result<EvalMethod> MakeEvalMethod(const std::string& word, const MethodOptions& options) {
  if (word == "raw") return Raw();
  if (word == "filter") return Filter(word, options.filter_strength);
  if (word == "filter-best") return FilterBest();
  if (word == "upsample") return Upsample();
  if (word == "bicubic") return Bicubic(options.fit_steps);
  const std::string at = "filter@";
  if (word.starts_with(at)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double f, ParseStrength(word, std::string_view(word).substr(at.size())));
    return Filter(word, f);
  }
  const std::vector<EnhanceMethod>& methods =
      options.enhance_methods == nullptr ? AllMethods() : *options.enhance_methods;
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::optional<NamedMethod> method, ParseDefault(word, methods));
  if (!method) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(method, ParseNamed(word, methods));
  }
  if (method) return Named(*method);
  const std::string extension = fs::path(word).extension().string();
  if (extension == ".safetensors" && IsUpscaler(word)) return Upscaled(word);
  if (extension == ".safetensors" || extension == ".pth" || extension == ".pt") return Model(word);
  return Error{ErrorCode::kBadArgument, Cat("--methods: '", Printable(word),
                                            "' is not raw, filter, filter@F, filter-auto, filter-best, upsample, "
                                            "bicubic, a network's file, auto, fast, good, best or "
                                            "a method of enhance, NAME or NAME-auto")};
}

}  // namespace anchorsplat
