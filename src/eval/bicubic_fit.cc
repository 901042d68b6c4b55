#include "eval/bicubic_fit.h"

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "cameras/photograph.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "fit/fit.h"
#include "fit/initial_cloud.h"
#include "fit/initial_points.h"
#include "fit/training_views.h"
#include "formats/cloud_io.h"
#include "images/image_io.h"
#include "io/atomic_file.h"
#include "io/input_record.h"
#include "io/json_file.h"
#include "metrics/bicubic.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr int64_t kCheckpointEvery = 500;  // steps: about half a minute at 1024²

// Of one training picture; nothing to do when an earlier attempt wrote it.
Status Enlarge(const Camera& camera, const Pinhole& high, const std::array<float, 3>& background,
               const fs::path& file) {
  if (Exists(file)) return {};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewPicture picture, ReadPhotograph(camera));
  const Image& image = picture.image;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Image large,
                               EnlargeBicubic(CompositeOver(image, background), high.width, high.height));
  return WritePng(file, large);
}

// What was made, or is being made, in a cache folder, and for how long.
struct Progressed {
  std::string key;
  double seconds = 0;
  double train_psnr = 0;
  bool done = false;
};

std::optional<Progressed> ReadProgress(const fs::path& path) {
  RecordOwnFile(path);
  const auto file = JsonFile::Read(path);
  if (!file.ok()) return std::nullopt;
  const nlohmann::json& json = file->root().raw();
  try {
    return Progressed{json.at("key"), json.at("seconds"), json.at("train_psnr"), json.at("done")};
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;  // not ours, or damaged: begin anew
  }
}

Status WriteProgress(const fs::path& path, const Progressed& progress) {
  const nlohmann::json json = {{"key", progress.key},
                               {"seconds", progress.seconds},
                               {"train_psnr", progress.train_psnr},
                               {"done", progress.done}};
  return WriteWholeFile(path, json.dump(1) + "\n", true);
}

}  // namespace

Result<BicubicFit> FitEnlargedPictures(const MethodTask& task, int64_t steps) {
  const Stopwatch watch;
  const BenchmarkObject& object = task.object;
  ANCHORSPLAT_ASSIGN_OR_RETURN(TrainingViews views, OpenProject(object.low_project, {.hold_out = object.hold_out}));
  FitOptions options = FitOptionsFor(steps);
  options.seed = task.seed;
  options.objective.render.background = object.background;

  const Pinhole high = object.views[0].intrinsics;
  const fs::path splat = task.cache / "splat.ply", checkpoint = task.cache / "fit.checkpoint";
  const fs::path pictures = task.cache / "pictures", note = task.cache / "fit.json";
  std::error_code code;
  const std::string key = Cat(ToJsonText(options), " ", high.width, " x ", high.height, " ", views.train.size(),
                              " views of ", fs::absolute(object.low_project, code).lexically_normal().string());
  Progressed progress{key, 0, 0, false};
  if (const auto earlier = ReadProgress(note); earlier && earlier->key == key) {
    progress = *earlier;
    if (progress.done) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud cloud, ReadCloud(splat));
      return BicubicFit{std::move(cloud), progress.seconds, progress.train_psnr};
    }
  } else {
    fs::remove_all(task.cache, code);
  }
  fs::create_directories(pictures, code);
  if (code) return Error{ErrorCode::kIo, Cat(pictures.string(), ": cannot make this folder: ", code.message())};
  ANCHORSPLAT_RETURN_IF_ERROR(WriteProgress(note, progress));

  for (size_t i = 0; i < views.train.size(); ++i) {
    Camera& camera = views.train[i];
    const fs::path file = pictures / Cat(i, ".png");
    ANCHORSPLAT_RETURN_IF_ERROR(Enlarge(camera, high, object.background, file));
    camera.image = file;
    camera.photograph = {};
    camera.intrinsics = high;
  }
  views.held_out.clear();  // they have no enlarged pictures; the evaluation measures
  const InitialPoints points = views.points.size() > 0
                                   ? std::move(views.points)
                                   : RandomPointsInView(kRandomPoints, views.train, views.scene_scale, task.seed);
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      GaussianCloud initial,
      InitialCloud(points, views.scene_scale, {.sh_degree = options.objective.render.sh_degree, .seed = task.seed}));
  FitControl control;
  control.checkpoint = checkpoint;
  control.checkpoint_every = kCheckpointEvery;
  control.resume = true;
  control.anew_if_unfit = true;  // it is of another version then
  control.deliver = [&](const Fitted& fitted) { return WriteCloud(splat, fitted.cloud, {.overwrite = true}); };
  // Time is noted with every checkpoint, so that a fit in several attempts still says what it took.
  const double before = progress.seconds;
  Status noted;
  control.observe = [&](const Fitter& fitter) {
    if (fitter.step() % kCheckpointEvery != 0) return;
    progress.seconds = before + watch.Total();
    noted = WriteProgress(note, progress);
  };
  LogInfo(Cat(object.name, ": fitting ", WithThousands(steps), " steps at ", high.width, " x ", high.height));
  ANCHORSPLAT_ASSIGN_OR_RETURN(Fitted fitted, Fit(views, std::move(initial), options, control));
  if (!noted.ok()) return noted.error();
  progress = {key, before + watch.Total(), fitted.report.train.psnr, true};
  ANCHORSPLAT_RETURN_IF_ERROR(WriteProgress(note, progress));
  fs::remove_all(pictures, code);  // a hundred megabytes that nobody needs again
  return BicubicFit{std::move(fitted.cloud), progress.seconds, progress.train_psnr};
}

}  // namespace anchorsplat
