#include "dataset/picture_project.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <mutex>
#include <string>
#include <system_error>
#include <vector>

#include "cameras/camera_io.h"
#include "cameras/colmap_writer.h"
#include "cameras/photograph.h"
#include "core/parallel.h"
#include "core/run_context.h"
#include "core/text.h"
#include "fit/initial_points.h"
#include "fit/training_views.h"
#include "images/image_io.h"
#include "io/atomic_file.h"
#include "io/file_bytes.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// Overlap weights of source pixels with target pixel i when `from` pixels become `to`.
struct Cover {
  int first = 0;
  std::vector<float> weights;  // sum 1
};

std::vector<Cover> Covers(int from, int to) {
  std::vector<Cover> covers(static_cast<size_t>(to));
  for (int i = 0; i < to; ++i) {
    const double begin = static_cast<double>(i) * from / to, end = static_cast<double>(i + 1) * from / to;
    Cover& cover = covers[static_cast<size_t>(i)];
    cover.first = static_cast<int>(begin);
    for (int k = cover.first; k < from && k < end; ++k) {
      const double part = std::min<double>(end, k + 1) - std::max<double>(begin, k);
      cover.weights.push_back(static_cast<float>(part / (end - begin)));
    }
  }
  return covers;
}

// Averages one channel, weighted by `by` (same size; null: unweighted).
void AveragePlane(const Image& image, int channel, const float* by, const std::vector<Cover>& rows,
                  const std::vector<Cover>& columns, float* out) {
  const float* in = image.channel(channel);
  for (const Cover& row : rows) {
    for (const Cover& column : columns) {
      double sum = 0;
      for (size_t j = 0; j < row.weights.size(); ++j) {
        const int64_t at = (row.first + static_cast<int64_t>(j)) * image.width + column.first;
        for (size_t i = 0; i < column.weights.size(); ++i) {
          const int64_t k = at + static_cast<int64_t>(i);
          sum += static_cast<double>(row.weights[j] * column.weights[i] * in[k]) * (by == nullptr ? 1.0f : by[k]);
        }
      }
      *out++ = static_cast<float>(sum);
    }
  }
}

constexpr uint64_t kMaxPictureBytes = uint64_t{4} << 30;

Status MakeProjectFolder(const fs::path& folder) {
  std::error_code code;
  fs::create_directories(folder, code);
  if (code) return Error{ErrorCode::kIo, Cat(folder.string(), ": cannot create this folder: ", code.message())};
  return {};
}

bool SameIntrinsics(const Pinhole& a, const Pinhole& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx && a.cy == b.cy;
}

// Cameras of both resolutions, with names without folders and pictures as .png.
struct ProjectCameras {
  CameraSet low, high;
};

Result<ProjectCameras> MakeCameras(const fs::path& project, const std::vector<Camera>& views, int downscale) {
  const auto bad = [&](const std::string& sentence) {
    return Error{ErrorCode::kBadArgument, Cat(project.string(), ": ", sentence)};
  };
  const Pinhole& high = views[0].intrinsics;
  const Pinhole low = Scaled(high, 1.0 / downscale);
  if (low.width >= high.width || low.height >= high.height || high.width < downscale || high.height < downscale) {
    return bad(
        Cat("pictures of ", high.width, " x ", high.height, " pixels are too small to downscale by ", downscale));
  }
  ProjectCameras out;
  std::map<std::string, std::string> taken;
  for (const Camera& view : views) {
    if (!SameIntrinsics(view.intrinsics, high)) {
      return bad(Cat("views ", views[0].name, " and ", view.name,
                     " have different cameras; a data set has one for all views"));
    }
    Camera camera = view;
    camera.name = fs::path(view.name).filename().string();
    camera.image.clear();
    camera.photograph = {};
    if (const auto [other, fresh] = taken.emplace(camera.name, view.name); !fresh) {
      return bad(Cat("views ", other->second, " and ", view.name, " would both become ", camera.name));
    }
    out.high.cameras.push_back(camera);
    camera.intrinsics = low;
    out.low.cameras.push_back(std::move(camera));
  }
  return out;
}

Status WriteCameras(const fs::path& folder, const CameraSet& cameras, const WriteOptions& write) {
  const int size = cameras.cameras[0].intrinsics.width;
  const fs::path level = folder / std::to_string(size);
  ANCHORSPLAT_RETURN_IF_ERROR(MakeProjectFolder(level / "images"));
  ANCHORSPLAT_RETURN_IF_ERROR(WriteColmapCameras(level, cameras, ColmapForm::kText, write));
  CameraSet named = cameras;
  for (Camera& camera : named.cameras) camera.name = Cat(size, "/images/", camera.name);
  return WriteTransforms(folder / Cat("transforms_", size, ".json"), named, write);
}

// Writes both pictures of a view. A project's PNG that needs no undistortion is copied bit by bit.
Status WritePictures(const Camera& source, const fs::path& high, const fs::path& low, const Pinhole& low_camera,
                     const WriteOptions& write) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewPicture picture, ReadPhotograph(source));
  if (!picture.ignored.empty()) {
    return Error{ErrorCode::kBadArgument, Cat(source.image.string(),
                                              ": a mask or lens leaves pixels undefined, which a data set cannot "
                                              "store")};
  }
  const Image& image = picture.image;
  if (source.image.extension() == ".png" && source.photograph.lens.IsIdentity() && source.photograph.orientation == 1) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string bytes, ReadFileBytes(source.image, kMaxPictureBytes));
    ANCHORSPLAT_RETURN_IF_ERROR(WriteWholeFile(high, bytes, write.overwrite));
  } else {
    ANCHORSPLAT_RETURN_IF_ERROR(WritePng(high, image, write));
  }
  return WritePng(low, AreaAveraged(image, low_camera.width, low_camera.height), write);
}

Status WritePoints(const InitialPoints& points, const fs::path& folder, const WriteOptions& write) {
  std::vector<ColmapPoint> out(static_cast<size_t>(points.size()));
  for (size_t i = 0; i < out.size(); ++i) {
    for (size_t k = 0; k < 3; ++k) {
      out[i].position[k] = double{points.positions[3 * i + k]};
      out[i].color[k] = static_cast<uint8_t>(std::lround(255 * std::clamp(points.colors[3 * i + k], 0.0f, 1.0f)));
    }
  }
  return WriteColmapPoints(folder, out, ColmapForm::kBinary, write);
}

}  // namespace

Image AreaAveraged(const Image& image, int width, int height) {
  Image out(width, height, image.channels);
  const std::vector<Cover> columns = Covers(image.width, width), rows = Covers(image.height, height);
  if (image.channels != 4) {
    for (int c = 0; c < image.channels; ++c) AveragePlane(image, c, nullptr, rows, columns, out.channel(c));
    return out;
  }
  AveragePlane(image, 3, nullptr, rows, columns, out.channel(3));
  for (int c = 0; c < 3; ++c) {
    AveragePlane(image, c, image.channel(3), rows, columns, out.channel(c));
    for (int64_t i = 0; i < out.plane(); ++i) {
      out.channel(c)[i] = out.channel(3)[i] > 0 ? out.channel(c)[i] / out.channel(3)[i] : 0;
    }
  }
  return out;
}

Result<PictureProjectReport> WritePictureProject(const fs::path& project, const fs::path& folder,
                                                 const PictureProjectOptions& options) {
  const auto begin = Clock::now();
  const WriteOptions write{.overwrite = true};
  ANCHORSPLAT_ASSIGN_OR_RETURN(TrainingViews views, OpenProject(project, {.hold_out = 0}));
  ANCHORSPLAT_ASSIGN_OR_RETURN(ProjectCameras cameras, MakeCameras(project, views.train, options.downscale));
  PictureProjectReport report;
  report.background = views.background.value_or(options.background);
  cameras.low.background = cameras.high.background = report.background;
  const Pinhole low_camera = cameras.low.cameras[0].intrinsics;
  report.views = static_cast<int>(views.train.size());
  report.low_size = low_camera.width;
  report.high_size = views.train[0].intrinsics.width;
  const fs::path low = folder / std::to_string(report.low_size), high = folder / std::to_string(report.high_size);
  ANCHORSPLAT_RETURN_IF_ERROR(WriteCameras(folder, cameras.low, write));
  ANCHORSPLAT_RETURN_IF_ERROR(WriteCameras(folder, cameras.high, write));
  const fs::path sparse = low / "sparse" / "0";
  ANCHORSPLAT_RETURN_IF_ERROR(MakeProjectFolder(sparse));
  ANCHORSPLAT_RETURN_IF_ERROR(WriteColmapCameras(sparse, cameras.low, ColmapForm::kBinary, write));
  if (views.points.size() == 0) {
    views.points = RandomPointsInView(options.random_points, views.train, views.scene_scale, options.seed);
  }
  report.points = views.points.size();
  ANCHORSPLAT_RETURN_IF_ERROR(WritePoints(views.points, sparse, write));

  std::mutex mutex;
  Status failed;
  ParallelFor(0, report.views, 1, [&](int64_t i, int64_t) {
    {
      const std::lock_guard<std::mutex> lock(mutex);
      if (failed.ok() && StopRequested()) {
        failed = Error{ErrorCode::kInterrupted, Cat(folder.string(), ": stopped while making the views")};
      }
      if (!failed.ok()) return;
    }
    const std::string name = cameras.low.cameras[static_cast<size_t>(i)].name + ".png";
    const Status written = WritePictures(views.train[static_cast<size_t>(i)], high / "images" / name,
                                         low / "images" / name, low_camera, write);
    const std::lock_guard<std::mutex> lock(mutex);
    if (!written.ok() && failed.ok()) failed = written;
  });
  ANCHORSPLAT_RETURN_IF_ERROR(failed);
  report.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  return report;
}

}  // namespace anchorsplat
