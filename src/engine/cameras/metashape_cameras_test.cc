#include "cameras/metashape_cameras.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include "cameras/camera_io.h"
#include "cameras/rig_for_test.h"
#include "core/messages_for_test.h"
#include "core/text.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

const char kFrame[] =
    R"(<sensor id="0" label="lens" type="frame"><resolution width="64" height="48"/>
<calibration type="frame" class="initial"><resolution width="64" height="48"/><f>99</f></calibration>
<calibration type="frame" class="adjusted"><resolution width="64" height="48"/><f>70</f><cx>1.5</cx><cy>-1.75</cy>
<k1>-0.1</k1><k2>0.02</k2><k3>0.003</k3><p1>-0.002</p1><p2>0.001</p2></calibration></sensor>)";

std::string CameraElement(const Camera& camera, const std::string& more = "") {
  return Cat("<camera id=\"0\" sensor_id=\"0\" label=\"", camera.name, "\" ", more, "><transform>",
             Digits(CameraToWorld(camera)), "</transform></camera>\n");
}

std::string CameraElements(const std::vector<Camera>& rig, const std::string& more = "") {
  std::string text;
  for (const Camera& camera : rig) text += CameraElement(camera, more);
  return text;
}

std::string Chunk(const std::string& cameras, const std::string& more = "", const std::string& sensor = kFrame) {
  return Cat("<chunk label=\"One\" enabled=\"true\"><sensors next_id=\"1\">", sensor, "</sensors>\n<cameras>", cameras,
             "</cameras>", more, "</chunk>");
}

std::string Document(const std::string& chunks) {
  return Cat("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<document version=\"2.0.0\">\n", chunks, "\n</document>\n");
}

Result<CameraSet> Parse(const std::string& text) { return CamerasFromMetashape("cameras.xml", text, "nowhere"); }

// The lens by the manual's formulas, p1 and p2 being OpenCV's exchanged.
TEST(Metashape, DrawsAPointWhereItsManualSays) {
  const auto rig = RigForTest(3);
  const auto set = Parse(Document(Chunk(CameraElements(rig))));
  ASSERT_TRUE(set.ok()) << set.error().message;
  ExpectSamePixels(set->cameras, rig);
  const auto p = rig[1].ToCamera({0.4, 0.1, -0.2});
  const double x = p[0] / p[2], y = p[1] / p[2], q = x * x + y * y;
  const double s = 1 - 0.1 * q + 0.02 * q * q + 0.003 * q * q * q;
  const double p1 = -0.002, p2 = 0.001;
  const double u = 32 + 1.5 + 70 * (x * s + p1 * (q + 2 * x * x) + 2 * p2 * x * y);
  const double v = 24 - 1.75 + 70 * (y * s + p2 * (q + 2 * y * y) + 2 * p1 * x * y);
  EXPECT_NEAR(PixelOf(set->cameras[1], {0.4, 0.1, -0.2})[0], u, 1e-9);
  EXPECT_NEAR(PixelOf(set->cameras[1], {0.4, 0.1, -0.2})[1], v, 1e-9);
  EXPECT_FALSE(set->cameras[1].intrinsics == set->cameras[1].photograph.intrinsics) << "the pinhole is another";
}

TEST(Metashape, AffinityAndSkew) {
  std::string sensor = kFrame;
  sensor.replace(sensor.find("<k1>"), 0, "<b1>2.5</b1><b2>-0.75</b2>");
  const auto rig = RigForTest(1);
  const auto set = Parse(Document(Chunk(CameraElements(rig), "", sensor)));
  ASSERT_TRUE(set.ok()) << set.error().message;
  const auto p = rig[0].ToCamera({0.4, 0.1, -0.2});
  const PlanePoint place = Distort(rig[0].photograph.lens, {p[0] / p[2], p[1] / p[2]});
  const PlanePoint pixel = PixelOf(set->cameras[0], {0.4, 0.1, -0.2});
  EXPECT_NEAR(pixel[0], 33.5 + 72.5 * place[0] - 0.75 * place[1], 1e-9);
  EXPECT_NEAR(pixel[1], 22.25 + 70 * place[1], 1e-9);
}

TEST(Metashape, FisheyeIsEquidistant) {
  const std::string sensor = R"(<sensor id="0" type="fisheye"><resolution width="64" height="48"/>
<calibration class="adjusted" type="fisheye"><f>30</f><k1>0.05</k1></calibration></sensor>)";
  const auto rig = RigForTest(1);
  const auto set = Parse(Document(Chunk(CameraElements(rig), "", sensor)));
  ASSERT_TRUE(set.ok()) << set.error().message;
  const auto p = rig[0].ToCamera({0.9, 0.1, -0.2});
  const double r = std::hypot(p[0], p[1]), theta = std::atan2(r, p[2]);
  EXPECT_NEAR(PixelOf(set->cameras[0], {0.9, 0.1, -0.2})[0], 32 + 30 * theta * (1 + 0.05 * theta * theta) * p[0] / r,
              1e-9);
}

// A chunk's transform leads to the world, a component's wins; nothing of a place on Earth is lost.
TEST(Metashape, TransformsPlaceTheCamerasInDouble) {
  const std::array<double, 3> target = {-2499366.25, -4256836.5, 4029217.75};
  const auto rig = RigForTest(3, target);
  Similarity placed{{0.36, 0.48, -0.8, -0.8, 0.6, 0, 0.48, 0.64, 0.6}, target, 12.5};
  const auto text_of = [](const Similarity& s) {
    return Cat("<transform><rotation locked=\"true\">", Digits(s.rotation), "</rotation><translation>",
               Digits(s.translation), "</translation><scale>", Digits(std::array{s.scale}), "</scale></transform>");
  };
  std::string local;
  for (Camera camera : rig) {
    camera.world_to_camera = Moved(camera.world_to_camera, Inverse(placed));
    local += CameraElement(camera, "component_id=\"4\"");
  }
  const auto by_chunk = Parse(Document(Chunk(local, text_of(placed))));
  ASSERT_TRUE(by_chunk.ok()) << by_chunk.error().message;
  ExpectSamePixels(by_chunk->cameras, rig, target, 1e-5);
  const auto by_component =
      Parse(Document(Chunk(local, Cat("<components active_id=\"4\"><component id=\"4\" label=\"C\">", text_of(placed),
                                      "</component></components>", text_of({.scale = 7})))));
  ASSERT_TRUE(by_component.ok()) << by_component.error().message;
  ExpectSamePixels(by_component->cameras, rig, target, 1e-5);
  for (size_t i = 0; i < rig.size(); ++i) {
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(by_chunk->cameras[i].Center()[k], rig[i].Center()[k], 1e-7);
  }
  // Rotations of eight digits keep their place.
  const std::string eight = R"(<camera id="1" sensor_id="0" label="n" component_id="4"><transform>
-0.99988146 -0.00872749 0.01268391 1 -0.00842932 0.99969124 0.02337453 2 -0.01288400 0.02326485 -0.99964631 3 0 0 0 1
</transform></camera>)";
  const auto of_eight = Parse(Document(Chunk(eight, text_of(placed))));
  ASSERT_TRUE(of_eight.ok()) << of_eight.error().message;
  const auto expected = placed.Apply({1, 2, 3});
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(of_eight->cameras[0].Center()[k], expected[k], 1e-8);
}

TEST(Metashape, WhatIsLeftOutIsCounted) {
  const auto rig = RigForTest(4);
  const std::string bare = "<camera id=\"9\" sensor_id=\"0\" label=\"bare\"/>";
  const Messages messages;
  auto set = Parse(Document(Chunk(Cat("<group id=\"0\" label=\"G\">", CameraElement(rig[0]), bare, "</group>",
                                      CameraElement(rig[1]), CameraElement(rig[2], "enabled=\"false\"")))));
  ASSERT_TRUE(set.ok()) << set.error().message;
  ExpectSamePixels(set->cameras, {rig[0], rig[1]});
  ASSERT_EQ(messages.warnings().size(), 1u);
  EXPECT_EQ(messages.warnings()[0], "cameras.xml: 1 of 4 cameras skipped: not aligned");
  ASSERT_EQ(messages.notes().size(), 1u);
  EXPECT_NE(messages.notes()[0].find("disabled"), std::string::npos);
  set = Parse(Document(Chunk(CameraElement(rig[3])) + Chunk(CameraElements({rig[0], rig[1]}))));
  ASSERT_TRUE(set.ok()) << set.error().message;
  ExpectSamePixels(set->cameras, {rig[0], rig[1]});
  EXPECT_NE(messages.warnings().back().find("1 cameras of chunk \"One\""), std::string::npos);
  // Components without transforms lie anywhere to each other; with transforms in one world.
  const std::string three =
      CameraElements({rig[0], rig[1]}, "component_id=\"1\"") + CameraElement(rig[2], "component_id=\"0\"");
  set = Parse(Document(Chunk(three)));
  ASSERT_TRUE(set.ok()) << set.error().message;
  ExpectSamePixels(set->cameras, {rig[0], rig[1]});
  EXPECT_NE(messages.warnings().back().find("1 of 3 aligned cameras skipped"), std::string::npos);
  const std::string still = "<transform><scale>1</scale></transform></component>";
  set = Parse(Document(
      Chunk(three, Cat("<components><component id=\"0\">", still, "<component id=\"1\">", still, "</components>"))));
  ASSERT_TRUE(set.ok()) << set.error().message;
  ExpectSamePixels(set->cameras, {rig[0], rig[1], rig[2]});
}

TEST(Metashape, PicturesAreFoundByTheirStem) {
  const TestFolder folder;
  const auto rig = RigForTest(2);
  WritePicturesOf(rig, folder / "images");
  WriteText(folder / "export.xml", Document(Chunk(CameraElements(rig))));
  for (const auto& path : {folder / "export.xml", folder.path()}) {
    const auto set = ReadCameras(path);
    ASSERT_TRUE(set.ok()) << set.error().message;
    ExpectSamePixels(set->cameras, rig);
    EXPECT_EQ(set->cameras[1].image, folder / "images/b.png");
  }
}

TEST(Metashape, MalformedFilesSayWhatIsWrong) {
  const auto rig = RigForTest(1);
  const std::string good = Document(Chunk(CameraElements(rig), "<transform><scale>2</scale></transform>"));
  ASSERT_TRUE(Parse(good).ok());
  const std::pair<std::pair<std::string, std::string>, const char*> cases[] = {
      {{"<f>70</f>", ""}, "no focal length"},
      {{"<f>70</f>", "<fx>70</fx>"}, "PhotoScan before 1.2"},
      {{"<f>70</f>", "<f>0</f>"}, "focal length 0"},
      {{"<f>70</f>", "<f>nan</f>"}, "line 5: <f>: expected a number, found \"nan\""},
      {{"<f>70</f>", "<f>1e999</f>"}, "expected a number"},
      {{"<f>70</f>", "<f>70 71</f>"}, "expected 1 numbers, found more"},
      {{"<f>70</f>", "<f/>"}, "expected 1 numbers, found 0"},
      {{"<k1>-0.1</k1>", "<k1>-50</k1>"}, "k1 = -50"},
      {{"<k1>-0.1</k1>", "<p3>0.1</p3>"}, "p3 = 0.1"},
      {{"type=\"frame\" class=\"adjusted\"", "type=\"spherical\" class=\"adjusted\""}, "type spherical"},
      {{"type=\"frame\" class=\"adjusted\"", "type=\"equisolid_fisheye\" class=\"adjusted\""}, "equisolid_fisheye"},
      {{"type=\"frame\" class=\"adjusted\"", "type=\"fisheye\" class=\"adjusted\""},
       "is not supported for a fisheye lens"},
      {{"class=\"adjusted\"><resolution width=\"64\"", "class=\"adjusted\"><resolution width=\"-64\""},
       "expected a width from 1"},
      {{"class=\"adjusted\"><resolution width=\"64\"", "class=\"adjusted\"><resolution width=\"99999999999\""},
       "found \"99999999999\""},
      {{"sensor_id=\"0\"", "sensor_id=\"5\""}, "sensor \"5\" is not in the list"},
      {{"label=\"a\"", "label=\"\""}, "has no label"},
      {{"label=\"a\"", "enabled=\"0\""}, "none of its 1 cameras is enabled and aligned"},
      {{"<scale>2</scale>", "<scale>0</scale>"}, "scale 0, expected a positive number"},
      {{"<scale>2</scale>", "<rotation>1 0 0 0 1 0 0 0 2</rotation>"}, "<rotation>: camera matrix is not a rotation"},
      {{"<scale>2</scale>", "<rotation>1 0 0 0 1 0 0 0</rotation>"}, "expected 9 numbers, found 8"},
      {{"<scale>2</scale>", "<translation>1 2 x</translation>"}, "found \"x\""},
      {{"<scale>2</scale>", "<scale>1e308</scale><translation>1e308 1e308 1e308</translation>"}, "not finite"},
      {{"0 0 0 1 </transform>", "0 0 1 1 </transform>"}, "last row"},
      {{"0 0 0 1 </transform>", "0 0 0 </transform>"}, "expected 16 numbers"},
      {{"<chunk", "<lump"}, "not XML"},
      {{"</document>", ""}, "not XML"},
  };
  for (const auto& [change, expected] : cases) {
    std::string text = good;
    ASSERT_NE(text.find(change.first), std::string::npos) << change.first;
    text.replace(text.find(change.first), change.first.size(), change.second);
    const auto set = Parse(text);
    ASSERT_FALSE(set.ok()) << change.second;
    EXPECT_EQ(set.error().code, ErrorCode::kBadFile);
    EXPECT_TRUE(set.error().message.starts_with("cameras.xml: ")) << set.error().message;
    EXPECT_NE(set.error().message.find(expected), std::string::npos) << expected << "\n" << set.error().message;
  }
}

TEST(Metashape, BombsAreRefused) {
  const auto rig = RigForTest(1);
  // Entities of a DTD of its own stand for themselves.
  const std::string bomb =
      Cat("<?xml version=\"1.0\"?><!DOCTYPE document [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b "
          "\"&a;&a;&a;&a;&a;&a;\"><!ENTITY f SYSTEM \"file:///etc/passwd\">]>",
          Document(Chunk("<camera sensor_id=\"0\" label=\"&b;&f;\"><transform>" + Digits(CameraToWorld(rig[0])) +
                         "</transform></camera>"))
              .substr(38));
  const auto set = Parse(bomb);
  ASSERT_TRUE(set.ok()) << set.error().message;
  EXPECT_EQ(set->cameras[0].name, "&b;&f;");
  std::string deep;
  for (int i = 0; i < 300000; ++i) deep += "<group>";
  auto refused = Parse(Document(Chunk(deep)));
  EXPECT_FALSE(refused.ok());
  std::string closed = deep.substr(0, size_t{7} * 100000) + CameraElement(rig[0]);
  for (int i = 0; i < 100000; ++i) closed += "</group>";
  refused = Parse(Document(Chunk(closed)));
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("nested deeper than 64"), std::string::npos) << refused.error().message;
  std::string many = "<document><chunk>";
  many.reserve(size_t{36} << 20);
  while (many.size() < (size_t{34} << 20)) many += "<a/>";
  refused = Parse(many);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("elements and attributes"), std::string::npos) << refused.error().message;
}

}  // namespace
}  // namespace anchorsplat
