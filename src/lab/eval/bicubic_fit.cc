#include "eval/bicubic_fit.h"

#include <filesystem>
#include <utility>

#include "cameras/photograph.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/text.h"
#include "dataset/kept_fit.h"
#include "fit/initial_cloud.h"
#include "fit/initial_points.h"
#include "fit/training_views.h"
#include "images/image_io.h"
#include "metrics/bicubic.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// Enlarges one training picture, unless an earlier attempt did.
Status Enlarge(const Camera& camera, const Pinhole& high, const std::array<float, 3>& background,
               const fs::path& file) {
  if (Exists(file)) return {};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewPicture picture, ReadPhotograph(camera));
  const Image& image = picture.image;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Image large,
                               EnlargeBicubic(CompositeOver(image, background), high.width, high.height));
  return WritePng(file, large);
}

}  // namespace

Result<BicubicFit> FitEnlargedPictures(const MethodTask& task, int64_t steps) {
  const BenchmarkObject& object = task.object;
  ANCHORSPLAT_ASSIGN_OR_RETURN(TrainingViews views, OpenProject(object.low_project, {.hold_out = object.hold_out,
                                                                                     .downscale = object.downscale}));
  FitOptions options = FitOptionsFor(steps);
  options.seed = task.seed;
  options.objective.render.background = object.background;

  const Pinhole high = object.views[0].intrinsics;
  const fs::path pictures = task.cache / "pictures";
  const std::string key = Cat(ToJsonText(options), " ", high.width, " x ", high.height, " ", views.train.size(),
                              " views of ", AbsolutePath(object.low_project).string());
  const auto start = [&]() -> Result<FitTask> {
    std::error_code code;
    fs::create_directories(pictures, code);
    if (code) return Error{ErrorCode::kIo, Cat(pictures.string(), ": cannot create this folder: ", code.message())};
    for (size_t i = 0; i < views.train.size(); ++i) {
      Camera& camera = views.train[i];
      // In captures every picture has its own camera.
      const Pinhole large =
          object.low_intrinsics.empty() ? high : Scaled(camera.intrinsics, static_cast<double>(object.downscale));
      const fs::path file = pictures / Cat(i, ".png");
      ANCHORSPLAT_RETURN_IF_ERROR(Enlarge(camera, large, object.background, file));
      camera.image = file;
      camera.photograph = {};
      camera.intrinsics = large;
    }
    views.held_out.clear();  // there are no enlarged pictures of these; the evaluation measures them
    const InitialPoints points = views.points.size() > 0
                                     ? std::move(views.points)
                                     : RandomPointsInView(kRandomPoints, views.train, views.scene_scale, task.seed);
    ANCHORSPLAT_ASSIGN_OR_RETURN(
        GaussianCloud initial,
        InitialCloud(points, views.scene_scale, {.sh_degree = options.objective.render.sh_degree, .seed = task.seed}));
    LogInfo(Cat(object.name, ": fitting ", WithThousands(steps), " steps at ", high.width, " x ", high.height));
    return FitTask{std::move(views), std::move(initial), options};
  };
  ANCHORSPLAT_ASSIGN_OR_RETURN(KeptFit fit, FitAndKeep(task.cache, key, start));
  std::error_code code;
  fs::remove_all(pictures, code);  // a hundred megabytes, no longer needed
  return BicubicFit{std::move(fit.cloud), fit.seconds, fit.train_psnr};
}

}  // namespace anchorsplat
