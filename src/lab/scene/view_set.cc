#include "scene/view_set.h"

#include <cmath>
#include <mutex>
#include <string>
#include <system_error>
#include <vector>

#include "cameras/camera_io.h"
#include "cameras/colmap_writer.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/run_context.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "core/thread_clock.h"
#include "images/image_io.h"
#include "scene/surface_samples.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

Status MakeFolder(const fs::path& folder) {
  std::error_code code;
  fs::create_directories(folder, code);
  if (code) return Error{ErrorCode::kIo, Cat(folder.string(), ": cannot create this folder: ", code.message())};
  return {};
}

// Prefixes picture names.
CameraSet WithPrefix(CameraSet cameras, const std::string& prefix) {
  for (Camera& camera : cameras.cameras) camera.name = prefix + camera.name;
  return cameras;
}

Status WriteCameras(const fs::path& folder, const CameraSet& cameras, int size, const WriteOptions& write) {
  const fs::path level = folder / std::to_string(size);
  ANCHORSPLAT_RETURN_IF_ERROR(MakeFolder(level));
  ANCHORSPLAT_RETURN_IF_ERROR(WriteColmapCameras(level, cameras, ColmapForm::kText, write));
  return WriteTransforms(folder / Cat("transforms_", size, ".json"), WithPrefix(cameras, Cat(size, "/images/")), write);
}

Status WritePoints(const RayTracer& tracer, const fs::path& folder, const CameraSet& cameras,
                   const ViewSetOptions& options, const WriteOptions& write) {
  std::vector<ColmapPoint> points;
  for (const SurfaceSample& sample : SampleSurface(tracer, cameras, options.points, options.seed)) {
    ColmapPoint& point = points.emplace_back();
    for (size_t k = 0; k < 3; ++k) {
      point.position[k] = double{sample.position[k]};
      point.color[k] = static_cast<uint8_t>(std::lround(255 * sample.color[k]));
    }
  }
  return WriteColmapPoints(folder, points, ColmapForm::kBinary, write);
}

Status CheckSizes(const ViewSetOptions& options) {
  for (const int size : {options.low_size, options.high_size}) {
    if (size < 1 || size > 16384) {
      return Error{ErrorCode::kBadArgument, Cat("views must have 1 to 16384 pixels per side, not ", size)};
    }
  }
  if (options.low_size == options.high_size) {
    return Error{ErrorCode::kBadArgument, Cat("low and high views have the same size, ", options.low_size)};
  }
  if (options.points < 0 || options.points > 10'000'000) {
    return Error{ErrorCode::kBadArgument, Cat("surface samples must be 0 to 10,000,000, not ", options.points)};
  }
  return {};
}

}  // namespace

Result<ViewSetCameras> MakeViewSetCameras(const ViewSetOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckSizes(options));
  ViewSetCameras cameras;
  ANCHORSPLAT_ASSIGN_OR_RETURN(cameras.low, MakeRig(options.rig, options.low_size, options.low_size));
  ANCHORSPLAT_ASSIGN_OR_RETURN(cameras.high, MakeRig(options.rig, options.high_size, options.high_size));
  cameras.low.background = cameras.high.background = options.background;
  return cameras;
}

namespace {

Result<Image> RenderView(const RayTracer& tracer, const Camera& camera, const ViewSetOptions& options,
                         TraceCost* cost) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(Image image, tracer.Render(camera, options.trace, cost));
  return options.opaque ? CompositeOver(image, options.background) : image;
}

}  // namespace

Result<Image> RenderStoredView(const RayTracer& tracer, const Camera& camera, const ViewSetOptions& options,
                               TraceCost* cost) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(Image image, RenderView(tracer, camera, options, cost));
  for (float& x : image.pixels) x = std::floor(x * 255.0f + 0.5f) / 255.0f;  // as after writing and reading a PNG
  return image;
}

Result<ViewSetCost> WriteViewSet(const RayTracer& tracer, const fs::path& folder, const ViewSetOptions& options) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewSetCameras cameras, MakeViewSetCameras(options));
  return WriteViews(tracer, folder, cameras, options);
}

Result<ViewSetCost> WriteViews(const RayTracer& tracer, const fs::path& folder, const ViewSetCameras& cameras,
                               const ViewSetOptions& options, bool keep) {
  const Stopwatch watch;
  ANCHORSPLAT_RETURN_IF_ERROR(CheckSizes(options));
  if (cameras.low.cameras.empty() || cameras.low.cameras.size() != cameras.high.cameras.size()) {
    return Error{ErrorCode::kBadArgument, Cat("there are ", cameras.low.cameras.size(), " low and ",
                                              cameras.high.cameras.size(), " high views; expected the same number")};
  }
  const WriteOptions write{.overwrite = options.overwrite || keep};
  const fs::path low = folder / std::to_string(options.low_size), high = folder / std::to_string(options.high_size);
  const fs::path sparse = low / "sparse" / "0";
  ANCHORSPLAT_RETURN_IF_ERROR(MakeFolder(sparse));
  ANCHORSPLAT_RETURN_IF_ERROR(MakeFolder(low / "images"));
  if (options.store_high) ANCHORSPLAT_RETURN_IF_ERROR(MakeFolder(high / "images"));
  ANCHORSPLAT_RETURN_IF_ERROR(WriteCameras(folder, cameras.low, options.low_size, write));
  ANCHORSPLAT_RETURN_IF_ERROR(WriteCameras(folder, cameras.high, options.high_size, write));
  ANCHORSPLAT_RETURN_IF_ERROR(WriteColmapCameras(sparse, cameras.low, ColmapForm::kBinary, write));

  ViewSetCost cost;
  const Stopwatch points_watch;
  ANCHORSPLAT_RETURN_IF_ERROR(WritePoints(tracer, sparse, cameras.low, options, write));
  cost.point_seconds = points_watch.Total();

  // Views are rendered in parallel and independently, so each is the same whatever the threads.
  const int64_t views = std::ssize(cameras.low.cameras);
  const int64_t pictures = options.store_high ? 2 * views : views;
  Progress progress("views", pictures);
  std::mutex mutex;
  Status failed;
  ParallelFor(0, pictures, 1, [&](int64_t i, int64_t) {
    // Large views first, so that no thread is left with one at the end.
    const bool is_high = options.store_high && i < views;
    const Camera& camera = (is_high ? cameras.high : cameras.low).cameras[static_cast<size_t>(i % views)];
    {
      const std::lock_guard<std::mutex> lock(mutex);
      if (failed.ok() && StopRequested()) {
        failed = Error{ErrorCode::kInterrupted, Cat(folder.string(), ": stopped while making the views")};
      }
      if (!failed.ok()) return;
    }
    const fs::path file = (is_high ? high : low) / "images" / (camera.name + ".png");
    if (keep && IsFile(file)) {
      const std::lock_guard<std::mutex> lock(mutex);
      progress.Advance();
      return;
    }
    TraceCost mine;
    auto image = RenderView(tracer, camera, options, &mine);
    const double picture_begin = ThreadSeconds();
    const Status written = image.ok() ? WritePng(file, *image, write) : Status(image.error());
    const double picture_seconds = ThreadSeconds() - picture_begin;
    const std::lock_guard<std::mutex> lock(mutex);
    (is_high ? cost.high : cost.low) += mine;
    cost.picture_seconds += picture_seconds;
    if (!written.ok() && failed.ok()) failed = written;
    progress.Advance();
  });
  ANCHORSPLAT_RETURN_IF_ERROR(failed);
  cost.seconds = watch.Total();
  return cost;
}

}  // namespace anchorsplat
