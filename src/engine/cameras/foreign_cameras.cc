#include "cameras/foreign_cameras.h"

#include <algorithm>
#include <cctype>
#include <system_error>
#include <vector>

#include "core/text.h"

namespace anchorsplat {

namespace {

struct ForeignProgram {
  std::vector<std::string_view> extensions;  // lower case
  std::vector<std::string_view> beginnings;  // first bytes of the file
  const char* what;
  const char* instead;
};

constexpr const char* kFromRealityCapture =
    "export the registration as COLMAP, or as Bundler (bundle.out and its picture list)";
constexpr const char* kByNerfstudio = "convert it to a transforms.json with nerfstudio's ns-process-data";
constexpr const char* kPassCameras = "pass the transforms.json, the COLMAP model or the project folder";

const std::vector<ForeignProgram>& ForeignPrograms() {
  static const std::vector<ForeignProgram> programs = {
      {{".psx", ".psz", ".psb"},
       {},
       "a Metashape project",
       "export its cameras from Metashape (File > Export > Export Cameras, Agisoft XML)"},
      {{".opk"},
       {"#PhotoID", "# PhotoID", "# CoordinateSystem", "#CoordinateSystem"},
       "Metashape's table of positions and angles, without the lens",
       "export the cameras as Agisoft XML instead"},
      {{".nvm"}, {"NVM_V3"}, "a VisualSFM reconstruction", "save it in Bundler's format (bundle.out and list.txt)"},
      {{".sfm", ".mg"}, {}, "a Meshroom file", "convert it to a COLMAP model with aliceVision_exportColmap"},
      {{".rcproj", ".rsproj", ".rcalign", ".rsalign", ".rcbox"}, {}, "a RealityCapture file", kFromRealityCapture},
      {{".xmp"}, {"<x:xmpmeta"}, "RealityCapture XMP, one file per picture", kFromRealityCapture},
      {{}, {"#name,x,y", "#cameras", "#name;x;y"}, "a RealityCapture camera table", kFromRealityCapture},
      {{".p4d", ".opf"},
       {"fileName imageWidth imageHeight"},
       "a Pix4D file",
       "export OPF and convert it to a COLMAP model with pyopf's opf2colmap"},
      {{".r3d"}, {}, "a Record3D capture", kByNerfstudio},
      {{".splat", ".ksplat", ".spz", ".sog"},
       {"ply\n", "ply\r", "glTF"},
       "a splat or a point cloud, not cameras",
       kPassCameras},
      {{}, {"\x89PNG", "\xff\xd8\xff", "RIFF"}, "a picture, not cameras", kPassCameras},
      {{".abc", ".fbx", ".usd", ".usda", ".usdc", ".usdz", ".blend"},
       {},
       "a scene file of a 3D program",
       "export its cameras as transforms.json, or as a COLMAP model"},
      {{".db"},
       {"SQLite format 3"},
       "a COLMAP database, which has no poses",
       "pass the model (cameras and images) or the project folder"},
  };
  return programs;
}

std::string LooksLike(const char* what, const char* instead) { return Cat("looks like ", what, "; ", instead); }

}  // namespace

std::string ForeignCameras(const std::filesystem::path& file, std::string_view head) {
  if (head.starts_with("\xEF\xBB\xBF")) head.remove_prefix(3);
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const ForeignProgram& program : ForeignPrograms()) {
    const bool by_name = std::ranges::find(program.extensions, extension) != program.extensions.end();
    if (by_name || std::ranges::any_of(program.beginnings, [&](auto text) { return head.starts_with(text); })) {
      return LooksLike(program.what, program.instead);
    }
  }
  return {};
}

std::string ForeignJson(const JsonValue& root) {
  if (root.raw().is_array()) {
    if (root.raw().empty()) return {};
    const JsonValue first = root.Element(0);
    if (first.has("file_path") && first.has("transform")) {
      return LooksLike("poses written by ns-export, without the lens", "pass the transforms.json used for training");
    }
    return {};
  }
  if (root.has("sfm_data_version")) {
    return LooksLike("OpenMVG's sfm_data.json", "convert it to a COLMAP model with openMVG_main_openMVG2Colmap");
  }
  if (root.has("views") && root.has("intrinsics")) {
    return LooksLike("a Meshroom file", "convert it to a COLMAP model with aliceVision_exportColmap");
  }
  if (root.has("camera_path")) {
    return LooksLike("a camera path of nerfstudio's viewer, not training cameras",
                     "pass the transforms.json used for training");
  }
  if (root.has("cameraPoseARFrame") || root.has("t_00") || (root.has("poses") && root.has("K"))) {
    return LooksLike("a frame of an ARKit capture", kByNerfstudio);
  }
  if (root.raw().is_object() && !root.raw().empty()) {
    const auto& value = root.raw().front();
    if (value.is_object() && value.contains("projection_type")) {
      return LooksLike("OpenSfM or OpenDroneMap lenses, without poses",
                       "pass the reconstruction.json beside it or in the folder opensfm");
    }
  }
  return {};
}

std::string ForeignCamerasIn(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code code;
  for (std::filesystem::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    files.push_back(it->path());
  }
  std::sort(files.begin(), files.end());
  for (const auto& file : files) {
    if (std::string found = ForeignCameras(file); !found.empty()) return Cat(file.string(), " ", found);
  }
  return {};
}

}  // namespace anchorsplat
