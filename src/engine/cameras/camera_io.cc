#include "cameras/camera_io.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include "cameras/bundler_cameras.h"
#include "cameras/colmap_model.h"
#include "cameras/foreign_cameras.h"
#include "cameras/inria_cameras.h"
#include "cameras/metashape_cameras.h"
#include "cameras/nerfstudio_frame.h"
#include "cameras/opensfm_cameras.h"
#include "cameras/parse_cameras.h"
#include "cameras/picture_search.h"
#include "cameras/poses_bounds.h"
#include "cameras/transforms_json.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/text.h"
#include "io/file_bytes.h"
#include "io/json_file.h"

namespace anchorsplat {

namespace {

constexpr uint64_t kMostCameraBytes = uint64_t{256} << 20;
constexpr size_t kHeadBytes = 4096;

std::string NotOfNerfstudio(const std::filesystem::path& frame) {
  return Cat(frame.string(),
             " applies only to a transforms.json or a COLMAP model; pass the cameras that nerfstudio trained on, or "
             "move that file away");
}

// `complete`: see CamerasFromTransforms. `frame`: a dataparser_transforms.json to apply; empty: cameras stay in the
// world of their file.
Result<CameraSet> CamerasFromJson(const JsonValue& root, const std::filesystem::path& folder, bool complete,
                                  const std::filesystem::path& frame) {
  if (const std::string foreign = ForeignJson(root); !foreign.empty()) return root.Complain(foreign);
  CameraSet set;
  Similarity applied;
  if (IsOpenSfm(root)) {
    if (!frame.empty()) return root.Complain(NotOfNerfstudio(frame));
    return CamerasFromOpenSfm(root, folder);
  }
  if (root.raw().is_array()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(set, CamerasFromInria(root, folder));
  } else if (root.raw().is_object()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(set, CamerasFromTransforms(root, folder, complete));
    if (!frame.empty()) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(applied, AppliedByNerfstudio(root, folder));
    }
  } else {
    return root.Complain("expected a transforms.json (an object with \"frames\") or a cameras.json (an array)");
  }
  if (!frame.empty()) ANCHORSPLAT_RETURN_IF_ERROR(MoveToNerfstudioFrame(frame, applied, set));
  return set;
}

// Detects the type of a camera file, except NumPy's, by its first bytes.
Result<CameraSet> CamerasFromBytes(const std::filesystem::path& file, std::string_view bytes,
                                   const std::filesystem::path& folder, bool complete,
                                   const std::filesystem::path& frame) {
  std::string_view head = bytes.substr(0, kHeadBytes);
  if (head.starts_with("\xEF\xBB\xBF")) head.remove_prefix(3);  // UTF-8 byte order mark, allowed in XML and JSON
  head.remove_prefix(std::min(head.find_first_not_of(" \t\r\n"), head.size()));
  if (!head.starts_with('{') && !head.starts_with('[')) {
    const std::string foreign = ForeignCameras(file, head);
    if (!foreign.empty()) return Error{ErrorCode::kBadFile, Cat(file.string(), ": ", foreign)};
    const bool xml = head.starts_with('<'), bundler = LooksLikeBundler(head);
    if ((xml || bundler) && !frame.empty()) {
      return Error{ErrorCode::kBadFile, Cat(file.string(), ": ", NotOfNerfstudio(frame))};
    }
    if (xml) return CamerasFromMetashape(file.string(), bytes, folder);
    if (bundler) return CamerasFromBundler(file, bytes);
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const JsonFile parsed, JsonFile::Parse(file.string(), bytes));
  return CamerasFromJson(parsed.root(), folder, complete, frame);
}

// First bytes of a file; empty if unreadable.
std::string HeadOf(const std::filesystem::path& path) {
  std::string head(kHeadBytes, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), std::ssize(head));
  head.resize(static_cast<size_t>(std::max<std::streamsize>(0, file.gcount())));
  return head;
}

Result<CameraSet> ReadCameraFile(const std::filesystem::path& path, const std::filesystem::path& frame) {
  if (path.extension() == ".npy") {
    if (!frame.empty()) return Error{ErrorCode::kBadFile, Cat(path.string(), ": ", NotOfNerfstudio(frame))};
    return ReadPosesBounds(path);
  }
  // Project files may be far larger than camera files.
  if (IsFile(path)) {  // the bytes of a pipe can be read once only
    const std::string foreign = ForeignCameras(path, HeadOf(path));
    if (!foreign.empty()) return Error{ErrorCode::kBadFile, Cat(path.string(), ": ", foreign)};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string bytes, ReadFileBytes(path, kMostCameraBytes));
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  return CamerasFromBytes(path, bytes, folder, path.filename() == "transforms.json", frame);
}

Result<CameraSet> ReadModel(const std::filesystem::path& model, const std::filesystem::path& frame) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet set, ReadColmapModel(model));
  if (!frame.empty()) ANCHORSPLAT_RETURN_IF_ERROR(MoveToNerfstudioFrame(frame, {}, set));
  return set;
}

bool IsCameraFile(const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  if (name == "reconstruction.json") return true;
  // OpenDroneMap's contains only lenses.
  if (name == "cameras.json") return HeadOf(path).find("\"projection_type\"") == std::string::npos;
  if (name.ends_with(".json")) return name.starts_with("transforms");
  if (name.ends_with(".xml")) return IsFile(path) && LooksLikeMetashape(HeadOf(path));
  return name.ends_with(".out") && IsFile(path) && LooksLikeBundler(HeadOf(path));
}

// Camera files in a folder, sorted. OpenDroneMap and Bundler keep them one folder deeper.
Result<std::vector<std::filesystem::path>> FindCameraFiles(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> found;
  std::error_code code;
  for (std::filesystem::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    if (IsCameraFile(it->path())) found.push_back(it->path());
  }
  if (code) return Error{ErrorCode::kIo, Cat(folder.string(), ": ", code.message())};
  for (const auto& below : {folder / "opensfm" / "reconstruction.json", folder / "bundle" / "bundle.out"}) {
    if (Exists(below)) found.push_back(below);
  }
  std::sort(found.begin(), found.end());
  return found;
}

// Whether a model is at its usual place in COLMAP and INRIA projects.
bool IsPlainProject(const std::filesystem::path& project, const std::filesystem::path& model) {
  return model == project || model == project / "sparse" || model.parent_path() == project / "sparse";
}

// Models that COLMAP could not join have separate worlds and cannot be joined here either.
void TellOfOtherModels(const std::filesystem::path& project, std::span<const FoundModel> models) {
  if (models.size() < 2) return;
  const auto pictures = [](size_t count) { return Cat(count, count == 1 ? " picture" : " pictures"); };
  std::string others;
  for (const FoundModel& model : models.subspan(1)) {
    others += Cat(others.empty() ? "" : ", ", model.folder.string(), " (", pictures(model.pictures), ")");
  }
  const std::string text =
      Cat(project.string(), ": using ", models[0].folder.string(), " (", pictures(models[0].pictures), "), one of ",
          models.size(), " COLMAP models. To use another, pass its folder: ", others);
  if (std::ranges::any_of(models, [&](const auto& model) { return model.pictures != models[0].pictures; })) {
    LogWarning(text);
  } else {
    LogInfo(text);
  }
}

// Beside a file, a COLMAP model or up to two folders above it; empty if there is none.
std::filesystem::path FrameBeside(const std::filesystem::path& folder, int above) {
  std::filesystem::path up = folder.empty() ? std::filesystem::path(".") : folder;
  for (int i = 0; i <= above; ++i, up /= "..") {
    if (auto frame = (up / kNerfstudioFrame).lexically_normal(); Exists(frame)) return frame;
  }
  return {};
}

// `frame`: of the nerfstudio run that led here; empty: use the one beside the cameras, if any.
Result<CameraSet> ReadCameraFolder(const std::filesystem::path& folder, std::filesystem::path frame) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<std::filesystem::path> candidates, FindCameraFiles(folder));
  // A model inside a program's data, as nerfstudio's colmap, is not what the user meant.
  std::vector<FoundModel> models = FindColmapModels(folder);
  if (!candidates.empty() && !models.empty() && !IsPlainProject(folder, models[0].folder)) models.clear();
  if (!models.empty()) candidates.push_back(models[0].folder);
  // LLFF derives its file from a COLMAP model, which also has lens and points.
  if (candidates.empty() && Exists(folder / "poses_bounds.npy")) candidates.push_back(folder / "poses_bounds.npy");
  const std::filesystem::path own_frame = FrameBeside(folder, 0);
  if (candidates.empty() && frame.empty() && !own_frame.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::filesystem::path data, DataOfNerfstudioRun(folder));
    frame = own_frame;
    return IsFolder(data) ? ReadCameraFolder(data, frame) : ReadCameraFile(data, frame);
  }
  if (candidates.empty()) {
    const std::string foreign = ForeignCamerasIn(folder);
    return Error{
        ErrorCode::kNotFound,
        Cat(folder.string(),
            ": no cameras here: expected transforms.json, cameras.json, poses_bounds.npy, Metashape XML, "
            "OpenSfM's reconstruction.json, Bundler's bundle.out, or a COLMAP model (cameras and images as .bin "
            "or .txt, also in sparse/0 or sparse)",
            foreign.empty() ? "" : "; ", foreign)};
  }
  if (candidates.size() > 1) {
    std::string list;
    for (const auto& candidate : candidates) list += (list.empty() ? "" : ", ") + candidate.string();
    return Error{ErrorCode::kBadArgument,
                 Cat(folder.string(), ": contains several camera files; pass one of them: ", list)};
  }
  if (frame.empty()) frame = candidates[0] == folder ? FrameBeside(folder, 2) : own_frame;
  if (!IsFolder(candidates[0])) return ReadCameraFile(candidates[0], frame);
  TellOfOtherModels(folder, models);
  return ReadModel(candidates[0], frame);
}

// A folder of masks beside or among the images, in any spelling; empty if there is none.
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

// Masks for these views that are not found would otherwise go unnoticed.
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
    LogWarning(Cat(pictures - masked, " of ", pictures, " pictures have no mask and are used whole, the first is ",
                   Printable(bare->image.string()), " (", expected, ")"));
  } else if (const std::filesystem::path folder = MasksBeside(bare->image); !folder.empty()) {
    LogWarning(Cat(folder.string(), ": contains no mask for any of the ", pictures, " pictures; for ",
                   Printable(bare->image.filename().string()), " ", expected));
  }
}

// The first missing image; readers leave the path they tried.
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
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  if (IsFolder(path)) return ReadCameraFolder(path, {});
  const std::string name = path.filename().string();
  if (name == kNerfstudioFrame && Exists(path)) return ReadCameraFolder(folder, {});
  // Any file of a COLMAP model means the model.
  const bool colmap = name == "cameras.bin" || name == "images.bin" || name == "cameras.txt" || name == "images.txt";
  if (colmap && Exists(path)) {
    if (IsColmapModel(folder)) return ReadModel(folder, FrameBeside(folder, 2));
    return Error{ErrorCode::kNotFound,
                 Cat(folder.string(), ": a COLMAP model needs both cameras and images, as .bin or .txt")};
  }
  return ReadCameraFile(path, FrameBeside(path.parent_path(), 0));
}

}  // namespace

Result<CameraSet> ParseCameras(const std::string& name, std::string_view bytes, const std::filesystem::path& folder) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet set, CamerasFromBytes(name, bytes, folder, false, {}));
  ForgetMissing(set);
  return set;
}

Result<CameraSet> ReadCameras(const std::filesystem::path& path, std::filesystem::path* missing) {
  const AmbiguousPictures ambiguous;
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet set, ReadAnyCameras(path));
  if (missing != nullptr && !ambiguous.first().empty()) return Error{ErrorCode::kBadArgument, ambiguous.first()};
  const std::filesystem::path first = ForgetMissing(set);
  if (missing != nullptr) *missing = first;
  WarnOfMissingMasks(set);
  return set;
}

}  // namespace anchorsplat
