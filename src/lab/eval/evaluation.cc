#include "eval/evaluation.h"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <new>
#include <set>
#include <span>
#include <utility>

#include "core/file_system.h"
#include "core/log.h"
#include "core/splat_comments.h"
#include "core/text.h"
#include "eval/object_state.h"
#include "fit/picture_cache.h"
#include "images/image_io.h"
#include "metrics/image_metrics.h"
#include "metrics/side_by_side.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr double kCrop = 0.125;  // side of the excerpt relative to the view's width

// Adds its lifetime to a sum.
class Timed {
 public:
  explicit Timed(double& sum) : sum_(sum) {}
  ~Timed() { sum_ += std::chrono::duration<double>(Clock::now() - begin_).count(); }
  Timed(const Timed&) = delete;
  Timed& operator=(const Timed&) = delete;

 private:
  double& sum_;
  Clock::time_point begin_ = Clock::now();
};

// Everything a result depends on. Covers the program's own computation by its version.
std::string Key(const BenchmarkObject& object, const EvalMethod& method, const std::vector<size_t>& views,
                const EvaluationOptions& options) {
  return Cat("anchorsplat ", ANCHORSPLAT_VERSION, "; ", ProtocolName(options.protocol), ", ", views.size(), " views; ",
             method.name, " ", method.settings, "; seed ", options.seed, "; lpips ",
             options.lpips == nullptr ? "none" : LpipsNetName(options.lpips->net()), "; ", ObjectState(object, views));
}

// The excerpt for the contact sheet: from the middle view, where the low-quality splat differs most.
struct Excerpt {
  size_t view = 0;
  ViewRegion region;
};

Result<Excerpt> ChooseExcerpt(const BenchmarkObject& object, std::span<const size_t> views, Protocol protocol) {
  Excerpt excerpt;
  excerpt.view = views[views.size() / 2];
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewPicture picture, object.Truth(excerpt.view));
  const Image& truth = picture.image;
  ANCHORSPLAT_ASSIGN_OR_RETURN(Image low, SplatViews(object, object.low).render(excerpt.view));
  TreatRender(protocol, low);
  FillIgnored(picture.ignored, truth, low);
  const int side = std::max(1, static_cast<int>(kCrop * std::min(truth.width, truth.height)));
  excerpt.region = MostDifferentRegion(low, truth, side, side);
  return excerpt;
}

// A method being measured on an object.
struct Pending {
  const EvalMethod* method = nullptr;
  std::string key;
  MethodViews views;
  MethodResult result;
  std::optional<std::string> failure;
};

// Measures one view for every pending method.
Status MeasureView(const BenchmarkObject& object, size_t view, const std::optional<Excerpt>& excerpt,
                   const fs::path& folder, const EvaluationOptions& options, std::vector<Pending>& pending,
                   EvaluationTimes& times) {
  const Result<ViewPicture> picture = [&] {
    const Timed timed(times.truth);
    return object.Truth(view);
  }();
  if (!picture.ok()) return picture.error();
  const Image& truth = picture->image;
  const bool shown = excerpt && excerpt->view == view;
  if (shown) {
    ANCHORSPLAT_RETURN_IF_ERROR(
        WritePng(folder / Cat(kTruthStem, ".png"), Crop(truth, excerpt->region.box()), {.overwrite = true}));
  }
  for (Pending& p : pending) {
    if (p.failure) continue;
    const auto measure = [&]() -> Status {
      double seconds = 0;
      Result<Image> image = [&] {
        const Timed timed(seconds);
        return p.views.render(view);
      }();
      if (!image.ok()) return image.error();
      times.render += seconds;
      p.result.render_seconds += seconds;
      ViewScore score{fs::path(object.views[view].name).filename().string(), 0, 0, std::nullopt};
      {
        const Timed timed(times.metrics);
        TreatRender(options.protocol, *image);
        FillIgnored(picture->ignored, truth, *image);
        ANCHORSPLAT_ASSIGN_OR_RETURN(const MaskedQuality quality, MeasureMasked(*image, truth, picture->ignored));
        score.psnr = quality.psnr;
        score.ssim = quality.ssim;
        if (quality.counted == 0) return {};  // fully masked
      }
      if (options.lpips != nullptr) {
        const Timed timed(times.lpips);
        ANCHORSPLAT_ASSIGN_OR_RETURN(score.lpips, options.lpips->Distance(*image, truth));
      }
      ++times.pictures;
      p.result.views.push_back(std::move(score));
      if (!shown) return {};
      return WritePng(folder / (FileStem(p.method->name) + ".png"), Crop(*image, excerpt->region.box()),
                      {.overwrite = true});
    };
    if (const Status status = measure(); !status.ok()) p.failure = status.error().message;
  }
  return {};
}

// Runs a method on the object, ready to be measured.
Pending Prepare(const EvalMethod& method, const MethodTask& task, std::string key) {
  Pending p;
  p.method = &method;
  p.key = std::move(key);
  auto prepared = method.prepare(task);
  if (!prepared.ok()) {
    p.failure = prepared.error().message;
    return p;
  }
  p.views = *std::move(prepared);
  p.result.object = task.object.name;
  p.result.method = method.name;
  p.result.seconds = p.views.seconds;
  p.result.gaussians = p.views.gaussians;
  p.result.facts = {p.views.facts.begin(), p.views.facts.end()};
  return p;
}

// Measures the prepared methods together, view by view, and stores their results. Errors concern the object.
Status MeasureAndKeep(const MethodTask& task, const std::string& place, const fs::path& folder,
                      const EvaluationOptions& options, std::vector<Pending> pending, std::vector<MethodResult>& done,
                      Evaluation& evaluation) {
  Status measured;
  if (std::any_of(pending.begin(), pending.end(), [](const Pending& p) { return !p.failure; })) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Excerpt excerpt, ChooseExcerpt(task.object, task.views, options.protocol));
    Progress progress(place, std::ssize(task.views));
    for (const size_t view : task.views) {
      measured = MeasureView(task.object, view, excerpt, folder, options, pending, evaluation.times);
      if (!measured.ok()) break;
      progress.Advance();
    }
  }
  // Keeps known results even if a view's truth turns out to be broken.
  for (Pending& p : pending) {
    if (!p.failure && measured.ok() && p.result.views.empty()) p.failure = "the masks hide every pixel of all views";
    if (p.failure) {
      evaluation.failures.push_back({task.object.name, p.method->name, *p.failure});
    } else if (measured.ok()) {
      ANCHORSPLAT_RETURN_IF_ERROR(WriteMethodResult(folder / (FileStem(p.method->name) + ".json"), p.key, p.result));
      done.push_back(std::move(p.result));
    }
  }
  return measured;
}

// Measures what is missing for one object. Errors concern the object.
Status EvaluateObject(const BenchmarkEntry& entry, const std::string& place, const std::vector<EvalMethod>& methods,
                      const fs::path& out, const EvaluationOptions& options, Evaluation& evaluation) {
  const fs::path folder = ObjectFolder(out, entry.name);
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      const BenchmarkObject object,
      entry.is_capture ? OpenCapturedObject(entry, *options.captures, folder / "fit") : OpenObject(entry));
  evaluation.credits.back() = CreditsOf(object.low.comments);
  const std::vector<size_t> views =
      SubsampleEvenly(options.protocol == Protocol::kUpstream ? UpstreamViews(object.views.size()) : object.held_out,
                      options.max_views);
  if (views.empty())
    return Error{ErrorCode::kBadFile, "no high-resolution view is held out: the fit was trained on all"};
  std::error_code code;
  fs::create_directories(folder, code);
  if (code) return Error{ErrorCode::kIo, Cat(folder.string(), ": ", code.message())};

  std::vector<MethodResult> done;
  std::vector<Pending> pending;
  Status measured;
  for (const EvalMethod& method : methods) {
    std::string key = Key(object, method, views, options);
    std::optional<MethodResult> known;
    const bool shown = Exists(folder / (FileStem(method.name) + ".png")) && Exists(folder / Cat(kTruthStem, ".png"));
    if (!options.again && shown) known = ReadMethodResult(folder / (FileStem(method.name) + ".json"), key);
    if (known) {
      ++evaluation.resumed;
      done.push_back(*std::move(known));
      continue;
    }
    const MethodTask task{object, views, options.protocol, folder / FileStem(method.name), options.seed};
    pending.push_back(Prepare(method, task, std::move(key)));
    if (!options.captures) continue;
    measured =
        MeasureAndKeep(task, Cat(place, ", ", method.name), folder, options, std::move(pending), done, evaluation);
    pending.clear();
    if (!measured.ok()) break;
  }
  if (measured.ok()) {
    const MethodTask task{object, views, options.protocol, {}, options.seed};
    measured = MeasureAndKeep(task, place, folder, options, std::move(pending), done, evaluation);
  }
  for (const EvalMethod& method : methods) {
    for (MethodResult& result : done) {
      if (result.method == method.name) evaluation.results.push_back(std::move(result));
    }
  }
  return measured;
}

Status CheckMethods(const std::vector<EvalMethod>& methods) {
  std::set<std::string> names = {kTruthStem};
  for (const EvalMethod& method : methods) {
    if (!names.insert(FileStem(method.name)).second) {
      return Error{ErrorCode::kBadArgument,
                   Cat("--methods: two methods would be called ", method.name, "; rename the file of one")};
    }
  }
  if (methods.empty()) return Error{ErrorCode::kBadArgument, "no methods to evaluate"};
  return {};
}

Result<std::vector<BenchmarkEntry>> ChooseKinds(std::vector<BenchmarkEntry> entries,
                                                const std::vector<std::string>& kinds) {
  if (kinds.empty()) return entries;
  std::set<std::string> known;
  for (const BenchmarkEntry& entry : entries) known.insert(entry.kind);
  for (const std::string& kind : kinds) {
    if (!kind.empty() && known.contains(kind)) continue;
    std::string list;
    for (const std::string& word : known) list += Cat(list.empty() || word.empty() ? "" : ", ", word);
    return Error{ErrorCode::kBadArgument, Cat("--kinds: no object is of kind '", Printable(kind), "'",
                                              list.empty() ? "" : "; known: ", Printable(list))};
  }
  std::erase_if(entries, [&](const BenchmarkEntry& entry) {
    return std::find(kinds.begin(), kinds.end(), entry.kind) == kinds.end();
  });
  return entries;
}

// `all`: the entries before selection by kind.
Result<std::vector<BenchmarkEntry>> ChooseObjects(std::vector<BenchmarkEntry> entries,
                                                  const std::vector<BenchmarkEntry>& all,
                                                  const EvaluationOptions& options) {
  const std::vector<std::string>& names = options.objects;
  if (names.empty()) return entries;
  std::vector<BenchmarkEntry> chosen;
  for (const BenchmarkEntry& entry : entries) {
    if (std::find(names.begin(), names.end(), entry.name) != names.end()) chosen.push_back(entry);
  }
  for (const std::string& name : names) {
    const auto is_it = [&](const BenchmarkEntry& e) { return e.name == name; };
    if (std::ranges::any_of(chosen, is_it)) continue;
    const auto left_out = std::ranges::find_if(all, is_it);
    return Error{
        ErrorCode::kBadArgument,
        left_out == all.end()
            ? Cat("--objects: there is no object '", Printable(name), "'",
                  options.split.empty() ? "" : Cat(" in the split ", Printable(options.split)))
            : Cat("--objects: '", Printable(name), "' is of ",
                  left_out->kind.empty() ? "an unknown kind" : Cat("the kind '", Printable(left_out->kind), "'"),
                  ", which --kinds excludes; pass only one of the two options, or add that kind")};
  }
  return chosen;
}

Result<std::vector<BenchmarkEntry>> ChooseEntries(const fs::path& benchmark, const EvaluationOptions& options) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<BenchmarkEntry> all,
                               options.captures ? ListCaptures(benchmark) : ListBenchmark(benchmark, options.split));
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<BenchmarkEntry> entries, ChooseKinds(all, options.kinds));
  return ChooseObjects(std::move(entries), all, options);
}

}  // namespace

const MethodResult* Evaluation::Find(const std::string& object, const std::string& method) const {
  for (const MethodResult& result : results) {
    if (result.object == object && result.method == method) return &result;
  }
  return nullptr;
}

fs::path ObjectFolder(const fs::path& out, const std::string& object) { return out / "objects" / object; }

std::string FileStem(const std::string& method) {
  std::string stem = method;
  for (char& c : stem) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' || c == '.' || c == '@';
    if (!plain) c = '_';
  }
  return stem;
}

Result<std::vector<std::string>> ObjectsToEvaluate(const fs::path& benchmark, const EvaluationOptions& options) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<BenchmarkEntry> entries, ChooseEntries(benchmark, options));
  std::vector<std::string> names;
  names.reserve(entries.size());
  for (const BenchmarkEntry& entry : entries) names.push_back(entry.name);
  return names;
}

Result<Evaluation> Evaluate(const fs::path& benchmark, const std::vector<EvalMethod>& methods, const fs::path& out,
                            const EvaluationOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckMethods(methods));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<BenchmarkEntry> entries, ChooseEntries(benchmark, options));
  std::error_code code;
  fs::create_directories(out / "objects", code);
  if (code) return Error{ErrorCode::kIo, Cat(out.string(), ": cannot create this folder: ", code.message())};

  Evaluation evaluation;
  evaluation.protocol = options.protocol;
  evaluation.max_views = options.max_views;
  if (options.lpips != nullptr) evaluation.lpips = options.lpips->net();
  for (const EvalMethod& method : methods) evaluation.methods.push_back(method.name);
  for (size_t i = 0; i < entries.size(); ++i) {
    evaluation.objects.push_back(entries[i].name);
    evaluation.kinds.push_back(entries[i].kind);
    evaluation.credits.emplace_back();
    const std::string place = Cat(entries[i].name, " (", i + 1, " of ", entries.size(), ")");
    const size_t before = evaluation.failures.size(), measured = evaluation.results.size();
    Status status;
    try {
      status = EvaluateObject(entries[i], place, methods, out, options, evaluation);
    } catch (const std::bad_alloc&) {
      status = Error{ErrorCode::kIo, "out of memory"};
    }
    if (!status.ok()) evaluation.failures.push_back({entries[i].name, "", status.error().message});
    for (size_t k = before; k < evaluation.failures.size(); ++k) {
      const EvaluationFailure& failure = evaluation.failures[k];
      LogError(Cat(failure.object, failure.method.empty() ? "" : ", ", failure.method, ": ", failure.message));
    }
    std::string scores;
    for (size_t k = measured; k < evaluation.results.size(); ++k) {
      scores += Cat(scores.empty() ? "" : ", ", evaluation.results[k].method, " ",
                    Fixed(evaluation.results[k].MeanPsnr(), 2));
    }
    if (!scores.empty()) LogInfo(Cat(place, ": ", scores, " dB"));
  }
  return evaluation;
}

}  // namespace anchorsplat
