#include "cameras/colmap_model.h"

#include <algorithm>
#include <iterator>
#include <system_error>

#include "cameras/camera_checks.h"
#include "core/file_system.h"
#include "core/text.h"
#include "images/image_io.h"

namespace anchorsplat {

namespace {

// COLMAP's src/colmap/sensor/models.h.
constexpr ColmapCameraModel kModels[] = {
    {0, "SIMPLE_PINHOLE", 1, 3, LensModel::kStraight, true},
    {1, "PINHOLE", 2, 4, LensModel::kStraight, true},
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
  const std::string undistort = "; undistort the images first, e.g. colmap image_undistorter";
  const std::span<const double> bent = params.subspan(model.focals + 2);
  if (!model.undone) {
    if (model.lens == LensModel::kFisheye) {
      return BadModel(Cat("camera model ", model.name, " is not a lens that is known here", undistort));
    }
    for (const double distortion : bent) {
      if (distortion == 0) continue;
      return BadModel(
          Cat("lens distortion ", distortion, " of camera model ", model.name, " is not supported", undistort));
    }
  }
  if (width > kMaxImageSide || height > kMaxImageSide) {
    return BadModel(Cat("size ", width, " x ", height, ", more than ", kMaxImageSide, " pixels on a side"));
  }
  const Pinhole c{static_cast<int>(width),  static_cast<int>(height), params[0],
                  params[model.focals - 1], params[model.focals],     params[model.focals + 1]};
  if (!model.undone) return ThroughLens({}, c);
  Lens lens{.model = model.lens};
  const bool tangential = model.lens == LensModel::kRadial && bent.size() >= 4;  // OPENCV, FULL_OPENCV: k1 k2 p1 p2 …
  for (size_t i = 0; i < bent.size(); ++i) {
    if (!tangential || i < 2) {
      lens.radial[i] = bent[i];
    } else if (i < 4) {
      lens.tangential[i - 2] = bent[i];
    } else if (i == 4) {
      lens.radial[2] = bent[i];
    } else {
      lens.denominator[i - 5] = bent[i];
    }
  }
  return ThroughLens(lens, c);
}

Result<Camera> ViewFromColmap(const ColmapImage& image, const ColmapCameras& cameras,
                              std::span<const std::filesystem::path> picture_folders) {
  const std::string who = Cat("image \"", Printable(image.name), "\": ");
  if (ViewName(image.name).empty()) return BadModel("image without a name");
  const auto camera = cameras.find(image.camera);
  if (camera == cameras.end()) return BadModel(Cat(who, "camera ", image.camera, " is not in the list of cameras"));
  auto pose = PoseFromUnitQuaternion(image.quaternion, image.translation);
  if (!pose.ok()) return BadModel(who + pose.error().message);
  Camera view{ViewName(image.name), FindPicture(picture_folders, image.name), camera->second.straight, *std::move(pose),
              camera->second.photograph};
  view.photograph.mask = FindMask(picture_folders, image.name);
  return view;
}

bool IsColmapModel(const std::filesystem::path& folder) {
  return (Exists(folder / "cameras.bin") && Exists(folder / "images.bin")) ||
         (Exists(folder / "cameras.txt") && Exists(folder / "images.txt"));
}

Result<CameraSet> ReadColmapModel(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> picture_folders;
  for (const char* images : {"images", "../images", "../../images"}) {
    auto pictures = (folder / images).lexically_normal();
    if (IsFolder(pictures)) picture_folders.push_back(std::move(pictures));
  }
  const bool binary = Exists(folder / "cameras.bin") && Exists(folder / "images.bin");
  CameraSet set;
  set.source = CameraSource::kColmap;
  if (binary) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto cameras, ReadColmapCamerasBinary(folder / "cameras.bin"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(set.cameras, ReadColmapImagesBinary(folder / "images.bin", cameras, picture_folders));
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const auto cameras, ReadColmapCamerasText(folder / "cameras.txt"));
    ANCHORSPLAT_ASSIGN_OR_RETURN(set.cameras, ReadColmapImagesText(folder / "images.txt", cameras, picture_folders));
  }
  if (set.cameras.empty()) return BadModel(Cat(folder.string(), ": the COLMAP model has no images"));
  return set;
}

Result<std::vector<ColmapPoint>> ReadColmapPoints(const std::filesystem::path& folder) {
  if (Exists(folder / "points3D.bin")) return ReadColmapPointsBinary(folder / "points3D.bin");
  if (Exists(folder / "points3D.txt")) return ReadColmapPointsText(folder / "points3D.txt");
  return Error{ErrorCode::kNotFound, Cat(folder.string(), ": neither points3D.bin nor points3D.txt is here")};
}

}  // namespace anchorsplat
