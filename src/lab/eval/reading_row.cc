#include "eval/reading_row.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "cameras/photograph.h"
#include "core/region.h"
#include "core/rotation.h"
#include "core/statistics.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "enhance/enhance.h"
#include "enhance/filter.h"
#include "enhance/pixel_size.h"
#include "eval/benchmark.h"
#include "eval/json_lines.h"
#include "eval/protocol.h"
#include "fit/picture_cache.h"
#include "fit/training_views.h"
#include "formats/cloud_io.h"
#include "io/file_version.h"
#include "metrics/image_metrics.h"
#include "model/model_method.h"
#include "reading/features.h"
#include "reading/places.h"
#include "reading/reading_model.h"
#include "reading/visible_gaussians.h"
#include "render/constant_cloud.h"
#include "render/rasterizer.h"
#include "render/shown_range.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr size_t kMostOfName = 200;      // bytes; file systems allow 255
constexpr double kRotationError = 5e-5;  // per matrix element

bool IsRotation(const std::array<double, 9>& r) {
  const std::array<double, 4> q = QuaternionFromRotation(r);
  const std::array<double, 9> nearest = RotationFromQuaternion(q[0], q[1], q[2], q[3]);
  return std::ranges::equal(r, nearest, [](double a, double b) { return std::abs(a - b) < kRotationError; });
}

// Size and modification time; empty for a missing file.
std::string StateOfFile(const fs::path& path) {
  const std::optional<FileVersion> version = VersionOf(path);
  return version ? Cat(" ", version->size, " ", version->changed_s, " ", version->changed_ns) : "";
}

// Number of files in a folder tree, total size and latest modification time.
std::string StateOfFolder(const fs::path& folder) {
  int64_t files = 0;
  uint64_t bytes = 0;
  std::pair<int64_t, int64_t> last;
  std::error_code code;
  for (fs::recursive_directory_iterator it(folder, fs::directory_options::follow_directory_symlink, code), end;
       !code && it != end; it.increment(code)) {
    const std::optional<FileVersion> version = VersionOf(it->path());
    if (!version) continue;
    ++files;
    bytes += version->size;
    last = std::max(last, {version->changed_s, version->changed_ns});
  }
  return Cat(" ", files, " files ", bytes, " ", last.first, " ", last.second);
}

constexpr uint64_t kMostPlacesOfRow = 1000;
constexpr double kOnePixel = 2;  // ratio up to which the pixels of a splat count as equal

double QuantileOf(Buffer<float> values, double q) { return double{Quantile(values, q)}; }

// Rounds dB and logarithms to sufficient precision. JSON writes non-finite values as null.
double Rounded(double value) { return std::round(value * 1e4) / 1e4; }

}  // namespace

Result<ReadingTask> ReadingTaskFrom(const nlohmann::json& json) {
  ReadingTask task;
  const auto bad = [](std::string_view what) { return Error{ErrorCode::kBadFile, std::string(what)}; };
  if (!json.is_object()) return bad("not a JSON object");
  task.words = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  try {
    for (const auto& [name, value] : json.items()) {
      const auto label = std::ranges::find(kReadingLabels, name);
      if (label != kReadingLabels.end()) {
        task.labels[static_cast<size_t>(label - kReadingLabels.begin())] = value.get<std::string>();
      } else if (name == "id") {
        task.id = value.get<std::string>();
      } else if (name == "downscale") {
        if (!value.is_number_integer()) return bad("downscale must be a whole number");
        task.downscale = value.get<int>();
        if (task.downscale < 1 || task.downscale > kMaxDownscale) {
          return bad(Cat("downscale must be 1 to ", kMaxDownscale));
        }
      } else if (name == "measure") {
        task.measure = value.get<bool>();
      } else if (name == "places") {
        if (!value.is_number_unsigned() || value.get<uint64_t>() > kMostPlacesOfRow) {
          return bad(Cat("places must be a whole number from 0 to ", kMostPlacesOfRow));
        }
        task.places = value.get<int>();
      } else if (name == "others") {
        if (value.size() != 2 || !value.at("from").is_number_integer())
          return bad("others must have a whole number \"from\" and a number \"pixel\"");
        task.others_from = value.at("from").get<int64_t>();
        task.others_pixel = value.at("pixel").get<double>();
        if (task.others_from < 1 || !(task.others_pixel > 0)) return bad("others: from and pixel must be positive");
      } else if (name == "keep") {
        const auto corners = value.get<std::vector<double>>();
        task.keep = RegionOf(corners);
        if (!task.keep) return bad("keep" + std::string(kNoRegion));
      } else if (name == "moved") {
        if (value.size() != 3 || value.at("rotation").size() != 9 || value.at("translation").size() != 3) {
          return bad("moved must have a scale, a rotation of nine numbers and a translation of three");
        }
        task.moved.scale = value.at("scale").get<double>();
        task.moved.rotation = value.at("rotation").get<std::array<double, 9>>();
        task.moved.translation = value.at("translation").get<std::array<double, 3>>();
        if (!(task.moved.scale > 0)) return bad("moved: the scale must be positive");
        if (!IsRotation(task.moved.rotation)) return bad("moved: not a rotation");
      } else {
        fs::path* const path = name == "splat"     ? &task.splat
                               : name == "object"  ? &task.object
                               : name == "context" ? &task.context
                               : name == "model"   ? &task.model
                                                   : nullptr;
        if (path == nullptr) return bad(Cat("unknown property ", Printable(name)));
        *path = value.get<std::string>();
      }
    }
  } catch (const nlohmann::json::exception&) {
    return bad("a property is missing or has a value of another type");
  }
  if (task.id.empty() || task.splat.empty()) return bad("id or splat is missing");
  const bool is_about_gains = task.keep || !task.context.empty() || task.others_from > 0 || !task.model.empty();
  if (task.object.empty() && (is_about_gains || task.places > 0)) {
    return bad("keep, context, others, model and places need an object");
  }
  if (!task.measure && !task.model.empty()) return bad("model needs measure, which is false");
  if (task.id.size() > kMostOfName || task.id.front() == '.' || task.id.find('/') != std::string::npos ||
      Printable(task.id, kMostOfName) != task.id) {
    return bad(Cat(Printable(task.id), ": an id must be a file name of at most ", kMostOfName, " bytes"));
  }
  return task;
}

Result<std::vector<ReadingTask>> ReadReadingTasks(const fs::path& path) {
  std::vector<ReadingTask> tasks;
  std::set<std::string> ids;
  ANCHORSPLAT_RETURN_IF_ERROR(ForEachJsonLine(path, [&](const nlohmann::json& json, int64_t) -> std::string {
    Result<ReadingTask> task = ReadingTaskFrom(json);
    if (!task.ok()) return task.error().message;
    if (!ids.insert(task->id).second) return Cat(task->id, " is listed twice");
    tasks.push_back(*std::move(task));
    return "";
  }));
  return tasks;
}

// An object with its held-out views and pictures.
struct ReadingRows::Object {
  fs::path folder;
  int downscale = 1;
  double upscale = 4;
  std::array<float, 3> background{};
  CameraSet low;  // of the fitted pictures
  struct View {
    Camera camera;
    Image truth;
    Buffer<uint8_t> ignored;
  };
  std::vector<View> views;
};

ReadingRows::ReadingRows(int views) : views_(views) {}
ReadingRows::~ReadingRows() = default;

std::string ReadingRows::StateOf(const ReadingTask& task) const {
  std::string state = Cat(views_, " views ", task.words);
  for (const fs::path& path : {task.splat, task.context, task.model}) state += StateOfFile(path);
  return task.object.empty() ? state : state + StateOfFolder(task.object);
}

Result<const ReadingRows::Object*> ReadingRows::Open(const ReadingTask& task) {
  if (object_ && object_->folder == task.object && object_->downscale == task.downscale &&
      (!task.measure || !object_->views.empty())) {
    return object_.get();
  }
  auto object = std::make_unique<Object>();
  object->folder = task.object;
  object->downscale = task.downscale;
  const auto most = static_cast<size_t>(views_);
  if (task.downscale > 1) {
    const ProjectOptions low = {.hold_out = kHeldOutEvery, .downscale = task.downscale, .origin = WorldOrigin{}};
    ProjectOptions high = low;
    high.downscale = 1;
    ANCHORSPLAT_ASSIGN_OR_RETURN(const TrainingViews fitted, OpenProject(task.object, low));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const TrainingViews whole, OpenProject(task.object, high));
    std::vector<size_t> all(whole.held_out.size());
    for (size_t i = 0; i < all.size(); ++i) all[i] = i;
    object->upscale = task.downscale;
    object->low.cameras = fitted.train;
    object->background = whole.background.value_or(object->background);
    PictureCache pictures(whole.held_out, object->background);
    for (const size_t i : task.measure ? SubsampleEvenly(all, most) : std::vector<size_t>()) {
      Object::View& view = object->views.emplace_back();
      view.camera = whole.held_out[i];
      ANCHORSPLAT_RETURN_IF_ERROR(pictures.Load(static_cast<int64_t>(i), view.truth, view.ignored));
    }
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const BenchmarkObject opened,
                                 OpenObject({task.object.filename().string(), task.object}));
    object->upscale = opened.upscale();
    object->low = opened.low_cameras;
    object->background = opened.background;
    for (const size_t i : task.measure ? SubsampleEvenly(opened.held_out, most) : std::vector<size_t>()) {
      Object::View& view = object->views.emplace_back();
      view.camera = opened.views[i];
      ANCHORSPLAT_ASSIGN_OR_RETURN(ViewPicture truth, opened.Truth(i));
      view.truth = std::move(truth.image);
      view.ignored = std::move(truth.ignored);
    }
  }
  if (task.measure && object->views.empty())
    return Error{ErrorCode::kBadArgument, Cat(task.object.string(), ": no view is held out")};
  object_ = std::move(object);
  return object_.get();
}

namespace {

// Measures treatments of a splat.
struct Measuring {
  std::vector<Camera> cameras;  // in the splat's world
  std::vector<const Image*> truths;
  std::vector<const Buffer<uint8_t>*> ignored;
  std::array<float, 3> background{};
  GaussianCloud context;
  std::optional<Region> keep;  // relative to the cloud's origin
  Rasterizer rasterizer;

  // Mean PSNR over the views, dB.
  Result<double> Measure(GaussianCloud cloud) {
    if (keep) {
      std::vector<int64_t> rows;
      for (int64_t i = 0; i < cloud.size(); ++i) {
        if (keep->Contains(cloud.means.data() + 3 * i)) rows.push_back(i);
      }
      if (rows.empty()) return Error{ErrorCode::kBadFile, "no Gaussian lies in the region to keep"};
      ANCHORSPLAT_ASSIGN_OR_RETURN(cloud, Subset(cloud, rows));
    }
    if (!context.empty()) ANCHORSPLAT_RETURN_IF_ERROR(Append(cloud, context));
    RenderOptions options = DisplayOptions(cloud);
    options.background = background;
    double sum = 0;
    ConstantCloud still(cloud);
    const auto add = [&](size_t v, RenderOutput& output) -> Status {
      Clamp01(output.color);
      FillIgnored(*ignored[v], *truths[v], output.color);
      ANCHORSPLAT_ASSIGN_OR_RETURN(const double psnr, Psnr(output.color, *truths[v]));
      sum += psnr;
      return {};
    };
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.RenderEach(still, cameras, options, add));
    return sum / static_cast<double>(cameras.size());
  }
};

const EnhanceMethod* FindMethod(std::string_view name) {
  const auto found = std::ranges::find(AllMethods(), name, &EnhanceMethod::name);
  return found == AllMethods().end() ? nullptr : &*found;
}

// Result of a single-step method for the splat at these pixel sizes and in this mode.
Result<GaussianCloud> Treat(const EnhanceMethod& method, const GaussianCloud& cloud, const Buffer<float>& pixels,
                            double multiple, const EnhanceOptions& options) {
  EnhanceInput input;
  input.cloud = cloud;
  input.pixel_sizes = pixels;
  for (float& size : input.pixel_sizes) size *= static_cast<float>(multiple);
  input.pixel_size = QuantileOf(input.pixel_sizes, 0.5);
  input.filter_strength = DefaultFilterStrength(options.upscale, cloud.render_mode);
  StepReport report;
  return method.run(std::move(input), options, report);
}

// Modes in which a splat may be treated: its tag's, or either without a tag.
std::vector<RenderMode> ModesOf(const GaussianCloud& cloud) {
  if (cloud.render_mode) return {*cloud.render_mode};
  return {RenderMode::kClassic, RenderMode::kAntialiased};
}

CameraSet Moved(CameraSet set, const Similarity& move, const WorldOrigin& origin) {
  for (Camera& camera : set.cameras) {
    camera.world_to_camera = RelativeToOrigin(Moved(camera.world_to_camera, move), origin);
  }
  return set;
}

Result<Buffer<float>> TruePixels(const GaussianCloud& cloud, const CameraSet& low) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraPixelSizes sizes, PixelSizesFromCameras(cloud, low));
  return std::move(sizes.sizes);
}

Result<GaussianCloud> FilteredContext(const ReadingTask& task, const CameraSet& low, double upscale,
                                      std::optional<RenderMode> mode) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud context, ReadCloud(task.context));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Buffer<float> pixels, TruePixels(context, low));
  const auto grown =
      ApplyFilter(context, pixels, {.upscale = upscale, .strength = DefaultFilterStrength(upscale, mode)});
  if (!grown.ok()) return grown.error();
  return context;
}

}  // namespace

namespace {

nlohmann::json RoundedAll(const std::vector<double>& values) {
  nlohmann::json out = nlohmann::json::array();
  for (const double value : values) out.push_back(Rounded(value));
  return out;
}

// Features and true pixel sizes of `count` places of the splat.
Result<nlohmann::json> PlacesOf(const GaussianCloud& cloud, const Buffer<float>& pixels, int count) {
  const SplatPlaces places(cloud);
  const int64_t all = places.count(), wanted = std::min<int64_t>(count, all);
  nlohmann::json out = nlohmann::json::array();
  for (int64_t k = 0; k < wanted; ++k) {
    const std::vector<int64_t>& rows = places.rows((2 * k + 1) * all / (2 * wanted));
    Buffer<float> own;
    for (const int64_t i : rows) own.push_back(pixels[static_cast<size_t>(i)]);
    const auto features = FeaturesOfPlace(cloud, rows);
    if (!features.ok()) continue;
    out.push_back({{"unit", features->unit},
                   {"pixel", QuantileOf(std::move(own), 0.5)},
                   {"features", RoundedAll(features->values)}});
  }
  return out;
}

// The program's own decision with this reading model, in the format of `bench reading --decisions`.
Status AddDecision(const fs::path& path, const GaussianCloud& cloud, double raw, EnhanceOptions options,
                   Measuring& measuring, nlohmann::json& row) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorFile file, TensorFile::Open(path));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ReadingModel model, ReadingModel::Load(file));
  options.methods = &AllMethods();
  options.reading_model = &model;
  ANCHORSPLAT_ASSIGN_OR_RETURN(Enhanced enhanced, Enhance(cloud, options));
  const EnhanceReport& report = enhanced.report;
  const bool changed = report.filter_strength > 0;
  row["method"] = !changed ? "none" : report.method == "filter" ? "filter" : "network";
  if (report.reading) {
    row["low"] = report.reading->low, row["high"] = report.reading->high;
    row["made"] = NameOf(report.reading->likeliest());
  }
  if (changed) row["pixel"] = report.pixel_size;
  if (enhanced.cloud.render_mode) row["mode"] = NameOf(*enhanced.cloud.render_mode);
  row["gain"] = 0;
  if (!changed) return {};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const double psnr, measuring.Measure(std::move(enhanced.cloud)));
  row["gain"] = Rounded(psnr - raw);
  return {};
}

}  // namespace

Result<nlohmann::json> ReadingRows::Make(const ReadingTask& task) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud cloud, ReadCloud(task.splat));
  const Object* object = nullptr;
  if (!task.object.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(object, Open(task));
  }
  nlohmann::json row = {
      {"id", task.id}, {"state", StateOf(task)}, {"gaussians", cloud.size()}, {"pixel", nullptr}, {"tag", nullptr}};
  for (size_t k = 0; k < kReadingLabels.size(); ++k) row[kReadingLabels[k]] = task.labels[k];
  if (cloud.render_mode) row["tag"] = NameOf(*cloud.render_mode);

  const Stopwatch reading;
  const VisibleGaussians shown = FindVisibleGaussians(cloud);
  const auto features = FeaturesOf(cloud, shown);
  row["seconds_reading"] = Rounded(reading.Total());
  if (features.ok()) {
    row["unit"] = features->unit;
    row["features"] = RoundedAll(features->values);
  } else {
    row["why_no_features"] = features.error().message;
  }

  EnhanceOptions options;
  if (object == nullptr) return row;
  options.upscale = object->upscale;
  Measuring measuring;
  if (task.keep) measuring.keep = RelativeToOrigin(*task.keep, cloud.origin);
  measuring.background = object->background;
  const CameraSet low = Moved(object->low, task.moved, cloud.origin);
  CameraSet held_out;
  for (const Object::View& view : object->views) {
    held_out.cameras.push_back(view.camera);
    measuring.truths.push_back(&view.truth);
    measuring.ignored.push_back(&view.ignored);
  }
  measuring.cameras = Moved(std::move(held_out), task.moved, cloud.origin).cameras;
  if (!task.context.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(measuring.context, FilteredContext(task, low, object->upscale, cloud.render_mode));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(Buffer<float> pixels, TruePixels(cloud, low));
  if (task.others_from > 0) {
    if (task.others_from >= cloud.size()) {
      return Error{ErrorCode::kBadFile, Cat("others start beyond the last of ", cloud.size(), " Gaussians")};
    }
    std::fill(pixels.begin() + task.others_from, pixels.end(), static_cast<float>(task.others_pixel));
  }
  row["upscale"] = object->upscale;
  // Only of visible Gaussians near the centre: a distant sky has other pixels than the subject.
  Buffer<float> seen;
  for (const int64_t i : shown.rows) seen.push_back(pixels[static_cast<size_t>(i)]);
  if (seen.empty()) seen = pixels;
  // If something out of view was added to a splat, the finest pixels are the subject's.
  const double finest = QuantileOf(seen, 0.1), coarsest = QuantileOf(seen, 0.9);
  const bool differ = coarsest > kOnePixel * finest, is_whole = !task.keep && task.others_from == 0;
  const double pixel = differ && !is_whole ? finest : QuantileOf(seen, 0.5);
  row["pixel"] = pixel;
  row["pixel_10"] = finest;
  row["pixel_90"] = coarsest;
  if (task.places > 0) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(row["places"], PlacesOf(cloud, pixels, task.places));
  }
  if (!task.measure) return row;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const double raw, measuring.Measure(cloud));
  row["raw"] = Rounded(raw);
  if (!task.model.empty()) {
    ANCHORSPLAT_RETURN_IF_ERROR(AddDecision(task.model, cloud, raw, options, measuring, row));
    return row;
  }
  for (const RenderMode mode : ModesOf(cloud)) {
    GaussianCloud as = cloud;
    as.render_mode = mode;
    for (const auto& [word, name] : {std::pair("filter", "filter"), std::pair("network", "model")}) {
      const EnhanceMethod* const method = FindMethod(name);
      if (method == nullptr) continue;
      nlohmann::json& gains = row["gains"][NameOf(mode)][word] = nlohmann::json::array();
      for (const double multiple : kGainMultiples) {
        ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud treated, Treat(*method, as, pixels, multiple, options));
        ANCHORSPLAT_ASSIGN_OR_RETURN(const double psnr, measuring.Measure(std::move(treated)));
        gains.push_back(Rounded(psnr - raw));
      }
    }
  }
  return row;
}

}  // namespace anchorsplat
