#include "cameras/nerfstudio_frame.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "cameras/camera_io.h"
#include "cameras/rig_for_test.h"
#include "core/messages_for_test.h"
#include "core/rotation.h"
#include "core/text.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

std::string Rows(const std::array<double, 9>& r, const std::array<double, 3>& t) {
  std::string text = "[";
  for (size_t i = 0; i < 3; ++i) {
    std::string row = Digits(std::array{r[3 * i], r[3 * i + 1], r[3 * i + 2], t[i]});
    row.pop_back();
    for (char& c : row) c = c == ' ' ? ',' : c;
    text += Cat(i == 0 ? "[" : ", [", row, "]");
  }
  return text + "]";
}

std::string Transforms(const std::vector<Camera>& rig, const std::string& more = "") {
  std::string frames;
  for (const Camera& camera : rig) {
    const auto m = OpenGlCameraToWorld(camera.world_to_camera);
    frames += Cat(frames.empty() ? "" : ",", "{\"file_path\": \"images/", camera.name, ".png\", \"transform_matrix\": ",
                  Rows({m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]}, {m[3], m[7], m[11]}), "}");
  }
  return Cat(R"({"w": 64, "h": 48, "fl_x": 70, "fl_y": 70, "cx": 33.5, "cy": 22.25, "k1": -0.1, "k2": 0.02, "k3": 0.003,
"p1": 0.001, "p2": -0.002, )",
             more, "\"frames\": [", frames, "]}");
}

const std::array<double, 9> kTurn = {0.36, 0.48, -0.8, -0.8, 0.6, 0, 0.48, 0.64, 0.6};
const std::array<double, 3> kShift = {1, -2, 0.5};
constexpr double kScale = 0.25;

std::string Frame() { return Cat("{\"transform\": ", Rows(kTurn, kShift), ", \"scale\": ", kScale, "}"); }

// Where nerfstudio has a point of the original world: transform first, then the scale over all of it.
std::array<double, 3> Trained(const std::array<double, 3>& p) {
  std::array<double, 3> q{};
  for (size_t i = 0; i < 3; ++i) {
    q[i] = kScale * (kTurn[3 * i] * p[0] + kTurn[3 * i + 1] * p[1] + kTurn[3 * i + 2] * p[2] + kShift[i]);
  }
  return q;
}

// A point that training moved is where the cameras that training moved saw it.
void ExpectTrained(const Result<CameraSet>& set, const std::vector<Camera>& rig) {
  ASSERT_TRUE(set.ok()) << set.error().message;
  ASSERT_EQ(set->cameras.size(), rig.size());
  ASSERT_TRUE(set->moved.has_value());
  for (size_t i = 0; i < rig.size(); ++i) {
    for (const std::array<double, 3>& p : {std::array<double, 3>{0.1, 0.2, 0.3}, {-0.3, 0.2, -0.1}}) {
      const PlanePoint found = PixelOf(set->cameras[i], Trained(p)), expected = PixelOf(rig[i], p);
      EXPECT_NEAR(found[0], expected[0], 1e-9);
      EXPECT_NEAR(found[1], expected[1], 1e-9);
    }
    const auto center = set->cameras[i].Center(), there = Trained(rig[i].Center());
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(center[k], there[k], 1e-12);
  }
}

// The rig as a transforms.json has it that ns-process-data made: moved by its applied_transform.
const std::array<double, 9> kOfColmap = {0, 1, 0, 1, 0, 0, 0, 0, -1};
std::vector<Camera> Applied(std::vector<Camera> rig, const std::array<double, 9>& rotation,
                            const std::array<double, 3>& shift) {
  for (Camera& camera : rig) camera.world_to_camera = Moved(camera.world_to_camera, {rotation, shift, 1});
  return rig;
}

TEST(NerfstudioFrame, LiesBesideTheCameras) {
  const TestFolder folder;
  const auto rig = RigForTest(3);
  WriteText(folder / "transforms.json", Transforms(rig));
  const auto still = ReadCameras(folder.path());
  ASSERT_TRUE(still.ok()) << still.error().message;
  EXPECT_FALSE(still->moved.has_value());
  WriteText(folder / kNerfstudioFrame, Frame());
  for (const auto& path : {folder.path(), folder / "transforms.json", folder / kNerfstudioFrame}) {
    const Messages messages;
    ExpectTrained(ReadCameras(path), rig);
    ASSERT_EQ(messages.notes().size(), 1u);
    EXPECT_NE(messages.notes()[0].find("nerfstudio's training coordinates (scale 0.25)"), std::string::npos)
        << messages.notes()[0];
  }
}

TEST(NerfstudioFrame, IsOfTheOriginalWorld) {
  const TestFolder folder;
  const auto rig = RigForTest(3);
  WriteText(folder / kNerfstudioFrame, Frame());
  const std::array<double, 9> other = {0, 0, 1, 1, 0, 0, 0, 1, 0};
  WriteText(folder / "transforms.json",
            Transforms(Applied(rig, other, {3, 4, 5}),
                       "\"applied_scale\": 1, \"applied_transform\": " + Rows(other, {3, 4, 5}) + ", "));
  ExpectTrained(ReadCameras(folder.path()), rig);
  // Older files do not say it, and nerfstudio takes it for what its COLMAP converter did.
  WriteText(folder / "transforms.json", Transforms(Applied(rig, kOfColmap, {0, 0, 0})));
  std::filesystem::create_directories(folder / "colmap" / "sparse" / "0");
  ExpectTrained(ReadCameras(folder / "transforms.json"), rig);
  // COLMAP's own world is the original one.
  const TestFolder project;
  WriteText(project / kNerfstudioFrame, Frame());
  const auto model = project.path() / "sparse" / "0";
  WriteText(model / "cameras.txt", "1 FULL_OPENCV 64 48 70 70 33.5 22.25 -0.1 0.02 0.001 -0.002 0.003 0 0 0\n");
  std::string images;
  for (size_t i = 0; i < rig.size(); ++i) {
    images += Cat(i + 1, " ", Digits(QuaternionFromRotation(rig[i].world_to_camera.rotation)),
                  Digits(rig[i].world_to_camera.translation), "1 ", rig[i].name, ".png\n\n");
  }
  WriteText(model / "images.txt", images);
  for (const auto& path : {project.path(), model, model / "images.txt"}) ExpectTrained(ReadCameras(path), rig);
}

TEST(NerfstudioFrame, FolderOfARunNamesItsData) {
  const TestFolder folder;
  const auto rig = RigForTest(2);
  WriteText(folder.path() / "data" / "poster" / "transforms.json", Transforms(rig));
  const auto run = folder.path() / "outputs" / "poster" / "splatfacto" / "2024-05-01_120000";
  WriteText(run / kNerfstudioFrame, Frame());
  const auto refused = [&](const std::string& words) {
    const auto set = ReadCameras(run);
    ASSERT_FALSE(set.ok());
    EXPECT_EQ(set.error().code, ErrorCode::kNotFound);
    EXPECT_NE(set.error().message.find(words), std::string::npos) << set.error().message;
    EXPECT_NE(set.error().message.find("next to the transforms.json"), std::string::npos) << set.error().message;
  };
  refused("without a config.yml");
  const auto config = [&](const std::string& parts) {
    WriteText(run / "config.yml",
              "!!python/object:nerfstudio.engine.trainer.TrainerConfig\n_target: !!python/name:x ''\n"
              "data: &id003 !!python/object/apply:pathlib.PosixPath\n" +
                  parts + "experiment_name: poster\npipeline:\n  data: *id003\n");
  };
  config("");
  refused("does not say where");
  config("- data\n- vase\n");
  refused("data/vase, which does not exist");
  config("- data\n- 'poster'\n");
  for (const auto& path : {run, run / kNerfstudioFrame}) ExpectTrained(ReadCameras(path), rig);
  config("- data\n- poster\n- transforms.json\n");
  ExpectTrained(ReadCameras(run), rig);
  WriteText(run / "config.yml",
            "data: null\npipeline:\n  data: !!python/object/apply:pathlib.PosixPath []\n  dataparser:\n"
            "    data: !!python/object/apply:pathlib.WindowsPath\n    - data\n    - poster\n    scale: 1\n");
  ExpectTrained(ReadCameras(run), rig);
  std::string absolute = "- /\n";
  for (const auto& part : (folder.path() / "data" / "poster").relative_path()) absolute += "- " + part.string() + "\n";
  config(absolute);
  ExpectTrained(ReadCameras(run), rig);
}

TEST(NerfstudioFrame, BadOnesSayWhatIsWrong) {
  const TestFolder folder;
  const auto refused = [&](const std::string& frame, const char* expected) {
    WriteText(folder / kNerfstudioFrame, frame);
    const auto set = ReadCameras(folder.path());
    ASSERT_FALSE(set.ok()) << frame;
    EXPECT_EQ(set.error().code, ErrorCode::kBadFile) << set.error().message;
    EXPECT_NE(set.error().message.find(expected), std::string::npos) << set.error().message;
  };
  WriteText(folder / "transforms.json", Transforms(RigForTest(1)));
  refused("{}", "\"transform\" is missing");
  refused("{", "line 1");
  refused("{\"transform\": " + Rows(kTurn, kShift) + "}", "\"scale\" is missing");
  refused("{\"scale\": 0, \"transform\": " + Rows(kTurn, kShift) + "}", "scale: expected a positive number");
  refused("{\"scale\": -1, \"transform\": " + Rows(kTurn, kShift) + "}", "scale: expected a positive number");
  refused("{\"scale\": 1, \"transform\": [[1,0,0,0],[0,1,0,0]]}", "transform: expected 3 rows, found 2");
  refused("{\"scale\": 1, \"transform\": [[2,0,0,0],[0,1,0,0],[0,0,1,0]]}",
          "transform: camera matrix is not a rotation");
  refused("{\"scale\": 1e308, \"transform\": [[1,0,0,1e308],[0,1,0,0],[0,0,1,0]]}", "its position overflows");
  WriteText(folder / "transforms.json", Transforms(RigForTest(1), "\"applied_transform\": [[1, 2]], "));
  refused(Frame(), "applied_transform: expected 3 rows");
  // What nerfstudio does not train with is not moved by it.
  std::filesystem::remove(folder / "transforms.json");
  WriteText(folder / "cameras.xml", "<document><chunk/></document>");
  refused(Frame(), "applies only to a transforms.json");
}

}  // namespace
}  // namespace anchorsplat
