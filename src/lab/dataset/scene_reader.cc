#include "dataset/scene_reader.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <system_error>

#include "cameras/camera_checks.h"
#include "cameras/camera_io.h"
#include "cameras/colmap_model.h"
#include "cameras/photograph.h"
#include "core/file_system.h"
#include "core/text.h"
#include "dataset/dataset_split.h"
#include "dataset/object_builder.h"
#include "dataset/picture_defects.h"
#include "formats/cloud_io.h"
#include "images/image_io.h"
#include "scene/mesh_file.h"
#include "scene/view_set.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr size_t kHoldOut = 8;  // gsplat's default, if no record says otherwise

std::optional<int64_t> WholeNumber(std::string_view text) {
  int64_t value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size() || value < 0) return std::nullopt;
  return value;
}

std::vector<fs::path> Entries(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code code;
  for (fs::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    entries.push_back(it->path());
  }
  std::sort(entries.begin(), entries.end());
  return entries;
}

// Folders of the lowest and the highest resolution.
std::optional<std::pair<fs::path, fs::path>> Resolutions(const fs::path& folder) {
  std::map<int64_t, fs::path> found;
  for (const fs::path& entry : Entries(folder)) {
    const auto size = WholeNumber(entry.filename().string());
    if (size && *size > 0 && IsFolder(entry)) found.emplace(*size, entry);
  }
  if (found.size() < 2) return std::nullopt;
  return std::pair(found.begin()->second, found.rbegin()->second);
}

// ckpt_14999_rank0.pt → 14999
std::optional<int64_t> StepOf(const fs::path& checkpoint) {
  std::string_view rest;
  const std::string name = checkpoint.filename().string();
  rest = name;
  if (!rest.starts_with("ckpt_") || !rest.ends_with("_rank0.pt")) return std::nullopt;
  rest.remove_prefix(5);
  rest.remove_suffix(9);
  return WholeNumber(rest);
}

Error NotFound(std::string sentence) { return Error{ErrorCode::kNotFound, std::move(sentence)}; }

// Whether the object's splat has an unusual render mode or informative comments, which checkpoints cannot store.
bool SaysMoreThanACheckpoint(const ObjectSettings& s) {
  return s.mode != RenderMode::kClassic || s.mip_filter || s.pixel_area || s.after == "enhanced";
}

Result<Image> ReadView(const Camera& camera) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(ViewPicture picture, ReadPhotograph(camera));
  Image& image = picture.image;
  if (image.width != camera.intrinsics.width || image.height != camera.intrinsics.height) {
    return Error{ErrorCode::kBadFile,
                 Cat(camera.image.string(), ": has ", image.width, " x ", image.height, " pixels, its camera ",
                     camera.intrinsics.width, " x ", camera.intrinsics.height)};
  }
  return std::move(image);
}

}  // namespace

Result<std::vector<SceneEntry>> ListScenes(const fs::path& dataset, const SceneListOptions& options) {
  if (!IsFolder(dataset)) return NotFound(Cat(dataset.string(), ": no such folder"));
  std::vector<SceneEntry> scenes;
  if (IsFile(dataset / kManifestName)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Manifest manifest, ReadManifest(dataset));
    for (const auto& [name, record] : manifest) {
      if (!record.rejected || options.rejected) scenes.push_back({name, dataset / name, record.recipe});
    }
  } else if (Resolutions(dataset)) {
    scenes.push_back({RealPath(dataset).filename().string(), dataset});
  } else {
    for (const fs::path& entry : Entries(dataset)) {
      if (IsFolder(entry) && Resolutions(entry)) scenes.push_back({entry.filename().string(), entry});
    }
  }
  if (!options.split.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Splits splits, ReadSplits(dataset));
    std::erase_if(scenes, [&](const SceneEntry& scene) {
      const auto split = splits.find(scene.name);
      return split == splits.end() || split->second != options.split;
    });
  }
  if (scenes.empty()) {
    return NotFound(Cat(dataset.string(), ": no objects",
                        options.split.empty()
                            ? " (folders with two folders named after a resolution, such as 256 and 1024)"
                            : Cat(" in split ", options.split)));
  }
  return scenes;
}

Result<Scene> Scene::Open(const SceneEntry& entry) {
  Scene scene;
  scene.name_ = entry.name;
  scene.folder_ = entry.folder;
  const auto resolutions = Resolutions(entry.folder);
  if (!resolutions) {
    return NotFound(Cat(entry.folder.string(), ": needs two folders named after a resolution, such as 256 and 1024"));
  }
  const auto& [low, high] = *resolutions;
  scene.low_folder_ = low;
  if (IsFile(entry.folder / kRecordName)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonFile json, JsonFile::Read(entry.folder / kRecordName));
    ANCHORSPLAT_ASSIGN_OR_RETURN(scene.record_, ObjectRecordFrom(json.root()));
    scene.background_ = scene.record_->background;
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet cameras, ReadCameras(low / "sparse" / "0"));
  const auto by_name = [](const Camera& a, const Camera& b) {
    return a.name + a.image.extension().string() < b.name + b.image.extension().string();
  };
  std::stable_sort(cameras.cameras.begin(), cameras.cameras.end(), by_name);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ColmapCameras intrinsics, ReadColmapCamerasText(high / "cameras.txt"));
  if (intrinsics.size() != 1) {
    return Error{ErrorCode::kBadFile,
                 Cat((high / "cameras.txt").string(), ": ", intrinsics.size(), " cameras; expected exactly one")};
  }
  const std::vector<fs::path> pictures = {high / "images"};
  for (const Camera& camera : cameras.cameras) {
    Camera view = camera;
    view.intrinsics = intrinsics.begin()->second.undistorted;
    view.photograph = intrinsics.begin()->second.photograph;
    view.image = FindPicture(pictures, camera.name);
    scene.high_views_.push_back(std::move(view));
  }
  if (entry.high_size > 0) ANCHORSPLAT_RETURN_IF_ERROR(scene.ResizeHighViews(entry.high_size));
  scene.low_views_ = std::move(cameras.cameras);
  const size_t every = scene.record_ ? static_cast<size_t>(scene.record_->settings.hold_out) : kHoldOut;
  for (size_t i = 0; every > 0 && i < scene.low_views_.size(); i += every) scene.held_out_.push_back(i);
  return scene;
}

Status Scene::ResizeHighViews(int size) {
  const bool stored = std::ranges::any_of(high_views_, [](const Camera& view) { return !view.image.empty(); });
  if (!record_ || stored || !IsFile(folder_ / kMeshName)) {
    return Error{ErrorCode::kBadArgument,
                 Cat(folder_.string(), ": has no views of another size, because its pictures are ",
                     "stored, not rendered on demand (dataset build --hr on-demand)")};
  }
  for (Camera& view : high_views_) {
    view.intrinsics = Scaled(view.intrinsics, static_cast<double>(size) / view.intrinsics.width);
  }
  record_->settings.views.high_size = size;
  return {};
}

fs::path Scene::fitted_project() const {
  const fs::path captured = folder_ / kCapturedName;
  return record_ && record_->settings.defects.Any() && IsFolder(captured) ? captured : low_folder_;
}

Result<fs::path> Scene::LowSplatPath() const {
  if (record_ && SaysMoreThanACheckpoint(record_->settings) && IsFile(folder_ / kSplatName)) {
    return folder_ / kSplatName;
  }
  const fs::path folder = low_folder_ / "gaussian_splatting" / "ckpts";
  fs::path last;
  int64_t most = -1;
  for (const fs::path& entry : Entries(folder)) {
    const auto step = StepOf(entry);
    if (!step || *step <= most) continue;
    most = *step;
    last = entry;
  }
  if (most < 0) return NotFound(Cat(folder.string(), ": the low-quality splat (ckpt_*_rank0.pt) is missing"));
  return last;
}

Result<GaussianCloud> Scene::LowSplat() const {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const fs::path path, LowSplatPath());
  return ReadCloud(path);
}

Result<Image> Scene::LowPicture(size_t view) const {
  const Camera& camera = low_views_.at(view);
  if (camera.image.empty())
    return NotFound(Cat((low_folder_ / "images").string(), ": picture ", camera.name, " is missing"));
  return ReadView(camera);
}

Result<Image> Scene::HighPicture(size_t view) const {
  if (!high_views_.at(view).image.empty()) return ReadView(high_views_[view]);
  return Rendered(view);
}

Result<Image> Scene::Rendered(size_t view) const {
  const fs::path path = folder_ / kMeshName;
  if (!record_ || !IsFile(path)) {
    return NotFound(Cat(folder_.string(), ": neither the high-resolution picture ", high_views_[view].name, " nor ",
                        kMeshName, " to render it from"));
  }
  {
    const std::lock_guard<std::mutex> lock(renderer_->mutex);
    if (!renderer_->tracer) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(Mesh mesh, ReadMeshFile(path));
      ANCHORSPLAT_ASSIGN_OR_RETURN(renderer_->tracer, RayTracer::Create(std::move(mesh)));
    }
  }
  // Uses the rig's camera: the file's went through a quaternion, which costs the last bits.
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewSetCameras cameras, MakeViewSetCameras(record_->settings.views));
  for (const Camera& camera : cameras.high.cameras) {
    if (camera.name == high_views_[view].name) {
      return RenderStoredView(*renderer_->tracer, camera, record_->settings.views);
    }
  }
  return NotFound(Cat(folder_.string(), ": its record has no view ", high_views_[view].name));
}

}  // namespace anchorsplat
