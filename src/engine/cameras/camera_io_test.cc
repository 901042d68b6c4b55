#include "cameras/camera_io.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <utility>

#include "cameras/parse_cameras.h"
#include "cameras/rig_for_test.h"
#include "core/messages_for_test.h"
#include "core/random.h"
#include "core/rotation.h"
#include "core/source_dir_for_test.h"
#include "images/image_io.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

void Write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << text;
}

CameraSet RandomCameras(int count, uint64_t seed) {
  Random random(seed);
  CameraSet set;
  for (int i = 0; i < count; ++i) {
    Camera camera;
    camera.name = "views/" + std::to_string(i);
    camera.intrinsics = {320, 240, 300.25, 1.0 / 3, 160.5, 119};
    camera.world_to_camera.rotation =
        RotationFromQuaternion(random.Normal(), random.Normal(), random.Normal(), random.Normal());
    for (double& x : camera.world_to_camera.translation) x = 10 * random.Normal();
    set.cameras.push_back(camera);
  }
  return set;
}

void ExpectSame(const CameraSet& a, const CameraSet& b, double tolerance) {
  EXPECT_EQ(a.background, b.background);
  ASSERT_EQ(a.cameras.size(), b.cameras.size());
  for (size_t i = 0; i < a.cameras.size(); ++i) {
    const Camera &x = a.cameras[i], &y = b.cameras[i];
    EXPECT_EQ(x.name, y.name);
    EXPECT_EQ(x.intrinsics.width, y.intrinsics.width);
    EXPECT_EQ(x.intrinsics.height, y.intrinsics.height);
    EXPECT_EQ(x.intrinsics.fx, y.intrinsics.fx);
    EXPECT_EQ(x.intrinsics.fy, y.intrinsics.fy);
    EXPECT_EQ(x.intrinsics.cx, y.intrinsics.cx);
    EXPECT_EQ(x.intrinsics.cy, y.intrinsics.cy);
    EXPECT_EQ(x.world_to_camera.rotation, y.world_to_camera.rotation);
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(x.world_to_camera.translation[k], y.world_to_camera.translation[k], tolerance);
    }
  }
}

TEST(WriteTransforms, RoundTrips) {
  const TestFolder folder;
  CameraSet set = RandomCameras(5, 1);
  set.background = {0.1f, 0.0f, 1.0f};
  set.cameras[2].intrinsics.fx = 299;
  set.cameras[3].intrinsics = {64, 32, 10, 11, 12, 13};
  const auto path = folder / "transforms.json";
  ASSERT_TRUE(WriteTransforms(path, set).ok());
  const auto read = ReadCameras(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  ExpectSame(set, *read, 1e-13);
  // Each frame says only what is its own.
  const std::string text = FileBytes(path);
  const auto count = [&](const std::string& what) {
    int found = 0;
    for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count("\"fl_x\""), 3);
  EXPECT_EQ(count("\"fl_y\""), 2);
  EXPECT_EQ(count("\"w\": 320"), 1);
  EXPECT_EQ(count("0.1,"), 1) << text.substr(0, 200);

  const Status again = WriteTransforms(path, set);
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::kExists);
  EXPECT_TRUE(WriteTransforms(path, *read, {.overwrite = true}).ok());
}

TEST(ParseCameras, IsWhatTheFileSays) {
  const auto example = SourceDirForTest() / "examples/biplane/transforms_hr.json";
  const auto read = ReadCameras(example);
  const auto parsed = ParseCameras("upload", FileBytes(example), example.parent_path());
  ASSERT_TRUE(parsed.ok()) << parsed.error().message;
  ExpectSame(*read, *parsed, 0);
  for (const char* text : {"", "3", "{}", "[{}]", "{\"frames\": 1"}) {
    const auto none = ParseCameras("upload", text);
    ASSERT_FALSE(none.ok()) << text;
    EXPECT_EQ(none.error().code, ErrorCode::kBadFile) << text;
    EXPECT_TRUE(none.error().message.starts_with("upload: ")) << none.error().message;
  }
}

TEST(WriteTransforms, KeepsTheExamples) {
  const TestFolder folder;
  const auto example = SourceDirForTest() / "examples/biplane/transforms_hr.json";
  const auto set = ReadCameras(example);
  ASSERT_TRUE(set.ok());
  ASSERT_TRUE(WriteTransforms(folder / "t.json", *set).ok());
  const auto read = ReadCameras(folder / "t.json");
  ASSERT_TRUE(read.ok()) << read.error().message;
  ExpectSame(*set, *read, 1e-6);  // its matrices are rotations to float precision
}

TEST(WriteTransforms, KeepsThePicturesExtension) {
  const TestFolder folder;
  CameraSet set = RandomCameras(1, 2);
  set.cameras[0].image = "/somewhere/else/0.JPG";
  ASSERT_TRUE(WriteTransforms(folder / "t.json", set).ok());
  EXPECT_NE(FileBytes(folder / "t.json").find("\"views/0.JPG\""), std::string::npos);
}

TEST(WriteTransforms, RefusesWhatCouldNotBeReadAgain) {
  const TestFolder folder;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<CameraSet> sets(8, RandomCameras(2, 3));
  sets[0].cameras.clear();
  sets[1].cameras[1].intrinsics.fx = nan;
  sets[2].cameras[0].intrinsics.cx = nan;
  sets[3].cameras[1].world_to_camera.translation[1] = nan;
  sets[4].cameras[1].world_to_camera.rotation[0] += 0.5;
  sets[5].cameras[1].name = "\xff\xfe";
  sets[6].cameras[1].name = "";
  sets[7].background = {0.0f, 2.0f, 0.0f};
  for (size_t i = 0; i < sets.size(); ++i) {
    const Status status = WriteTransforms(folder / "t.json", sets[i]);
    ASSERT_FALSE(status.ok()) << i;
    EXPECT_EQ(status.error().code, ErrorCode::kBadArgument) << i;
  }
  EXPECT_EQ(folder.Entries(), 0);
}

const char kInria[] = R"([{"id": 0, "img_name": "a", "width": 40, "height": 30, "position": [1, 2, 3],
  "rotation": [[0, 0, 1], [1, 0, 0], [0, 1, 0]], "fy": 60.0, "fx": 50.0}])";

TEST(InriaCameras, ArePositionAndCameraToWorld) {
  const TestFolder folder;
  std::filesystem::create_directory(folder / "images");
  ASSERT_TRUE(WritePng(folder / "images" / "a.png", Image(4, 4, 3)).ok());
  Write(folder / "cameras.json", kInria);
  const auto set = ReadCameras(folder / "cameras.json");
  ASSERT_TRUE(set.ok()) << set.error().message;
  const Camera& camera = set->cameras.at(0);
  EXPECT_EQ(camera.name, "a");
  EXPECT_EQ(camera.image, folder / "images/a.png");
  EXPECT_EQ(camera.intrinsics.fx, 50);
  EXPECT_EQ(camera.intrinsics.fy, 60);
  EXPECT_EQ(camera.intrinsics.cx, 20);
  EXPECT_EQ(camera.intrinsics.cy, 15);
  const auto center = camera.Center();
  EXPECT_NEAR(center[0], 1, 1e-12);
  EXPECT_NEAR(center[1], 2, 1e-12);
  EXPECT_NEAR(center[2], 3, 1e-12);
  // The third column is where the camera looks: the world's x.
  const auto ahead = camera.ToCamera({6, 2, 3});
  EXPECT_NEAR(ahead[0], 0, 1e-12);
  EXPECT_NEAR(ahead[2], 5, 1e-12);
}

TEST(InriaCameras, MalformedFilesSayWhatIsWrong) {
  const std::pair<std::pair<const char*, const char*>, const char*> cases[] = {
      {{"\"img_name\": \"a\", ", ""}, "[0]: \"img_name\" is missing"},
      {{"\"width\": 40", "\"width\": 0"}, "[0].width: expected a whole number"},
      {{"\"width\": 40", "\"width\": \"40\""}, "[0].width: expected a number, found string"},
      {{"\"fx\": 50.0", "\"fx\": 0"}, "focal length 0"},
      {{"\"fx\": 50.0", "\"f\": 50"}, "[0]: \"fx\" is missing"},
      {{"[1, 2, 3]", "[1, 2]"}, "[0].position: expected 3 numbers, found 2"},
      {{"[1, 2, 3]", "[1, 2, null]"}, "[0].position[2]"},
      {{"[0, 0, 1], ", ""}, "3 rows"},
      {{"[0, 0, 1]", "[0, 0, 2]"}, "[0].rotation: camera matrix is not a rotation"},
      {{"[0, 0, 1]", "[0, 0, -1]"}, "not a rotation"},
      {{"{\"id\"", "3, {\"id\""}, "[0]: expected an object"},
  };
  for (const auto& [change, expected] : cases) {
    const TestFolder folder;
    std::string text = kInria;
    text.replace(text.find(change.first), std::string(change.first).size(), change.second);
    Write(folder / "cameras.json", text);
    const auto set = ReadCameras(folder / "cameras.json");
    ASSERT_FALSE(set.ok()) << text;
    EXPECT_EQ(set.error().code, ErrorCode::kBadFile);
    EXPECT_NE(set.error().message.find(expected), std::string::npos) << expected << "\n" << set.error().message;
  }
  const TestFolder folder;
  for (const char* text : {"[]", "3", "\"x\"", "null", "{}"}) {
    Write(folder / "cameras.json", text);
    EXPECT_EQ(ReadCameras(folder / "cameras.json").error().code, ErrorCode::kBadFile) << text;
  }
}

TEST(ReadCameras, TakesTheOnlyCandidateOfAFolder) {
  const TestFolder folder;
  EXPECT_EQ(ReadCameras(folder.path()).error().code, ErrorCode::kNotFound);
  ASSERT_TRUE(WriteTransforms(folder / "transforms_train.json", RandomCameras(3, 4)).ok());
  auto set = ReadCameras(folder.path());
  ASSERT_TRUE(set.ok()) << set.error().message;
  EXPECT_EQ(set->cameras.size(), 3u);
  Write(folder / "cameras.json", kInria);
  set = ReadCameras(folder.path());
  ASSERT_FALSE(set.ok());
  EXPECT_EQ(set.error().code, ErrorCode::kBadArgument);
  for (const char* name : {"transforms_train.json", "cameras.json"}) {
    EXPECT_NE(set.error().message.find(name), std::string::npos) << set.error().message;
  }
}

// Each with any other: what a folder's cameras are is never guessed.
TEST(ReadCameras, SeveralSetsOfOtherProgramsAreListed) {
  const std::pair<const char*, const char*> files[] = {
      {"cameras.json", kInria},
      {"export.xml", "<?xml version=\"1.0\"?>\n<document version=\"2.0.0\">\n  <chunk/></document>"},
      {"reconstruction.json", "[{\"cameras\": {}, \"shots\": {}}]"},
      {"scan.out", "# Bundle file v0.3\n0 0\n"},
      {"opensfm/reconstruction.json", "[{\"cameras\": {}, \"shots\": {}}]"},
      {"bundle/bundle.out", "# Bundle file v0.3\n0 0\n"}};
  for (const auto& one : files) {
    for (const auto& other : files) {
      if (one == other) continue;
      const TestFolder folder;
      for (const auto& [name, text] : {one, other}) {
        std::filesystem::create_directories((folder / name).parent_path());
        Write(folder / name, text);
      }
      Write(folder / "settings.xml", "<document><settings/></document>");
      Write(folder / "run.out", "stdout of something else");
      const auto set = ReadCameras(folder.path());
      ASSERT_FALSE(set.ok()) << one.first << " " << other.first;
      EXPECT_EQ(set.error().code, ErrorCode::kBadArgument) << set.error().message;
      for (const char* name : {one.first, other.first}) {
        EXPECT_NE(set.error().message.find((folder / name).string()), std::string::npos) << set.error().message;
      }
      EXPECT_EQ(set.error().message.find("settings.xml"), std::string::npos);
      EXPECT_EQ(set.error().message.find("run.out"), std::string::npos);
    }
  }
}

// One rig as COLMAP, Metashape, OpenSfM and nerfstudio give it: the same pinholes at the same places.
TEST(ReadCameras, ProgramsAgree) {
  const TestFolder folder;
  const std::vector<Camera> rig = RigForTest(3, {1, 2, 3});
  WritePicturesOf(rig, folder / "images");
  std::string images, metashape, shots, frames;
  for (const Camera& camera : rig) {
    const auto q = QuaternionFromRotation(camera.world_to_camera.rotation);
    const std::string t = Digits(camera.world_to_camera.translation);
    images += std::to_string(images.size() + 1) + " " + Digits(q) + t + "1 " + camera.name + ".png\n\n";
    metashape += "<camera sensor_id=\"0\" label=\"" + camera.name + "\"><transform>" + Digits(CameraToWorld(camera)) +
                 "</transform></camera>";
    const double s = std::hypot(q[1], q[2], q[3]), a = 2 * std::atan2(s, q[0]) / s;
    const auto listed = [](std::string digits) {
      digits.pop_back();
      std::ranges::replace(digits, ' ', ',');
      return "[" + digits + "]";
    };
    shots += std::string(shots.empty() ? "" : ",") + "\"" + camera.name +
             ".png\": {\"camera\": \"c\", \"rotation\": " + listed(Digits(std::array{a * q[1], a * q[2], a * q[3]})) +
             ", \"translation\": " + listed(t) + "}";
    const auto m = OpenGlCameraToWorld(camera.world_to_camera);
    frames += std::string(frames.empty() ? "" : ",") + "{\"file_path\": \"../images/" + camera.name +
              ".png\", \"transform_matrix\": [";
    for (size_t row = 0; row < 4; ++row) {
      frames +=
          (row > 0 ? "," : "") + listed(Digits(std::array{m[4 * row], m[4 * row + 1], m[4 * row + 2], m[4 * row + 3]}));
    }
    frames += "]}";
  }
  WriteText(folder / "sparse" / "cameras.txt",
            "1 FULL_OPENCV 64 48 70 70 33.5 22.25 -0.1 0.02 0.001 -0.002 0.003 0 0 0\n");
  WriteText(folder / "sparse" / "images.txt", images);
  WriteText(folder / "metashape" / "cameras.xml",
            R"(<document><chunk><sensors><sensor id="0" type="frame"><resolution width="64" height="48"/>
<calibration class="adjusted"><f>70</f><cx>1.5</cx><cy>-1.75</cy><k1>-0.1</k1><k2>0.02</k2><k3>0.003</k3><p1>-0.002</p1>
<p2>0.001</p2></calibration></sensor></sensors><cameras>)" +
                metashape + "</cameras></chunk></document>");
  WriteText(folder / "opensfm" / "reconstruction.json",
            R"([{"cameras": {"c": {"projection_type": "brown", "width": 64, "height": 48, "focal_x": 1.09375,
"focal_y": 1.09375, "c_x": 0.0234375, "c_y": -0.02734375, "k1": -0.1, "k2": 0.02, "k3": 0.003, "p1": 0.001,
"p2": -0.002}}, "shots": {)" +
                shots + "}}]");
  WriteText(folder / "nerfstudio" / "transforms.json",
            R"({"w": 64, "h": 48, "fl_x": 70, "fl_y": 70, "cx": 33.5, "cy": 22.25, "k1": -0.1, "k2": 0.02, "k3": 0.003,
"p1": 0.001, "p2": -0.002, "frames": [)" +
                frames + "]}");
  const auto colmap = ReadCameras(folder / "sparse");
  ASSERT_TRUE(colmap.ok()) << colmap.error().message;
  for (const char* program : {"metashape", "opensfm", "nerfstudio"}) {
    auto set = ReadCameras(folder / program);
    ASSERT_TRUE(set.ok()) << set.error().message;
    ASSERT_EQ(set->cameras.size(), rig.size());
    for (size_t i = 0; i < rig.size(); ++i) {
      const Camera &a = colmap->cameras[i], &b = set->cameras[i];
      EXPECT_EQ(b.image, folder / "images" / (rig[i].name + ".png")) << program;
      EXPECT_EQ(a.intrinsics.width, b.intrinsics.width) << program;
      EXPECT_EQ(a.intrinsics.height, b.intrinsics.height) << program;
      EXPECT_NEAR(a.intrinsics.cx, b.intrinsics.cx, 1e-9) << program;
      EXPECT_NEAR(a.intrinsics.fy, b.intrinsics.fy, 1e-9) << program;
      set->cameras[i].name = a.name;
    }
    ExpectSamePixels(set->cameras, colmap->cameras, {1, 2, 3});
  }
}

// nerfstudio and instant-ngp leave the models that they made a transforms.json from beside it.
TEST(ReadCameras, ModelsBesideTheFileThatWasMadeFromThem) {
  const TestFolder folder;
  for (const char* place : {"colmap/sparse/0", "sparse_txt", "colmap_text"}) {
    std::filesystem::create_directories(folder / place);
    Write(folder / place / "cameras.txt", "1 PINHOLE 8 6 10 10 4 3\n");
    Write(folder / place / "images.txt", "1 1 0 0 0 0 0 0 1 a.png\n\n");
  }
  EXPECT_EQ(ReadCameras(folder.path())->cameras.size(), 1u);
  ASSERT_TRUE(WriteTransforms(folder / "transforms.json", RandomCameras(3, 4)).ok());
  const auto set = ReadCameras(folder.path());
  ASSERT_TRUE(set.ok()) << set.error().message;
  EXPECT_EQ(set->cameras.size(), 3u);
}

// Nothing else tells of masks that were meant and are not found.
TEST(CameraIo, WarnsOfMasksThatAreNotFound) {
  const TestFolder folder;
  Image white(8, 6, 1);
  std::fill(white.pixels.begin(), white.pixels.end(), 1.0f);
  std::filesystem::create_directories(folder / "images");
  std::string frames;
  for (const char* name : {"a", "b", "c"}) {
    ASSERT_TRUE(WritePng(folder / "images" / (std::string(name) + ".png"), white).ok());
    frames += std::string(frames.empty() ? "" : ",") + R"({"file_path": "images/)" + name +
              R"(.png", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]})";
  }
  Write(folder / "transforms.json", R"({"w": 8, "h": 6, "fl_x": 10, "frames": [)" + frames + "]}");
  const auto warnings = [&] {
    const Messages messages;
    EXPECT_TRUE(ReadCameras(folder.path()).ok());
    return messages.warnings();
  };
  EXPECT_TRUE(warnings().empty()) << "there is no sign of masks";
  std::filesystem::create_directories(folder / "Masks");
  ASSERT_TRUE(WritePng(folder / "Masks/other.png", white).ok());
  auto said = warnings();
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NE(said[0].find("no mask for any of the 3 pictures"), std::string::npos) << said[0];
  std::filesystem::create_directories(folder / "masks");
  ASSERT_TRUE(WritePng(folder / "masks/a.png", white).ok());
  ASSERT_TRUE(WritePng(folder / "masks/b.png.png", white).ok());
  said = warnings();
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NE(said[0].find("1 of 3 pictures have no mask"), std::string::npos) << said[0];
  ASSERT_TRUE(WritePng(folder / "masks/c.png", white).ok());
  EXPECT_TRUE(warnings().empty());
}

}  // namespace
}  // namespace anchorsplat
