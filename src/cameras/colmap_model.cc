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
    {0, "SIMPLE_PINHOLE", 1, 3, false},
    {1, "PINHOLE", 2, 4, false},
    {2, "SIMPLE_RADIAL", 1, 4, false},
    {3, "RADIAL", 1, 5, false},
    {4, "OPENCV", 2, 8, false},
    {5, "OPENCV_FISHEYE", 2, 8, true},
    {6, "FULL_OPENCV", 2, 12, false},
    {7, "FOV", 2, 5, false},
    {8, "SIMPLE_RADIAL_FISHEYE", 1, 4, true},
    {9, "RADIAL_FISHEYE", 1, 5, true},
    {10, "THIN_PRISM_FISHEYE", 2, 12, true},
    {11, "RAD_TAN_THIN_PRISM_FISHEYE", 2, 16, true},
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

Result<Pinhole> PinholeFromColmap(const ColmapCameraModel& model, uint64_t width, uint64_t height,
                                  std::span<const double> params) {
  const std::string undistort = "; undistort the images first, e.g. colmap image_undistorter";
  if (model.fisheye) return BadModel(Cat("camera model ", model.name, " is not a pinhole camera", undistort));
  for (const double distortion : params.subspan(model.focals + 2)) {
    if (distortion != 0) {
      return BadModel(
          Cat("lens distortion ", distortion, " of camera model ", model.name, " is not supported", undistort));
    }
  }
  if (width > kMaxImageSide || height > kMaxImageSide) {
    return BadModel(Cat("size ", width, " x ", height, ", more than ", kMaxImageSide, " pixels on a side"));
  }
  const Pinhole c{static_cast<int>(width),  static_cast<int>(height), params[0],
                  params[model.focals - 1], params[model.focals],     params[model.focals + 1]};
  ANCHORSPLAT_RETURN_IF_ERROR(CheckIntrinsics(c));
  return c;
}

Result<Camera> CameraFromColmap(const ColmapImage& image, const ColmapCameras& cameras,
                                std::span<const std::filesystem::path> picture_folders) {
  const std::string who = Cat("image \"", Printable(image.name), "\": ");
  if (ViewName(image.name).empty()) return BadModel("image without a name");
  const auto intrinsics = cameras.find(image.camera);
  if (intrinsics == cameras.end()) return BadModel(Cat(who, "camera ", image.camera, " is not in the list of cameras"));
  auto pose = PoseFromUnitQuaternion(image.quaternion, image.translation);
  if (!pose.ok()) return BadModel(who + pose.error().message);
  return Camera{ViewName(image.name), FindPicture(picture_folders, image.name), intrinsics->second, *std::move(pose)};
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
