#include "eval/benchmark.h"

#include <algorithm>
#include <memory>
#include <set>
#include <utility>

#include "cameras/camera_io.h"
#include "cameras/photograph.h"
#include "core/file_system.h"
#include "core/text.h"
#include "dataset/scene_reader.h"
#include "eval/protocol.h"
#include "formats/cloud_io.h"
#include "formats/registry.h"
#include "images/image_io.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr const char* kLowTransforms = "transforms_lr.json";
constexpr const char* kHighTransforms = "transforms_hr.json";

Error NotFound(std::string sentence) { return Error{ErrorCode::kNotFound, std::move(sentence)}; }
Error Bad(std::string sentence) { return Error{ErrorCode::kBadFile, std::move(sentence)}; }

// Contents of a folder, sorted by name; empty if it is none.
std::vector<fs::path> Entries(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code code;
  for (fs::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    entries.push_back(it->path());
  }
  std::sort(entries.begin(), entries.end());
  return entries;
}

// Sorts by picture name with extension, as data sets do.
void SortByName(std::vector<Camera>& cameras) {
  const auto key = [](const Camera& camera) { return camera.name + (camera.image.extension().string()); };
  std::stable_sort(cameras.begin(), cameras.end(), [&](const Camera& a, const Camera& b) { return key(a) < key(b); });
}

// The only splat among a folder's files.
Result<fs::path> OnlySplat(const fs::path& folder) {
  std::vector<fs::path> found;
  for (const fs::path& entry : Entries(folder)) {
    const SplatFormat* format = FormatOfExtension(entry);
    if (format != nullptr && format->read != nullptr && IsFile(entry)) found.push_back(entry);
  }
  if (found.size() == 1) return found[0];
  const auto input = std::find_if(found.begin(), found.end(), [](const fs::path& p) { return p.stem() == "input"; });
  if (input != found.end()) return *input;
  return NotFound(Cat(folder.string(), found.empty() ? ": contains no splat"
                                                     : ": contains several splats, none of them called input.*"));
}

Status ReadScene(const BenchmarkEntry& entry, BenchmarkObject& object) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(Scene opened, Scene::Open({entry.name, entry.folder}));
  const auto scene = std::make_shared<const Scene>(std::move(opened));
  ANCHORSPLAT_ASSIGN_OR_RETURN(object.splat, scene->LowSplatPath());
  object.low_cameras.cameras = scene->low_views();
  object.views = scene->high_views();
  object.held_out = scene->held_out();
  object.background = scene->background();
  object.low_project = scene->fitted_project();
  object.hold_out = scene->record() ? scene->record()->settings.hold_out : kHeldOutEvery;
  if (const fs::path mesh = entry.folder / kMeshName; IsFile(mesh)) object.mesh = mesh;
  object.picture = [scene](size_t view) -> Result<ViewPicture> {
    ANCHORSPLAT_ASSIGN_OR_RETURN(Image image, scene->HighPicture(view));
    return ViewPicture{std::move(image), {}};
  };
  return {};
}

// Reads an object in the examples' layout. High views whose names are not among the low ones are held out.
Status ReadExample(const fs::path& folder, BenchmarkObject& object) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(object.splat, OnlySplat(folder));
  object.low_project = folder / kLowTransforms;
  ANCHORSPLAT_ASSIGN_OR_RETURN(object.low_cameras, ReadCameras(folder / kLowTransforms));
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet high, ReadCameras(folder / kHighTransforms));
  SortByName(object.low_cameras.cameras);
  SortByName(high.cameras);
  object.background = high.background.value_or(object.background);
  const auto label = [](const Camera& camera) { return fs::path(camera.name).filename().string(); };
  std::set<std::string> trained;
  for (const Camera& camera : object.low_cameras.cameras) trained.insert(label(camera));
  for (size_t i = 0; i < high.cameras.size(); ++i) {
    const Camera& camera = high.cameras[i];
    if (camera.image.empty()) {
      return NotFound(Cat((folder / kHighTransforms).string(), ": view ", camera.name, " has no picture"));
    }
    if (!trained.contains(label(camera))) object.held_out.push_back(i);
  }
  object.views = std::move(high.cameras);
  object.picture = [views = object.views](size_t view) { return ReadPhotograph(views.at(view)); };
  return {};
}

Status CheckObject(const fs::path& folder, const BenchmarkObject& object) {
  if (object.low_cameras.cameras.empty() || object.views.empty()) return Bad(Cat(folder.string(), ": no views"));
  for (const Camera& view : object.views) {
    const Pinhole &a = view.intrinsics, &b = object.views[0].intrinsics;
    if (a.width != b.width || a.height != b.height) {
      return Bad(Cat(folder.string(), ": the high-resolution views are of different sizes"));
    }
  }
  if (!(object.upscale() >= 1)) {
    return Bad(Cat(folder.string(), ": the high-resolution views are smaller than the low-resolution ones"));
  }
  return {};
}

}  // namespace

bool HasExampleLayout(const fs::path& folder) { return IsFile(folder / kHighTransforms); }

double BenchmarkObject::upscale() const {
  return static_cast<double>(views[0].intrinsics.width) / LowCamera(0).intrinsics.width;
}

Camera BenchmarkObject::LowCamera(size_t view) const {
  Camera camera = views[view];
  camera.intrinsics = low_intrinsics.empty() ? low_cameras.cameras[0].intrinsics : low_intrinsics[view];
  return camera;
}

Result<ViewPicture> BenchmarkObject::Truth(size_t view) const {
  const Camera& camera = views[view];
  ANCHORSPLAT_ASSIGN_OR_RETURN(ViewPicture truth, picture(view));
  Image& image = truth.image;
  if (image.width != camera.intrinsics.width || image.height != camera.intrinsics.height) {
    return Bad(Cat(camera.image.string(), ": ", image.width, " x ", image.height, " pixels, the camera has ",
                   camera.intrinsics.width, " x ", camera.intrinsics.height));
  }
  if (image.channels == 4) image = CompositeOver(image, background);
  return truth;
}

Result<std::vector<BenchmarkEntry>> ListBenchmark(const fs::path& folder, const std::string& split) {
  std::vector<BenchmarkEntry> entries;
  auto scenes = ListScenes(folder, {.split = split});
  if (scenes.ok()) {
    for (SceneEntry& scene : *scenes) {
      entries.push_back({std::move(scene.name), std::move(scene.folder), std::move(scene.kind)});
    }
  } else if (scenes.error().code != ErrorCode::kNotFound || !split.empty()) {
    return scenes.error();
  }
  if (split.empty()) {
    for (const fs::path& entry : Entries(folder)) {
      const bool known = std::any_of(entries.begin(), entries.end(), [&](const auto& e) { return e.folder == entry; });
      if (HasExampleLayout(entry) && !known) entries.push_back({entry.filename().string(), entry});
    }
  }
  if (entries.empty() && HasExampleLayout(folder)) {
    std::error_code ignored;
    entries.push_back({fs::weakly_canonical(folder, ignored).filename().string(), folder});
  }
  if (entries.empty()) {
    return Error{scenes.error().code, Cat(scenes.error().message, ", and no folders with ", kHighTransforms)};
  }
  std::sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return entries;
}

Result<BenchmarkObject> OpenObject(const BenchmarkEntry& entry) {
  BenchmarkObject object;
  object.name = entry.name;
  ANCHORSPLAT_RETURN_IF_ERROR(HasExampleLayout(entry.folder) ? ReadExample(entry.folder, object)
                                                             : ReadScene(entry, object));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckObject(entry.folder, object));
  ANCHORSPLAT_ASSIGN_OR_RETURN(object.low, ReadCloud(object.splat));
  return object;
}

}  // namespace anchorsplat
