#include "cameras/colmap_model.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <system_error>

#include "cameras/camera_checks.h"
#include "cameras/picture_search.h"
#include "core/file_system.h"
#include "core/text.h"
#include "images/image_io.h"

namespace anchorsplat {

namespace {

// COLMAP's src/colmap/sensor/models.h.
constexpr ColmapCameraModel kModels[] = {
    {0, "SIMPLE_PINHOLE", 1, 3, LensModel::kNone, true},
    {1, "PINHOLE", 2, 4, LensModel::kNone, true},
    {2, "SIMPLE_RADIAL", 1, 4, LensModel::kRadial, true},
    {3, "RADIAL", 1, 5, LensModel::kRadial, true},
    {4, "OPENCV", 2, 8, LensModel::kRadial, true},
    {5, "OPENCV_FISHEYE", 2, 8, LensModel::kFisheye, true},
    {6, "FULL_OPENCV", 2, 12, LensModel::kRadial, true},
    {7, "FOV", 2, 5, LensModel::kRadial, false},
    {8, "SIMPLE_RADIAL_FISHEYE", 1, 4, LensModel::kFisheye, true},
    {9, "RADIAL_FISHEYE", 1, 5, LensModel::kFisheye, true},
    {10, "THIN_PRISM_FISHEYE", 2, 12, LensModel::kFisheye, false},
    {11, "RAD_TAN_THIN_PRISM_FISHEYE", 2, 16, LensModel::kFisheye, false},
};

Error BadModel(std::string sentence) { return Error{ErrorCode::kBadFile, std::move(sentence)}; }

PicturePlaces PlacesOfModel(const std::filesystem::path& folder) {
  PicturePlaces places;
  places.project = ProjectAbove(folder);
  places.complete = true;
  // INRIA's convert.py keeps the model of the original images in PROJECT/distorted, these in PROJECT/input, and
  // undistorted ones in PROJECT/images.
  const std::string relative = AbsolutePath(folder).lexically_relative(AbsolutePath(places.project)).string();
  places.originals = relative.starts_with("distorted");
  std::vector<std::filesystem::path> usual = {folder / "images", folder / "../images", folder / "../../images"};
  if (places.originals) usual = {places.project / "input"};
  for (const auto& images : usual) {
    auto pictures = images.lexically_normal();
    if (IsFolder(pictures)) places.folders.push_back(std::move(pictures));
  }
  if (places.folders.empty()) places.folders.push_back(places.project / (places.originals ? "input" : "images"));
  return places;
}

// Models directly in a folder whose names begin with `called`, sorted by name with numbers in numeric order.
std::vector<std::filesystem::path> ModelsIn(const std::filesystem::path& folder, const std::string& called) {
  std::vector<std::filesystem::path> models;
  std::error_code code;
  for (std::filesystem::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    if (it->path().filename().string().starts_with(called) && IsColmapModel(it->path()))
      models.push_back(folder / it->path().filename());
  }
  std::ranges::sort(models, {}, [](const std::filesystem::path& model) {
    const std::string name = model.filename().string();
    return std::pair(name.size(), name);
  });
  return models;
}

}  // namespace

const ColmapCameraModel* FindColmapCameraModel(int id) {
  const auto found = std::find_if(std::begin(kModels), std::end(kModels), [&](const auto& m) { return m.id == id; });
  return found == std::end(kModels) ? nullptr : found;
}

const ColmapCameraModel* FindColmapCameraModel(const std::string& name) {
  const auto found =
      std::find_if(std::begin(kModels), std::end(kModels), [&](const auto& m) { return m.name == name; });
  return found == std::end(kModels) ? nullptr : found;
}

Result<LensedPinhole> CameraFromColmap(const ColmapCameraModel& model, uint64_t width, uint64_t height,
                                       std::span<const double> params) {
  const std::string undistort = "; undistort the images first, e.g. with colmap image_undistorter";
  const std::span<const double> coefficients = params.subspan(model.focals + 2);
  if (!model.supports_distortion) {
    if (model.lens == LensModel::kFisheye) {
      return BadModel(Cat("camera model ", model.name, " is not supported", undistort));
    }
    for (const double coefficient : coefficients) {
      if (coefficient == 0) continue;
      return BadModel(
          Cat("lens distortion ", coefficient, " of camera model ", model.name, " is not supported", undistort));
    }
  }
  if (width > kMaxImageSide || height > kMaxImageSide) {
    return BadModel(Cat("size ", width, " x ", height, ", more than ", kMaxImageSide, " pixels on a side"));
  }
  const Pinhole c{static_cast<int>(width),  static_cast<int>(height), params[0],
                  params[model.focals - 1], params[model.focals],     params[model.focals + 1]};
  if (!model.supports_distortion) return ThroughLens({}, c);
  Lens lens{.model = model.lens};
  const bool tangential =
      model.lens == LensModel::kRadial && coefficients.size() >= 4;  // OPENCV, FULL_OPENCV: k1 k2 p1 p2 …
  for (size_t i = 0; i < coefficients.size(); ++i) {
    if (!tangential || i < 2) {
      lens.radial[i] = coefficients[i];
    } else if (i < 4) {
      lens.tangential[i - 2] = coefficients[i];
    } else if (i == 4) {
      lens.radial[2] = coefficients[i];
    } else {
      lens.denominator[i - 5] = coefficients[i];
    }
  }
  return ThroughLens(lens, c);
}

Result<Camera> ViewFromColmap(const ColmapImage& image, const ColmapCameras& cameras) {
  const std::string who = Cat("image \"", Printable(image.name), "\": ");
  if (ViewName(image.name).empty()) return BadModel("image without a name");
  const auto camera = cameras.find(image.camera);
  if (camera == cameras.end()) return BadModel(Cat(who, "camera ", image.camera, " is not in the list of cameras"));
  auto pose = PoseFromQuaternion(image.quaternion, image.translation);
  if (!pose.ok()) return BadModel(who + pose.error().message);
  return Camera{ViewName(image.name), image.name, camera->second.undistorted, *std::move(pose),
                camera->second.photograph};
}

std::vector<FoundModel> FindColmapModels(const std::filesystem::path& project) {
  std::vector<FoundModel> found, others;
  // Several of these are stages of one reconstruction: the project's sparse is the result, text files beside it are its
  // input. A model with as many images is the same in another form.
  const auto take = [&](const std::filesystem::path& folder, const std::string& called) {
    std::vector<std::filesystem::path> models = ModelsIn(folder, called);
    if (IsColmapModel(folder)) models.push_back(folder);
    std::vector<FoundModel> here;
    for (const auto& model : models) {
      const auto count = Exists(model / "cameras.bin") && Exists(model / "images.bin")
                             ? CountColmapImagesBinary(model / "images.bin")
                             : CountColmapImagesText(model / "images.txt");
      here.push_back({model, count.ok() ? *count : 0});  // errors are reported when it is read
    }
    std::ranges::stable_sort(here, std::ranges::greater(), &FoundModel::pictures);
    if (found.empty()) {
      found = std::move(here);
      return;
    }
    for (FoundModel& model : here) {
      const auto is_known = [&](const FoundModel& known) { return known.folder == model.folder; };
      if (model.pictures == found[0].pictures || std::ranges::any_of(found, is_known) ||
          std::ranges::any_of(others, is_known)) {
        continue;
      }
      others.push_back(std::move(model));
    }
  };
  take(project / "sparse", "");
  // In a folder of any kind, only subfolders with that name.
  const bool sparse = AbsolutePath(project / ".").parent_path().filename().string().starts_with("sparse");
  take(project, sparse ? "" : "sparse");
  for (const char* place :
       {"colmap/sparse", "colmap", "colmap_sparse", "colmap_text", "dense/sparse", "distorted/sparse"}) {
    take(project / place, "");
  }
  found.insert(found.end(), others.begin(), others.end());
  return found;
}

bool IsColmapModel(const std::filesystem::path& folder) {
  return (Exists(folder / "cameras.bin") && Exists(folder / "images.bin")) ||
         (Exists(folder / "cameras.txt") && Exists(folder / "images.txt"));
}

Result<CameraSet> ReadColmapModel(const std::filesystem::path& folder) {
  const bool binary = Exists(folder / "cameras.bin") && Exists(folder / "images.bin");
  CameraSet set;
  set.source = CameraSource::kColmap;
  if (binary) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto cameras, ReadColmapCamerasBinary(folder / "cameras.bin"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(set.cameras, ReadColmapImagesBinary(folder / "images.bin", cameras));
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto cameras, ReadColmapCamerasText(folder / "cameras.txt"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(set.cameras, ReadColmapImagesText(folder / "images.txt", cameras));
  }
  if (set.cameras.empty()) return BadModel(Cat(folder.string(), ": the COLMAP model has no images"));
  FindPicturesOf(PlacesOfModel(folder), set.cameras);
  return set;
}

Result<std::vector<ColmapPoint>> ReadColmapPoints(const std::filesystem::path& folder) {
  if (Exists(folder / "points3D.bin")) return ReadColmapPointsBinary(folder / "points3D.bin");
  if (Exists(folder / "points3D.txt")) return ReadColmapPointsText(folder / "points3D.txt");
  return Error{ErrorCode::kNotFound, Cat(folder.string(), ": contains neither points3D.bin nor points3D.txt")};
}

}  // namespace anchorsplat
