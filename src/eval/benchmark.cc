#include "eval/benchmark.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "core/text.h"
#include "eval/protocol.h"
#include "formats/camera_checks.h"
#include "formats/camera_io.h"
#include "formats/cloud_io.h"
#include "formats/colmap_model.h"
#include "formats/image_io.h"
#include "formats/registry.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr const char* kLowTransforms = "transforms_lr.json";
constexpr const char* kHighTransforms = "transforms_hr.json";

Error NotFound(std::string sentence) { return Error{ErrorCode::kNotFound, std::move(sentence)}; }
Error Bad(std::string sentence) { return Error{ErrorCode::kBadFile, std::move(sentence)}; }

std::optional<int> WholeNumber(const std::string& text) {
  int value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size() || value < 1) return std::nullopt;
  return value;
}

bool IsFile(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

// What is in a folder, sorted by name; nothing when it is none.
std::vector<fs::path> Entries(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code code;
  for (fs::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    entries.push_back(it->path());
  }
  std::sort(entries.begin(), entries.end());
  return entries;
}

// The folders named by a resolution: smallest and largest.
std::optional<std::pair<fs::path, fs::path>> ResolutionFolders(const fs::path& folder) {
  std::map<int, fs::path> sizes;
  for (const fs::path& entry : Entries(folder)) {
    std::error_code ignored;
    const auto size = WholeNumber(entry.filename().string());
    if (size && fs::is_directory(entry, ignored)) sizes.emplace(*size, entry);
  }
  if (sizes.size() < 2) return std::nullopt;
  return std::pair(sizes.begin()->second, sizes.rbegin()->second);
}

bool LooksLikeObject(const fs::path& folder) {
  return IsFile(folder / kHighTransforms) || ResolutionFolders(folder).has_value();
}

// Upstream sorts the names of pictures, extension included.
void SortByName(std::vector<Camera>& cameras) {
  const auto key = [](const Camera& camera) { return camera.name + (camera.image.extension().string()); };
  std::stable_sort(cameras.begin(), cameras.end(), [&](const Camera& a, const Camera& b) { return key(a) < key(b); });
}

// The one splat among the files of a folder.
Result<fs::path> OnlySplat(const fs::path& folder) {
  std::vector<fs::path> found;
  for (const fs::path& entry : Entries(folder)) {
    const SplatFormat* format = FormatOfExtension(entry);
    if (format != nullptr && format->read != nullptr && IsFile(entry)) found.push_back(entry);
  }
  if (found.size() == 1) return found[0];
  const auto input = std::find_if(found.begin(), found.end(), [](const fs::path& p) { return p.stem() == "input"; });
  if (input != found.end()) return *input;
  return NotFound(
      Cat(folder.string(), found.empty() ? ": there is no splat" : ": there are several splats, none input.*"));
}

// The checkpoint of gsplat's trainer with the most steps.
Result<fs::path> LastCheckpoint(const fs::path& low) {
  const fs::path folder = low / "gaussian_splatting" / "ckpts";
  std::optional<fs::path> last;
  int most = -1;
  for (const fs::path& entry : Entries(folder)) {
    const std::string stem = entry.stem().string();  // ckpt_14999_rank0
    const std::string prefix = "ckpt_", suffix = "_rank0";
    if (entry.extension() != ".pt" || !stem.starts_with(prefix) || !stem.ends_with(suffix)) continue;
    if (stem.size() <= prefix.size() + suffix.size()) continue;
    const auto steps = WholeNumber(stem.substr(prefix.size(), stem.size() - prefix.size() - suffix.size()));
    if (steps && *steps > most) {
      most = *steps;
      last = entry;
    }
  }
  if (last) return *last;
  return NotFound(Cat(folder.string(), ": there is no ckpt_*_rank0.pt: the low-quality splat is missing"));
}

// Poses of the low views with the only intrinsics of the high ones, and the high pictures of the same names.
Status ReadPublishedLayout(const fs::path& low, const fs::path& high, BenchmarkObject& object) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(object.splat, LastCheckpoint(low));
  object.low_project = low;
  object.hold_out = kHeldOutEvery;
  const fs::path model = low / "sparse" / "0";
  ANCHORSPLAT_ASSIGN_OR_RETURN(object.low_cameras, ReadColmapModel(model));
  SortByName(object.low_cameras.cameras);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ColmapCameras intrinsics, ReadColmapCamerasText(high / "cameras.txt"));
  if (intrinsics.size() != 1) {
    return Bad(Cat((high / "cameras.txt").string(), ": ", intrinsics.size(), " cameras; the layout has exactly one"));
  }
  const std::vector<fs::path> folders = {high / "images"};
  for (const Camera& camera : object.low_cameras.cameras) {
    Camera view = camera;
    view.intrinsics = intrinsics.begin()->second;
    view.image = FindPicture(folders, camera.name);
    object.views.push_back(std::move(view));
  }
  object.held_out = HeldOutViews(object.views.size());
  return {};
}

// High views whose names are not among the low ones were not trained on.
Status ReadExampleLayout(const fs::path& folder, BenchmarkObject& object) {
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
  object.views = std::move(high.cameras);
  for (size_t i = 0; i < object.views.size(); ++i) {
    if (!trained.contains(label(object.views[i]))) object.held_out.push_back(i);
  }
  return {};
}

Status CheckObject(const fs::path& folder, const BenchmarkObject& object) {
  if (object.low_cameras.cameras.empty() || object.views.empty()) return Bad(Cat(folder.string(), ": no views"));
  for (const Camera& view : object.views) {
    if (view.image.empty())
      return NotFound(Cat(folder.string(), ": view ", view.name, " has no high-resolution picture"));
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

double BenchmarkObject::upscale() const {
  return static_cast<double>(views[0].intrinsics.width) / low_cameras.cameras[0].intrinsics.width;
}

Camera BenchmarkObject::LowCamera(size_t view) const {
  Camera camera = views[view];
  camera.intrinsics = low_cameras.cameras[0].intrinsics;
  return camera;
}

Result<Image> BenchmarkObject::Truth(size_t view) const {
  const Camera& camera = views[view];
  ANCHORSPLAT_ASSIGN_OR_RETURN(Image image, ReadImage(camera.image));
  if (image.width != camera.intrinsics.width || image.height != camera.intrinsics.height) {
    return Bad(Cat(camera.image.string(), ": ", image.width, " x ", image.height, " pixels, the camera has ",
                   camera.intrinsics.width, " x ", camera.intrinsics.height));
  }
  if (image.channels == 4) return CompositeOver(image, background);
  return image;
}

Result<std::vector<BenchmarkEntry>> ListBenchmark(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) return NotFound(Cat(folder.string(), ": no such folder"));
  std::vector<BenchmarkEntry> entries;
  for (const fs::path& entry : Entries(folder)) {
    if (fs::is_directory(entry, ignored) && LooksLikeObject(entry)) {
      entries.push_back({entry.filename().string(), entry});
    }
  }
  if (entries.empty() && LooksLikeObject(folder)) {
    const fs::path whole = fs::absolute(folder, ignored).lexically_normal();
    entries.push_back({(whole.has_filename() ? whole : whole.parent_path()).filename().string(), folder});
  }
  if (entries.empty()) {
    return NotFound(Cat(folder.string(), ": no objects in it: folders with 256/ and 1024/ (any two sizes), or with ",
                        kLowTransforms, " and ", kHighTransforms));
  }
  return entries;
}

Result<BenchmarkObject> OpenObject(const BenchmarkEntry& entry) {
  BenchmarkObject object;
  object.name = entry.name;
  if (const auto folders = ResolutionFolders(entry.folder)) {
    ANCHORSPLAT_RETURN_IF_ERROR(ReadPublishedLayout(folders->first, folders->second, object));
  } else {
    ANCHORSPLAT_RETURN_IF_ERROR(ReadExampleLayout(entry.folder, object));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckObject(entry.folder, object));
  ANCHORSPLAT_ASSIGN_OR_RETURN(object.low, ReadCloud(object.splat));
  return object;
}

}  // namespace anchorsplat
