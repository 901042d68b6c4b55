#include "cameras/foreign_cameras.h"

#include <gtest/gtest.h>

#include <string>

#include "cameras/camera_io.h"
#include "cameras/rig_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

TEST(ForeignCameras, AreNamedWithWhatToExportInstead) {
  struct Case {
    const char *name, *text, *what, *instead;
  };
  const Case cases[] = {
      {"scan.psx", "<document version=\"1.2.0\" path=\"{projectname}.files/project.zip\"/>", "a Metashape project",
       "Agisoft XML"},
      {"SCAN.PSZ", "PK", "a Metashape project", "Agisoft XML"},
      {"angles.txt", "# CoordinateSystem: LOCAL_CS\n#PhotoID, X, Y, Z, Omega, Phi, Kappa\n", "without the lens",
       "Agisoft XML"},
      {"scan.nvm", "NVM_V3 \n\n2\n", "VisualSFM", "Bundler"},
      {"renamed.txt", "NVM_V3 \n\n2\n", "VisualSFM", "Bundler"},
      {"cameras.sfm", R"({"version": ["1"], "views": [], "intrinsics": [], "poses": []})", "Meshroom", "exportColmap"},
      {"meshroom.json", R"({"version": ["1"], "views": [], "intrinsics": [], "poses": []})", "Meshroom",
       "exportColmap"},
      {"sfm_data.json", R"({"sfm_data_version": "0.3", "views": [], "intrinsics": []})", "OpenMVG", "openMVG2Colmap"},
      {"rc.csv", "#name,x,y,alt,heading,pitch,roll,f,px,py,k1\n", "RealityCapture", "COLMAP"},
      {"rc2.csv", "\xEF\xBB\xBF#cameras 12\n", "RealityCapture", "COLMAP"},
      {"IMG_1.xmp", "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\">", "RealityCapture", "Bundler"},
      {"scan_calibrated_camera_parameters.txt", "fileName imageWidth imageHeight\n", "Pix4D", "opf2colmap"},
      {"frame_00000.json", R"({"cameraPoseARFrame": [1], "intrinsics": [1]})", "ARKit", "ns-process-data"},
      {"camera_path.json", R"({"camera_path": [], "fps": 24})", "camera path", "transforms.json"},
      {"transforms_eval.json", R"([{"file_path": "a.png", "transform": [[1]]}])", "ns-export", "transforms.json"},
      {"camera_models.json", R"({"v2 dji 1 2 brown": {"projection_type": "brown"}})", "without poses",
       "reconstruction.json"},
      {"scan.ply", "ply\nformat binary_little_endian 1.0\n", "a splat or a point cloud, not cameras",
       "transforms.json"},
      {"scan.spz", "\x1f\x8b", "a splat or a point cloud, not cameras", "project folder"},
      {"picture.json", "\x89PNG\r\n", "a picture, not cameras", "COLMAP model"},
      {"database.db", "SQLite format 3", "database", "the model"},
  };
  for (const Case& c : cases) {
    const TestFolder folder;
    WriteText(folder / c.name, c.text);
    const auto set = ReadCameras(folder / c.name);
    ASSERT_FALSE(set.ok()) << c.name;
    EXPECT_EQ(set.error().code, ErrorCode::kBadFile) << c.name;
    for (const std::string words : {c.name, "looks like", c.what, c.instead}) {
      EXPECT_NE(set.error().message.find(words), std::string::npos) << words << "\n" << set.error().message;
    }
  }
}

TEST(ForeignCameras, FoldersSayWhatIsThere) {
  const TestFolder folder;
  WriteText(folder / "scan.psx", "<document/>");
  const auto set = ReadCameras(folder.path());
  ASSERT_FALSE(set.ok());
  EXPECT_EQ(set.error().code, ErrorCode::kNotFound);
  EXPECT_NE(set.error().message.find("scan.psx looks like a Metashape project"), std::string::npos)
      << set.error().message;
}

}  // namespace
}  // namespace anchorsplat
