#include "fit/training_views.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>
#include <utility>

#include "cameras/camera_axes.h"
#include "cameras/camera_io.h"
#include "cameras/photograph.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/text.h"
#include "formats/ply/ply_points.h"
#include "io/input_file.h"
#include "metrics/compare.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// Whether a folder is itself a project, rather than a folder of projects.
bool HasCameras(const fs::path& folder) {
  for (const char* name : {"transforms.json", "transforms_train.json", "cameras.json", "poses_bounds.npy"}) {
    if (Exists(folder / name)) return true;
  }
  return !FindColmapModels(folder).empty();
}

// The smallest project in folders named by a number; `folder` itself if there is none.
fs::path SmallestResolution(const fs::path& folder) {
  fs::path found = folder;
  int smallest = 0;
  std::error_code code;
  for (fs::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    const std::string name = it->path().filename().string();
    int resolution = 0;
    const auto [last, wrong] = std::from_chars(name.data(), name.data() + name.size(), resolution);
    if (wrong != std::errc() || last != name.data() + name.size() || resolution < 1) continue;
    if ((smallest > 0 && resolution >= smallest) || !HasCameras(it->path())) continue;
    smallest = resolution;
    found = it->path();
  }
  return found;
}

// The background stated beside a resolution's COLMAP folder, which cannot state it: chair/transforms_128.json for
// chair/128, as `views` and data sets write it.
Result<std::optional<std::array<float, 3>>> BackgroundBeside(const fs::path& resolution) {
  fs::path folder = resolution.lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();
  const fs::path file = folder.parent_path() / Cat("transforms_", folder.filename().string(), ".json");
  if (!Exists(file)) return std::optional<std::array<float, 3>>();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraSet set, ReadCameras(file));
  return set.background;
}

// The cameras of a file or folder that have pictures, by name. Appends the names of the others to `without`.
Result<std::vector<Camera>> WithPictures(CameraSet set, const fs::path& source, const fs::path& missing, int downscale,
                                         std::vector<std::string>& without) {
  std::vector<Camera> views;
  std::vector<std::string> left_out;
  for (Camera& camera : set.cameras) {
    if (!camera.image.empty()) {
      views.push_back(std::move(camera));
    } else {
      left_out.push_back(camera.name);
    }
  }
  const std::string looked = missing.empty() ? "" : Cat("; the first was expected at ", missing.string());
  if (views.empty()) {
    return Error{ErrorCode::kNotFound,
                 Cat(source.string(), ": none of the ", set.cameras.size(), " views has a picture", looked)};
  }
  if (!left_out.empty()) {
    LogWarning(Cat(source.string(), ": ", left_out.size(), " of ", set.cameras.size(),
                   " views have no picture and are skipped: ", FirstFew(left_out), looked));
  }
  without.insert(without.end(), left_out.begin(), left_out.end());
  std::stable_sort(views.begin(), views.end(), [](const Camera& a, const Camera& b) { return a.name < b.name; });
  for (Camera& view : views) ANCHORSPLAT_RETURN_IF_ERROR(MatchPhotograph(view, downscale));
  return views;
}

// Mentions other camera files: NeRF-synthetic's split into training and test views takes precedence.
void TellOfOtherCameras(const fs::path& folder, const fs::path& used) {
  std::string others;
  for (const char* name : {"transforms.json", "cameras.json"}) {
    if (Exists(folder / name)) others += Cat(others.empty() ? "" : ", ", (folder / name).string());
  }
  for (const FoundModel& model : FindColmapModels(folder)) {
    others += Cat(others.empty() ? "" : ", ", model.folder.string());
  }
  if (others.empty()) return;
  LogWarning(Cat("using ", used.string(), "; to use other cameras of this project, pass one of: ", others));
}

// The sparse model that ReadCameras uses for a project; empty if none.
fs::path ModelFolder(const fs::path& project) {
  if (!IsFolder(project)) return project.parent_path();
  const std::vector<FoundModel> models = FindColmapModels(project);
  return models.empty() ? fs::path() : models[0].folder;
}

// Transformation from a file's world to the cameras', and the origin.
struct PointFrame {
  std::optional<Similarity> moved;
  WorldOrigin origin;

  void Move(double* p) const {
    if (moved) std::ranges::copy(moved->Apply({p[0], p[1], p[2]}), p);
  }
};

// Reads a PLY of points; an empty path means none.
Status ReadPoints(const fs::path& path, const PointFrame& frame, InitialPoints& points) {
  if (path.empty()) return {};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const InputFile file, InputFile::Open(path));
  ANCHORSPLAT_ASSIGN_OR_RETURN(PlyPoints read, ReadPlyPoints(file));
  for (size_t i = 0; i + 2 < read.positions.size(); i += 3) frame.Move(read.positions.data() + i);
  points = PointsOf(read.positions, read.colors, frame.origin);
  return {};
}

// Reads the points of a sparse model: COLMAP's own files, else the PLY that 3DGS leaves beside them. There may be none.
Status ReadPointsOfModel(const fs::path& model, const PointFrame& frame, InitialPoints& points) {
  auto read = ReadColmapPoints(model);
  if (read.ok()) {
    for (ColmapPoint& point : *read) frame.Move(point.position.data());
    points = PointsOf(*read, frame.origin);
    return {};
  }
  if (read.error().code != ErrorCode::kNotFound) return read.error();
  const fs::path ply = model / "points3D.ply";
  return Exists(ply) ? ReadPoints(ply, frame, points) : Status();
}

// Makes views relative to the origin, and computes the scene scale.
void MoveToOrigin(const fs::path& source, const ProjectOptions& options, std::vector<Camera>& views,
                  TrainingViews& out) {
  out.origin = options.origin ? *options.origin : ChooseOrigin(views);
  if (!options.origin && !IsZero(out.origin)) {
    LogInfo(Cat(source.string(), ": coordinates exceed 32-bit floats; positions are stored relative to ",
                TextOf(out.origin)));
  }
  for (Camera& view : views) view = RelativeToOrigin(std::move(view), out.origin);
  out.scene_scale = SceneScale(views);
}

void HoldOut(int every, std::vector<Camera> views, TrainingViews& out) {
  for (size_t i = 0; i < views.size(); ++i) {
    const bool held_out = every > 0 && i % static_cast<size_t>(every) == 0;
    (held_out ? out.held_out : out.train).push_back(std::move(views[i]));
  }
}

}  // namespace

double SceneScale(const std::vector<Camera>& cameras) {
  std::array<double, 3> mean{};
  for (const Camera& camera : cameras) {
    const auto center = camera.Center();
    for (size_t k = 0; k < 3; ++k) mean[k] += center[k] / static_cast<double>(cameras.size());
  }
  double largest = 0;
  for (const Camera& camera : cameras) {
    const auto center = camera.Center();
    largest = std::max(largest, std::hypot(center[0] - mean[0], center[1] - mean[1], center[2] - mean[2]));
  }
  return largest > 0 ? 1.1 * largest : 1.0;
}

Result<TrainingViews> OpenProject(const fs::path& project, const ProjectOptions& options) {
  fs::path source = project;
  if (IsFolder(project) && !HasCameras(project)) source = SmallestResolution(project);

  TrainingViews out;
  fs::path missing;
  CameraSource kind = CameraSource::kUnknown;
  const fs::path train_file = source / "transforms_train.json", test_file = source / "transforms_test.json";
  if (Exists(train_file)) {
    TellOfOtherCameras(source, train_file);
    ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet set, ReadCameras(train_file, &missing));
    out.background = set.background;
    kind = set.source;
    const fs::path points = set.points;
    const std::optional<Similarity> moved = set.moved;
    ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<Camera> views, WithPictures(std::move(set), train_file, missing,
                                                                         options.downscale, out.without_picture));
    MoveToOrigin(train_file, options, views, out);
    if (Exists(test_file)) {
      out.train = std::move(views);
      ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet test, ReadCameras(test_file, &missing));
      ANCHORSPLAT_ASSIGN_OR_RETURN(
          out.held_out, WithPictures(std::move(test), test_file, missing, options.downscale, out.without_picture));
      for (Camera& view : out.held_out) view = RelativeToOrigin(std::move(view), out.origin);
    } else {
      HoldOut(options.hold_out, std::move(views), out);
    }
    ANCHORSPLAT_RETURN_IF_ERROR(ReadPoints(points, {moved, out.origin}, out.points));
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet set, ReadCameras(source, &missing));
    out.background = set.background;
    kind = set.source;
    const bool colmap = set.source == CameraSource::kColmap;
    if (colmap && !out.background) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(out.background, BackgroundBeside(source));
    }
    const fs::path points = set.points, model = colmap ? ModelFolder(source) : fs::path();
    const std::optional<Similarity> moved = set.moved;
    ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<Camera> views,
                                 WithPictures(std::move(set), source, missing, options.downscale, out.without_picture));
    MoveToOrigin(source, options, views, out);
    HoldOut(options.hold_out, std::move(views), out);
    const PointFrame frame{moved, out.origin};
    ANCHORSPLAT_RETURN_IF_ERROR(model.empty() ? ReadPoints(points, frame, out.points)
                                              : ReadPointsOfModel(model, frame, out.points));
  }
  CameraSet seen;
  seen.source = kind;
  seen.cameras = out.train;
  if (const std::string wrong = WrongAxes(seen, out.points.positions); !wrong.empty()) {
    LogWarning(Cat(source.string(), ": ", wrong));
  }
  if (out.train.empty()) {
    return Error{ErrorCode::kBadArgument,
                 Cat(source.string(), ": --hold-out ", options.hold_out, " leaves no view to train on")};
  }
  return out;
}

const char* NameOf(FitInit init, const TrainingViews& views) {
  if (init == FitInit::kAuto) init = views.points.size() > 0 ? FitInit::kPoints : FitInit::kView;
  return init == FitInit::kPoints ? "points" : init == FitInit::kView ? "view" : "random";
}

Result<InitialPoints> InitialPointsOf(FitInit init, const TrainingViews& views, std::optional<int64_t> count,
                                      uint64_t seed, double extent) {
  const bool has_points = views.points.size() > 0;
  if (init == FitInit::kPoints && !has_points) {
    return Error{ErrorCode::kBadArgument, "the project has no points to start from; use random ones"};
  }
  if (init == FitInit::kPoints || (init == FitInit::kAuto && has_points)) return SubsampleEvenly(views.points, count);
  const int64_t random = count.value_or(kRandomPoints);
  if (init == FitInit::kRandom) return RandomPoints(random, views.scene_scale, seed, extent);
  return RandomPointsInView(random, views.train, views.scene_scale, seed);
}

}  // namespace anchorsplat
