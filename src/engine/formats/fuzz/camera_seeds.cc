#include "core/text.h"
#include "formats/fuzz/binary.h"
#include "formats/fuzz/seeds.h"

namespace anchorsplat {

namespace {

constexpr char kMatrix[] = "[[1,0,0,0.5],[0,1,0,-2],[0,0,1,3],[0,0,0,1]]";

}  // namespace

std::vector<std::string> TransformsSeeds() {
  return {
      Cat(R"({"camera_angle_x": 0.7, "w": 40, "h": 30, "background": [0, 0.5, 1],)", "\n",
          R"("frames": [{"file_path": "a", "transform_matrix": )", kMatrix, "},\n",
          R"({"file_path": "b/c.png", "transform_matrix": )", kMatrix, "}]}\n"),
      Cat(R"({"fl_x": 50.5, "fl_y": 49, "cx": 20, "cy": 15, "w": 40, "h": 30, "camera_model": "OPENCV", "k1": 0.1,)",
          "\n", R"("frames": [{"file_path": "a", "fl_x": 10, "transform_matrix": )", kMatrix, "}]}\n")};
}

std::vector<std::string> InriaCamerasSeeds() {
  const char* camera =
      R"({"id": 0, "img_name": "a", "width": 40, "height": 30, "position": [1, 2, 3.5],
"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "fy": 50.25, "fx": 51})";
  return {Cat("[", camera, "]\n"), Cat("[", camera, ",\n", camera, "]\n")};
}

std::vector<std::string> MetashapeSeeds() {
  const std::string sensors =
      R"(<sensors><sensor id="0" type="frame"><resolution width="40" height="30"/><calibration type="frame" class="adjusted">
<resolution width="40" height="30"/><f>50</f><cx>1</cx><b1>0.5</b1><b2>-0.25</b2><k1>-0.1</k1><p1>0.001</p1></calibration>
</sensor><sensor id="1" type="fisheye"><resolution width="40" height="30"/><calibration><f>20</f><k1>0.1</k1></calibration>
</sensor></sensors>)";
  const std::string pose = "<transform>0 0 1 3 1 0 0 2 0 1 0 1 0 0 0 1</transform></camera>";
  const std::string transform =
      "<transform><rotation>1 0 0 0 1 0 0 0 1</rotation><translation>4500000 1 2</translation><scale>12.5</scale>"
      "</transform>";
  return {Cat("<?xml version=\"1.0\"?>\n<document version=\"2.0.0\"><chunk label=\"c\">", sensors,
              "<components><component id=\"0\">", transform, "</component></components><cameras>",
              R"(<camera id="0" sensor_id="0" component_id="0" label="a.png">)", pose,
              R"(<camera id="1" sensor_id="1" label="b"/></cameras></chunk></document>)"),
          Cat("<document><chunk>", sensors, "<cameras><group>", R"(<camera sensor_id="1" label="&lt;&#65;">)", pose,
              "</group></cameras>", transform, "</chunk><chunk/></document>")};
}

std::vector<std::string_view> XmlWords() {
  return {"<camera",    "</camera>", "<chunk>", "<group>",   "<sensor ", "<transform>", "type=\"spherical\"",
          "fisheye",    "adjusted",  "<f>",     "<b2>",      "<scale>",  "1e308",       "nan",
          "&#0;",       "<![CDATA[", "<!--",    "<!DOCTYPE", "<?",       "]]>",         "/>",
          "label=\"\"", "id=\"0\""};
}

std::vector<std::string> OpenSfmSeeds() {
  const char* shots =
      R"("shots": {"a.png": {"camera": "c", "rotation": [0.1, 0.2, 3.1], "translation": [1, 2, 3.5]}}, "points": {}})";
  return {Cat(R"([{"cameras": {"c": {"projection_type": "perspective", "width": 40, "height": 30, "focal": 0.8,)",
              R"("k1": -0.1, "k2": 0}}, "reference_lla": {"latitude": 1.5, "longitude": 2, "altitude": 3}, )", shots,
              R"(, {"cameras": {}, "shots": {}}])"),
          Cat(R"([{"cameras": {"c": {"projection_type": "brown", "width": 40, "height": 30, "focal_x": 0.8,)",
              R"("focal_y": 0.75, "c_x": 0.01, "c_y": 0, "k1": -0.1, "k2": 0, "k3": 0, "p1": 0.001, "p2": 0}}, )",
              shots, "]")};
}

std::string BundlerSeed() {
  return "# Bundle file v0.3\n2 1\n50 -0.1 0.01\n1 0 0\n0 0 1\n0 -1 0\n1 2 -3\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n"
         "1 2 3\n255 0 0\n1 0 17 3.5 -2.25\n";
}

std::string NerfstudioFrameSeed() {
  return R"({"transform": [[0, 1, 0, 0.5], [1, 0, 0, -2], [0, 0, -1, 3]], "scale": 0.25})";
}

std::vector<std::string_view> JsonWords() {
  return {"[",
          "]",
          "{",
          "}",
          ",",
          "null",
          "true",
          "\"",
          "frames",
          "file_path",
          "w",
          "h",
          "[[[[[[[[[[",
          "transform_matrix",
          "rotation",
          "matrix",
          "translation",
          "scenes",
          "colorSpace",
          "lin_rec709_display",
          "k1",
          "fl_x",
          "camera_angle_x",
          "cx",
          "id",
          "rotation",
          "position",
          "\\u0000",
          "img_name",
          "width",
          "fx",
          "{\"a\":{\"a\":{\"a\":"};
}

ColmapSeeds ColmapBinarySeeds() {
  Binary cameras(false), images(false);
  cameras.Put(uint64_t{2});
  for (uint32_t id : {7u, 9u}) {
    cameras.Put(id);
    cameras.Put(id == 7 ? 1 : 0);  // PINHOLE, SIMPLE_PINHOLE
    cameras.Put(uint64_t{40});
    cameras.Put(uint64_t{30});
    for (int k = id == 7 ? 0 : 1; k < 4; ++k) cameras.Put(20.5 + k);
  }
  images.Put(uint64_t{2});
  for (uint32_t id : {7u, 9u}) {
    images.Put(id);
    for (const double x : {1.0, 0.0, 0.0, 0.0, 0.5, -1.0, 2.0}) images.Put(x);
    images.Put(id);
    images.Text(std::string_view("view.png", 9));  // with the zero that ends it
    images.Put(uint64_t{2});
    for (int k = 0; k < 2; ++k) {
      images.Put(1.5);
      images.Put(2.5);
      images.Put(~uint64_t{0});
    }
  }
  Binary points(false);
  points.Put(uint64_t{2});
  for (const uint64_t id : {3, 4}) {
    points.Put(id);
    for (const double x : {0.5, -1.0, 2.0}) points.Put(x);
    points.Text("\x01\x80\xff");
    points.Put(0.25);
    points.Put(uint64_t{2});
    for (int k = 0; k < 4; ++k) points.Put(uint32_t{7});
  }
  return {cameras.bytes(), images.bytes(), points.bytes()};
}

std::string PosesBoundsSeed() {
  std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 17), }";
  header.resize(117, ' ');
  header += '\n';
  std::string bytes("\x93NUMPY\x01\0\x76\0", 10);
  bytes += header;
  for (const double value : {0., 0., -1., 1., 30., 0., -1., 0., 2., 40., -1., 0., 0., 3., 50., 0.5, 9.}) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  return bytes;
}

ColmapSeeds ColmapTextSeeds() {
  return {"# Camera list\n7 PINHOLE 40 30 50 60 21 14\n9 OPENCV 40 30 50 50 21 14 -0.1 0.01 0.001 0\n",
          "# Image list\n1 1 0 0 0 0.5 -1 2 7 a.png\n1.5 2.5 -1 3 4 12\n2 0.6 0 0 -0.8 0.5 -1 2 9 b c.png\n\n",
          "# Points\n3 0.5 -1 2 1 128 255 0.25 7 7 7 7\n4 0.5 -1 2 1 128 255 0.25\n"};
}

}  // namespace anchorsplat
