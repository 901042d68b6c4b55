#include "cameras/opensfm_cameras.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include "cameras/camera_io.h"
#include "cameras/parse_cameras.h"
#include "cameras/rig_for_test.h"
#include "core/messages_for_test.h"
#include "core/rotation.h"
#include "core/text.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

std::string List(const std::vector<double>& numbers) {
  std::string text = Digits(numbers);
  text.pop_back();
  for (char& c : text) c = c == ' ' ? ',' : c;
  return "[" + text + "]";
}

std::string Shot(const Camera& camera) {
  const auto q = QuaternionFromRotation(camera.world_to_camera.rotation);
  const double s = std::hypot(q[1], q[2], q[3]), angle = 2 * std::atan2(s, q[0]);
  const auto& t = camera.world_to_camera.translation;
  return Cat("\"", camera.name,
             ".png\": {\"camera\": \"c\", \"rotation\": ", List({angle * q[1] / s, angle * q[2] / s, angle * q[3] / s}),
             ", \"translation\": ", List({t[0], t[1], t[2]}), "}");
}

std::string Shots(const std::vector<Camera>& rig) {
  std::string text;
  for (const Camera& camera : rig) text += Cat(text.empty() ? "" : ",\n", Shot(camera));
  return text;
}

const char kBrown[] =
    R"({"projection_type": "brown", "width": 64, "height": 48, "focal_x": 1.09375, "focal_y": 1.09375, "c_x": 0.0234375,
"c_y": -0.02734375, "k1": -0.1, "k2": 0.02, "k3": 0.003, "p1": 0.001, "p2": -0.002})";

std::string Reconstruction(const std::vector<Camera>& rig, const std::string& camera = kBrown,
                           const std::string& more = "") {
  return Cat("{\"cameras\": {\"c\": ", camera, "}, ", more, "\"shots\": {", Shots(rig), "}, \"points\": {}}");
}

TEST(OpenSfm, DrawsAPointWhereItsFormulasSay) {
  const auto rig = RigForTest(3);
  const auto set = ParseCameras("reconstruction.json", "[" + Reconstruction(rig) + "]");
  ASSERT_TRUE(set.ok()) << set.error().message;
  ExpectSamePixels(set->cameras, rig);
}

// Focal lengths and principal points in the longer side, which may be the height; the middle is half of each side.
TEST(OpenSfm, LensesAndUprightPictures) {
  const auto rig = RigForTest(1);
  const auto p = rig[0].ToCamera({0.3, 0.2, -0.1});
  const double x = p[0] / p[2], y = p[1] / p[2], r = std::hypot(x, y), theta = std::atan(r);
  const auto pixel = [&](const std::string& camera) {
    const auto set = ParseCameras("r.json", "[" + Reconstruction(rig, camera) + "]");
    EXPECT_TRUE(set.ok()) << camera << set.error().message;
    return PixelOf(set->cameras.at(0), {0.3, 0.2, -0.1});
  };
  const std::string size = "\"width\": 48, \"height\": 64, ";
  PlanePoint found = pixel("{" + size + "\"focal\": 0.9, \"k1\": 0.1, \"k2\": 0.2}");
  double s = 64 * 0.9 * (1 + 0.1 * r * r + 0.2 * r * r * r * r);
  EXPECT_NEAR(found[0], 24 + s * x, 1e-9);
  EXPECT_NEAR(found[1], 32 + s * y, 1e-9);
  found = pixel("{" + size + "\"projection_type\": \"fisheye\", \"focal\": 0.5, \"k1\": 0.1, \"k2\": 0.02}");
  s = 32 * theta * (1 + 0.1 * theta * theta + 0.02 * std::pow(theta, 4)) / r;
  EXPECT_NEAR(found[0], 24 + s * x, 1e-9);
  found = pixel("{" + size +
                R"("projection_type": "fisheye_opencv", "focal_x": 0.5, "focal_y": 0.4, "c_x": 0.125, "k3": 0.1})");
  s = theta * (1 + 0.1 * std::pow(theta, 6)) / r;
  EXPECT_NEAR(found[0], 24 + 8 + 32 * s * x, 1e-9);
  EXPECT_NEAR(found[1], 32 + 25.6 * s * y, 1e-9);
  found =
      pixel("{" + size + R"("projection_type": "simple_radial", "focal_x": 0.9, "focal_y": 0.8, "k1": 0.1, "k2": 9})");
  EXPECT_NEAR(found[1], 32 + 51.2 * (1 + 0.1 * r * r) * y, 1e-9);
  found = pixel("{" + size + R"("projection_type": "radial", "focal_x": 0.9, "focal_y": 0.8, "k1": 0.1, "k2": 0.2})");
  EXPECT_NEAR(found[1], 32 + 51.2 * (1 + 0.1 * r * r + 0.2 * r * r * r * r) * y, 1e-9);
}

TEST(OpenSfm, LargestReconstructionAndWhatElseIsThere) {
  const auto rig = RigForTest(4);
  const Messages messages;
  const std::string text =
      "[" + Reconstruction({rig[3]}) + ",\n" +
      Reconstruction({rig[0], rig[1], rig[2]}, kBrown,
                     R"("reference_lla": {"latitude": 50.1, "longitude": 8.25, "altitude": 100}, )") +
      "]";
  const auto set = ParseCameras("r.json", text);
  ASSERT_TRUE(set.ok()) << set.error().message;
  ExpectSamePixels(set->cameras, {rig[0], rig[1], rig[2]});
  ASSERT_EQ(messages.warnings().size(), 1u);
  EXPECT_NE(messages.warnings()[0].find("skipped 1 shots (1 of number 0)"), std::string::npos)
      << messages.warnings()[0];
  ASSERT_EQ(messages.notes().size(), 1u);
  EXPECT_NE(messages.notes()[0].find("latitude 50.1, longitude 8.25"), std::string::npos) << messages.notes()[0];
}

TEST(OpenSfm, ProjectsOfOpenDroneMap) {
  const TestFolder folder;
  const auto rig = RigForTest(2, {4.5e6, 100, -4.5e6});
  WritePicturesOf(rig, folder / "images");
  WriteText(folder / "opensfm" / "reconstruction.json", "[" + Reconstruction(rig) + "]");
  WriteText(folder / "cameras.json", Cat("{\"c\": ", kBrown, "}"));  // the lenses, which OpenDroneMap has there, too
  for (const auto& path : {folder.path(), folder / "opensfm", folder / "opensfm/reconstruction.json"}) {
    const auto set = ReadCameras(path);
    ASSERT_TRUE(set.ok()) << set.error().message;
    ExpectSamePixels(set->cameras, rig, {4.5e6, 100, -4.5e6}, 1e-6);
    EXPECT_EQ(set->cameras[0].image, folder / "images/a.png");
  }
}

TEST(OpenSfm, MalformedFilesSayWhatIsWrong) {
  const std::string good = "[" + Reconstruction(RigForTest(1)) + "]";
  const std::pair<std::pair<std::string, std::string>, const char*> cases[] = {
      {{"\"brown\"", "\"spherical\""}, "[0].cameras.c: projection_type spherical"},
      {{"\"brown\"", "\"fisheye624\""}, "fisheye624"},
      {{"\"brown\"", "3"}, "projection_type: expected a string"},
      {{"\"width\": 64, ", ""}, "\"width\" is missing"},
      {{"\"width\": 64", "\"width\": 6.4"}, "width: expected a whole number"},
      {{"\"width\": 64", "\"width\": 1e15"}, "width: expected a whole number"},
      {{"\"focal_x\": 1.09375, ", ""}, "\"focal_x\" is missing"},
      {{"\"focal_x\": 1.09375", "\"focal_x\": -1"}, "focal length -64"},
      {{"\"k1\": -0.1", "\"k1\": \"x\""}, "k1: expected a number"},
      {{"\"k1\": -0.1", "\"k1\": -50"}, "lens distortion (k1 = -50"},
      {{"\"camera\": \"c\"", "\"camera\": \"d\""}, "camera \"d\" is not in the list"},
      {{"\"camera\": \"c\", ", ""}, "\"camera\" is missing"},
      {{"\"rotation\": [", "\"rotation\": [1, "}, "rotation: expected 3 numbers, found 4"},
      {{"\"rotation\": [", "\"rotation\": [1.7e308, 1.7e308, 1.7e308], \"r\": ["}, "rotation: is not finite"},
      {{"\"translation\"", "\"t\""}, "\"translation\" is missing"},
      {{"a.png", ""}, "without a picture name"},
      {{"\"cameras\"", "\"lenses\""}, "\"cameras\" is missing"},
  };
  for (const auto& [change, expected] : cases) {
    std::string text = good;
    ASSERT_NE(text.find(change.first), std::string::npos) << change.first;
    text.replace(text.find(change.first), change.first.size(), change.second);
    const auto set = ParseCameras("r.json", text);
    ASSERT_FALSE(set.ok()) << change.second;
    EXPECT_EQ(set.error().code, ErrorCode::kBadFile);
    EXPECT_NE(set.error().message.find(expected), std::string::npos) << expected << "\n" << set.error().message;
  }
  for (const char* text : {R"([{"shots": {}}])", R"([{"shots": 3}])", R"([{"shots": {}, "cameras": {}}, 7])"}) {
    EXPECT_FALSE(ParseCameras("r.json", text).ok()) << text;
  }
}

}  // namespace
}  // namespace anchorsplat
