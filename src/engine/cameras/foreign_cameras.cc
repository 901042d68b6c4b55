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
    "export the registration there as COLMAP, or as Bundler (bundle.out and its list)";
constexpr const char* kByNerfstudio = "nerfstudio's ns-process-data makes a transforms.json of it";

const std::vector<ForeignProgram>& ForeignPrograms() {
  static const std::vector<ForeignProgram> programs = {
      {{".psx", ".psz", ".psb"},
       {},
       "a project of Metashape",
       "export its cameras there (File > Export > Export Cameras, Agisoft XML)"},
      {{".opk"},
       {"#PhotoID", "# PhotoID", "# CoordinateSystem", "#CoordinateSystem"},
       "Metashape's table of positions and angles, which lacks the lens",
       "export the cameras as Agisoft XML there"},
      {{".nvm"},
       {"NVM_V3"},
       "a reconstruction of VisualSFM",
       "save it in Bundler's format there (bundle.out and list.txt)"},
      {{".sfm", ".mg"}, {}, "a file of Meshroom", "make a COLMAP model of it (aliceVision_exportColmap)"},
      {{".rcproj", ".rsproj", ".rcalign", ".rsalign", ".rcbox"}, {}, "a file of RealityCapture", kFromRealityCapture},
      {{".xmp"}, {"<x:xmpmeta"}, "RealityCapture's XMP, one file for each picture", kFromRealityCapture},
      {{}, {"#name,x,y", "#cameras", "#name;x;y"}, "RealityCapture's table of cameras", kFromRealityCapture},
      {{".p4d", ".opf"},
       {"fileName imageWidth imageHeight"},
       "a file of Pix4D",
       "export OPF there and make a COLMAP model of it (opf2colmap of pyopf)"},
      {{".r3d"}, {}, "a capture of Record3D", kByNerfstudio},
      {{".abc", ".fbx", ".usd", ".usda", ".usdc", ".usdz", ".blend"},
       {},
       "a scene of a 3D program",
       "export its cameras as transforms.json, or as a COLMAP model"},
      {{".db"},
       {"SQLite format 3"},
       "COLMAP's database, which has no poses",
       "give the model (cameras and images), or the project"},
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
      return LooksLike("the poses that ns-export wrote, which lack the lens",
                       "give the transforms.json that was trained with");
    }
    return {};
  }
  if (root.has("sfm_data_version")) {
    return LooksLike("OpenMVG's sfm_data.json", "make a COLMAP model of it (openMVG_main_openMVG2Colmap)");
  }
  if (root.has("views") && root.has("intrinsics")) {
    return LooksLike("a file of Meshroom", "make a COLMAP model of it (aliceVision_exportColmap)");
  }
  if (root.has("camera_path")) {
    return LooksLike("a camera path for nerfstudio's viewer, which is of no pictures",
                     "give the transforms.json that was trained with");
  }
  if (root.has("cameraPoseARFrame") || root.has("t_00") || (root.has("poses") && root.has("K"))) {
    return LooksLike("a frame of an ARKit capture", kByNerfstudio);
  }
  if (root.raw().is_object() && !root.raw().empty()) {
    const auto& value = root.raw().front();
    if (value.is_object() && value.contains("projection_type")) {
      return LooksLike("the lenses of OpenSfM or OpenDroneMap, without poses",
                       "give the reconstruction.json beside it or in the folder opensfm");
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
