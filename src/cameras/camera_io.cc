#include "cameras/camera_io.h"

#include <algorithm>
#include <cctype>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include "cameras/colmap_model.h"
#include "cameras/inria_cameras.h"
#include "cameras/parse_cameras.h"
#include "cameras/poses_bounds.h"
#include "cameras/transforms_json.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/text.h"
#include "io/json_file.h"

namespace anchorsplat {

namespace {

// `complete`: CamerasFromTransforms'.
Result<CameraSet> CamerasFromJson(const JsonValue& root, const std::filesystem::path& folder, bool complete) {
  if (root.raw().is_array()) return CamerasFromInria(root, folder);
  if (root.raw().is_object()) return CamerasFromTransforms(root, folder, complete);
  return root.Complain("expected a transforms.json (an object with \"frames\") or a cameras.json (an array)");
}

Result<CameraSet> ReadCameraJson(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonFile file, JsonFile::Read(path));
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  return CamerasFromJson(file.root(), folder, path.filename() == "transforms.json");
}

// transforms*.json and cameras.json of a folder, sorted.
Result<std::vector<std::filesystem::path>> FindCameraJsons(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> found;
  std::error_code code;
  for (std::filesystem::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    const std::string name = it->path().filename().string();
    const bool transforms = name.starts_with("transforms") && name.ends_with(".json");
    if (transforms || name == "cameras.json") found.push_back(it->path());
  }
  if (code) return Error{ErrorCode::kIo, Cat(folder.string(), ": ", code.message())};
  std::sort(found.begin(), found.end());
  return found;
}

// Whether a model lies where COLMAP's and INRIA's projects have theirs.
bool IsPlainProject(const std::filesystem::path& project, const std::filesystem::path& model) {
  return model == project || model == project / "sparse" || model.parent_path() == project / "sparse";
}

// Models of one capture that COLMAP could not join have worlds of their own, and cannot be put together here either.
void TellOfOtherModels(const std::filesystem::path& project, std::span<const FoundModel> models) {
  if (models.size() < 2) return;
  const auto pictures = [](size_t count) { return Cat(count, count == 1 ? " picture" : " pictures"); };
  std::string others;
  for (const FoundModel& model : models.subspan(1)) {
    others += Cat(others.empty() ? "" : ", ", model.folder.string(), " (", pictures(model.pictures), ")");
  }
  const std::string text =
      Cat(project.string(), ": of ", models.size(), " COLMAP models ", models[0].folder.string(), " is used (",
          pictures(models[0].pictures), "); to use another, name its folder: ", others);
  if (models.back().pictures < models[0].pictures) {
    LogWarning(text);
  } else {
    LogInfo(text);
  }
}

Result<CameraSet> ReadCameraFolder(const std::filesystem::path& folder) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<std::filesystem::path> candidates, FindCameraJsons(folder));
  // Models that a program keeps beside its own file, as nerfstudio does in colmap, are not what it was meant to give.
  std::vector<FoundModel> models = FindColmapModels(folder);
  if (!candidates.empty() && !models.empty() && !IsPlainProject(folder, models[0].folder)) models.clear();
  if (!models.empty()) candidates.push_back(models[0].folder);
  // LLFF makes its file from a COLMAP model, which knows the lens and the points, too.
  if (candidates.empty() && Exists(folder / "poses_bounds.npy")) return ReadPosesBounds(folder / "poses_bounds.npy");
  if (candidates.empty()) {
    return Error{ErrorCode::kNotFound,
                 Cat(folder.string(),
                     ": no cameras here: expected transforms.json, cameras.json, poses_bounds.npy or a COLMAP model "
                     "(cameras and images as .bin or .txt, also in sparse/0 or sparse)")};
  }
  if (candidates.size() > 1) {
    std::string list;
    for (const auto& candidate : candidates) list += (list.empty() ? "" : ", ") + candidate.string();
    return Error{ErrorCode::kBadArgument, Cat(folder.string(), ": several sets of cameras, name one of them: ", list)};
  }
  if (!IsFolder(candidates[0])) return ReadCameraJson(candidates[0]);
  TellOfOtherModels(folder, models);
  return ReadColmapModel(candidates[0]);
}

// A folder of masks beside the pictures or among them, by any spelling; empty where there is none.
std::filesystem::path MasksBeside(const std::filesystem::path& picture) {
  for (const auto& folder : {picture.parent_path(), picture.parent_path().parent_path()}) {
    std::error_code code;
    for (std::filesystem::directory_iterator it(folder.empty() ? "." : folder, code), end; !code && it != end;
         it.increment(code)) {
      std::string name = it->path().filename().string();
      std::ranges::transform(name, name.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      if ((name == "masks" || name == "mask") && IsFolder(it->path())) return it->path();
    }
  }
  return {};
}

// Masks that were meant for these views and are not found are a mistake that nothing else tells.
void WarnOfMissingMasks(const CameraSet& set) {
  const Camera* bare = nullptr;
  size_t pictures = 0, masked = 0;
  for (const Camera& camera : set.cameras) {
    if (camera.image.empty()) continue;
    ++pictures;
    if (!camera.photograph.mask.empty()) {
      ++masked;
    } else if (bare == nullptr) {
      bare = &camera;
    }
  }
  if (bare == nullptr) return;
  const std::string expected = "expected masks/NAME.EXT.png or masks/NAME.png";
  if (masked > 0) {
    LogWarning(Cat(pictures - masked, " of ", pictures, " pictures have no mask, the first is ",
                   Printable(bare->image.string()), ": all of their pixels count (", expected, ")"));
  } else if (const std::filesystem::path folder = MasksBeside(bare->image); !folder.empty()) {
    LogWarning(Cat(folder.string(), ": none of the ", pictures, " pictures has its mask there; for ",
                   Printable(bare->image.filename().string()), " ", expected));
  }
}

// Readers leave the path at which they looked for a picture in vain; the first of these.
std::filesystem::path ForgetMissing(CameraSet& set) {
  std::filesystem::path first;
  for (Camera& camera : set.cameras) {
    if (camera.image.empty() || IsFile(camera.image)) continue;
    if (first.empty()) first = camera.image;
    camera.image.clear();
  }
  return first;
}

Result<CameraSet> ReadAnyCameras(const std::filesystem::path& path) {
  if (IsFolder(path)) return ReadCameraFolder(path);
  // Any file of a COLMAP model stands for the model.
  const std::string name = path.filename().string();
  const bool colmap = name == "cameras.bin" || name == "images.bin" || name == "cameras.txt" || name == "images.txt";
  if (colmap && Exists(path)) {
    const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
    if (IsColmapModel(folder)) return ReadColmapModel(folder);
    return Error{ErrorCode::kNotFound,
                 Cat(folder.string(), ": a COLMAP model needs both cameras and images, as .bin or .txt")};
  }
  return path.extension() == ".npy" ? ReadPosesBounds(path) : ReadCameraJson(path);
}

}  // namespace

Result<CameraSet> ParseCameras(const std::string& name, std::string_view bytes, const std::filesystem::path& folder) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonFile file, JsonFile::Parse(name, bytes));
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet set, CamerasFromJson(file.root(), folder, false));
  ForgetMissing(set);
  return set;
}

Result<CameraSet> ReadCameras(const std::filesystem::path& path, std::filesystem::path* missing) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet set, ReadAnyCameras(path));
  const std::filesystem::path first = ForgetMissing(set);
  if (missing != nullptr) *missing = first;
  WarnOfMissingMasks(set);
  return set;
}

}  // namespace anchorsplat
