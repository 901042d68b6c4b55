#include "cameras/colmap_model.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "cameras/camera_io.h"
#include "cameras/colmap_writer.h"
#include "core/messages_for_test.h"
#include "images/image_io.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

void Write(const std::filesystem::path& path, const std::string& bytes) {
  std::filesystem::create_directories(path.parent_path());
  std::filesystem::remove(path);  // some file systems flush a file that is emptied and written again
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

// Little-endian records, as COLMAP writes them.
struct Bytes : std::string {
  Bytes& U32(uint32_t x) { return Integer(x, 4); }
  Bytes& U64(uint64_t x) { return Integer(x, 8); }
  Bytes& F64(double x) { return Integer(std::bit_cast<uint64_t>(x), 8); }
  Bytes& Integer(uint64_t x, int bytes) {
    for (int i = 0; i < bytes; ++i) push_back(static_cast<char>(x >> (8 * i)));
    return *this;
  }
  Bytes& Name(const std::string& name) {
    append(name.c_str(), name.size() + 1);
    return *this;
  }
};

struct View {
  std::string name = "a.png";
  std::vector<double> pose = {1, 0, 0, 0, 0.5, -1, 2};  // qw qx qy qz tx ty tz
  uint32_t camera = 7;
  uint64_t points = 0;
};

std::string CamerasBin(uint32_t model, uint64_t width, uint64_t height, const std::vector<double>& params) {
  Bytes bytes;
  bytes.U64(1).U32(7).U32(model).U64(width).U64(height);
  for (const double p : params) bytes.F64(p);
  return bytes;
}

std::string ImagesBin(const std::vector<View>& views) {
  Bytes bytes;
  bytes.U64(views.size());
  uint32_t id = 0;
  for (const View& view : views) {
    bytes.U32(++id);
    for (const double x : view.pose) bytes.F64(x);
    bytes.U32(view.camera).Name(view.name).U64(view.points);
    for (uint64_t k = 0; k < view.points; ++k) bytes.F64(1.5).F64(2.5).U64(~uint64_t{0});
  }
  return bytes;
}

const std::string kPinhole = CamerasBin(1, 40, 30, {50, 60, 21, 14});

Result<CameraSet> ReadBinary(const TestFolder& folder, const std::string& cameras, const std::string& images) {
  Write(folder / "cameras.bin", cameras);
  Write(folder / "images.bin", images);
  return ReadCameras(folder.path());
}

Result<CameraSet> ReadText(const TestFolder& folder, const std::string& cameras, const std::string& images) {
  Write(folder / "cameras.txt", cameras);
  Write(folder / "images.txt", images);
  return ReadCameras(folder.path());
}

TEST(Colmap, BinaryAndTextAreTheSameModel) {
  const double h = std::sqrt(0.5);
  const TestFolder binary_folder, text_folder;
  const auto binary = ReadBinary(binary_folder, kPinhole,
                                 ImagesBin({{"b/x 1.jpg", {h, 0, h, 0, 1, 2, 3}, 7, 2}, {"a.png"}, {"a.png"}}));
  const auto text =
      ReadText(text_folder, "# comment\n7 PINHOLE 40 30 50 60 21 14\n",
               "# two lines per image\n\n1 0.70710678118654757 0 0.70710678118654757 0 1 2 3 7 b/x 1.jpg\r\n"
               "1.5 2.5 -1 1.5 2.5 -1\n2 1 0 0 0 0.5 -1 2 7 a.png\n\n3 1 0 0 0 0.5 -1 2 7 a.png");
  ASSERT_TRUE(binary.ok()) << binary.error().message;
  ASSERT_TRUE(text.ok()) << text.error().message;
  for (const CameraSet* set : {&*binary, &*text}) {
    ASSERT_EQ(set->cameras.size(), 3u);
    const Camera& camera = set->cameras[0];
    EXPECT_EQ(camera.name, "b/x 1");
    EXPECT_EQ(camera.intrinsics.width, 40);
    EXPECT_EQ(camera.intrinsics.height, 30);
    EXPECT_EQ(camera.intrinsics.fx, 50);
    EXPECT_EQ(camera.intrinsics.fy, 60);
    EXPECT_EQ(camera.intrinsics.cx, 21);
    EXPECT_EQ(camera.intrinsics.cy, 14);
    // A quarter turn about y takes the world's x to the camera's −z.
    const auto p = camera.ToCamera({1, 0, 0});
    EXPECT_NEAR(p[0], 1, 1e-12);
    EXPECT_NEAR(p[1], 2, 1e-12);
    EXPECT_NEAR(p[2], 2, 1e-12);
    EXPECT_EQ(set->cameras[1].name, "a");
    EXPECT_EQ(set->cameras[2].name, "a");  // repeated names are the caller's business
  }
}

TEST(Colmap, StraightModelsArePinholes) {
  const std::pair<uint32_t, std::vector<double>> models[] = {
      {0, {50, 21, 14}},
      {1, {50, 50, 21, 14}},
      {2, {50, 21, 14, 0}},
      {3, {50, 21, 14, 0, 0}},
      {4, {50, 50, 21, 14, 0, 0, 0, -0.0}},
      {6, {50, 50, 21, 14, 0, 0, 0, 0, 0, 0, 0, 0}},
      {7, {50, 50, 21, 14, 0}},
  };
  for (const auto& [model, params] : models) {
    const TestFolder folder;
    const auto set = ReadBinary(folder, CamerasBin(model, 40, 30, params), ImagesBin({{}}));
    ASSERT_TRUE(set.ok()) << model << ": " << set.error().message;
    const Pinhole& c = set->cameras[0].intrinsics;
    EXPECT_EQ(c.fx, 50) << model;
    EXPECT_EQ(c.fy, 50) << model;
    EXPECT_EQ(c.cx, 21) << model;
    EXPECT_EQ(c.cy, 14) << model;
  }
}

// Parameters go where COLMAP's models have them.
TEST(Colmap, LensesAreRead) {
  const Lens radial{.model = LensModel::kRadial}, fisheye{.model = LensModel::kFisheye};
  const auto lens = [](Lens l, std::array<double, 4> k, std::array<double, 2> p, std::array<double, 3> d) {
    l.radial = k, l.tangential = p, l.denominator = d;
    return l;
  };
  const std::tuple<const char*, const char*, Lens> models[] = {
      {"SIMPLE_RADIAL", "50 21 14 0.01", lens(radial, {0.01}, {}, {})},
      {"RADIAL", "50 21 14 0.01 -0.02", lens(radial, {0.01, -0.02}, {}, {})},
      {"OPENCV", "50 60 21 14 0.01 0.02 0.003 -0.004", lens(radial, {0.01, 0.02}, {0.003, -0.004}, {})},
      {"FULL_OPENCV", "50 60 21 14 .01 .02 .003 .004 .05 .06 .07 .08",
       lens(radial, {0.01, 0.02, 0.05}, {0.003, 0.004}, {0.06, 0.07, 0.08})},
      {"OPENCV_FISHEYE", "50 60 21 14 0.01 0.02 0.03 0.04", lens(fisheye, {0.01, 0.02, 0.03, 0.04}, {}, {})},
      {"SIMPLE_RADIAL_FISHEYE", "50 21 14 0.01", lens(fisheye, {0.01}, {}, {})},
      {"RADIAL_FISHEYE", "50 21 14 0 0", fisheye},
  };
  for (const auto& [model, params, expected] : models) {
    const TestFolder folder;
    const auto set = ReadText(folder, std::string("7 ") + model + " 40 30 " + params, "1 1 0 0 0 0 0 0 7 a.png\n\n");
    ASSERT_TRUE(set.ok()) << set.error().message;
    const Camera& camera = set->cameras[0];
    EXPECT_EQ(camera.photograph.lens, expected) << model;
    const Pinhole& distorted = camera.photograph.intrinsics;
    EXPECT_EQ(distorted.width, 40);
    EXPECT_EQ(distorted.cx, 21);
    EXPECT_EQ(camera.intrinsics.fx, distorted.fx) << "the pinhole keeps the focal length";
  }
}

TEST(Colmap, UnknownLensesAreRefusedByName) {
  const std::pair<const char*, const char*> models[] = {
      {"FOV", "50 50 21 14 0.9"},
      {"THIN_PRISM_FISHEYE", "50 50 21 14 0 0 0 0 0 0 0 0"},
      {"RAD_TAN_THIN_PRISM_FISHEYE", "50 50 21 14 0 0 0 0 0 0 0 0 0 0 0 0"},
  };
  for (const auto& [model, params] : models) {
    const TestFolder folder;
    const auto set = ReadText(folder, std::string("7 ") + model + " 40 30 " + params, "1 1 0 0 0 0 0 0 7 a.png\n\n");
    ASSERT_FALSE(set.ok()) << model;
    EXPECT_EQ(set.error().code, ErrorCode::kBadFile);
    EXPECT_NE(set.error().message.find(std::string("camera model ") + model), std::string::npos) << set.error().message;
    EXPECT_NE(set.error().message.find("cameras.txt: line 1: camera 7"), std::string::npos) << set.error().message;
  }
}

TEST(Colmap, LensesThatMakeNoSenseAreRefusedByCamera) {
  for (const auto& [params, words] :
       {std::pair("50 21 14 -50", "k1 = -50"), {"50 21 14 1e6", "k1 = 1e+06"}, {"50 21 14 1e300", "k1 = 1e+300"}}) {
    const TestFolder folder;
    const auto set = ReadText(folder, std::string("7 SIMPLE_RADIAL 40 30 ") + params, "1 1 0 0 0 0 0 0 7 a.png\n\n");
    ASSERT_FALSE(set.ok()) << params;
    EXPECT_EQ(set.error().code, ErrorCode::kBadFile);
    EXPECT_NE(set.error().message.find(words), std::string::npos) << set.error().message;
    EXPECT_NE(set.error().message.find("cameras.txt: line 1: camera 7"), std::string::npos) << set.error().message;
  }
}

TEST(Colmap, MalformedTextSaysWhichLine) {
  const std::string cameras = "7 PINHOLE 40 30 50 60 21 14\n", image = "1 1 0 0 0 0 0 0 7 a.png\n\n";
  const struct {
    std::string cameras, images, expected;
  } cases[] = {
      {"x", image, "cameras.txt: line 1: expected the camera's id, found \"x\""},
      {"-1 PINHOLE 40 30 50 60 21 14", image, "line 1: expected the camera's id"},
      {"\n# a\n7 LENS 40 30 1", image, "line 3: unknown camera model \"LENS\""},
      {"7", image, "unknown camera model"},
      {"7 PINHOLE 40", image, "ends before the height"},
      {"7 PINHOLE 40.5 30 50 60 21 14", image, "expected the width"},
      {"7 PINHOLE 0 30 50 60 21 14", image, "size 0 x 30"},
      {"7 PINHOLE 99999999999 30 50 60 21 14", image, "more than"},
      {"7 PINHOLE 1000000 1000000 50 60 21 14", image, "pixels"},
      {"7 PINHOLE 40 30 50 60 21", image, "4 parameters of PINHOLE"},
      {"7 PINHOLE 40 30 50 60 21 14 3", image, "found more"},
      {"7 PINHOLE 40 30 0 60 21 14", image, "focal length 0"},
      {"7 PINHOLE 40 30 nan 60 21 14", image, "focal length nan"},
      {"7 PINHOLE 40 30 50 inf 21 14", image, "focal length 50, inf"},
      {"7 PINHOLE 40 30 50 60 nan 14", image, "principal point"},
      {cameras + cameras, image, "line 2: camera 7 is listed twice"},
      {"", image, "image \"a.png\": camera 7 is not in the list"},
      {cameras, "", "no images"},
      {cameras, "# only comments\n", "no images"},
      {cameras, "1 1 0 0 0 0 0 0 7\n\n", "image without a name"},
      {cameras, "1 1 0 0 0 0 0 0\n\n", "ends before the camera's id"},
      {cameras, "1 1 0 0\n\n", "ends before the quaternion"},
      {cameras, "1 0 0 0 0 0 0 0 7 a.png\n\n", "image \"a.png\": quaternion has norm 0"},
      {cameras, "1 2 0 0 0 0 0 0 7 a.png\n\n", "quaternion has norm 2"},
      {cameras, "1 nan 0 0 0 0 0 0 7 a.png\n\n", "quaternion has norm nan"},
      {cameras, "1 1 0 0 0 inf 0 0 7 a.png\n\n", "image \"a.png\": translation is not finite"},
      {cameras, "1 1 0 0 0 0 0 0 7 a.png\n2 1 0 0 0 0 0 0 7 b.png\n", "line 2: expected the image's points"},
      {cameras, "1 1 0 0 0 0 0 0 7 a.png\n1 2\n", "line 2: expected the image's points (X Y POINT3D_ID), found 2"},
      {cameras, image + "1 1 0 0 0 0 0 0 8 b.png", "line 3: image \"b.png\": camera 8"},
  };
  for (const auto& c : cases) {
    const TestFolder folder;
    const auto set = ReadText(folder, c.cameras, c.images);
    ASSERT_FALSE(set.ok()) << c.expected;
    EXPECT_EQ(set.error().code, ErrorCode::kBadFile) << c.expected;
    EXPECT_NE(set.error().message.find(c.expected), std::string::npos) << c.expected << "\n" << set.error().message;
  }
}

TEST(Colmap, MalformedBinarySaysWhichByte) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::string images = ImagesBin({{}});
  Bytes many, endless, unterminated;
  many.U64(uint64_t{1} << 60);
  endless.U64(1).U32(1);
  for (int i = 0; i < 7; ++i) endless.F64(i == 0);
  endless.U32(7).Name("a.png").U64(uint64_t{1} << 61);
  unterminated.U64(1).U32(1);
  for (int i = 0; i < 7; ++i) unterminated.F64(i == 0);
  unterminated.U32(7).append(5000, 'a');
  const struct {
    std::string cameras, images, expected;
  } cases[] = {
      {"", images, "cameras.bin: byte 0: file ends inside the number of cameras"},
      {many, images, "byte 8: the number of cameras is 1152921504606846976, but only 0 bytes follow"},
      {CamerasBin(99, 40, 30, {50, 60, 21, 14}), images, "camera 7: unknown camera model 99"},
      {CamerasBin(0xffffffff, 40, 30, {50, 60, 21, 14}), images, "unknown camera model"},
      {CamerasBin(1, 40, 30, {50, 60, 21}), images, "file ends inside a camera's parameters"},
      {CamerasBin(1, 40, 30, {50, 60, 21, 14, 0}), images, "found 8 more bytes"},
      {CamerasBin(1, uint64_t{1} << 40, 30, {50, 60, 21, 14}), images, "more than"},
      {CamerasBin(1, 40, 30, {nan, 60, 21, 14}), images, "focal length nan"},
      {kPinhole, "", "images.bin: byte 0"},
      {kPinhole, many, "the number of images is"},
      {kPinhole, endless, "number of points is 2305843009213693952, but only 0 bytes follow"},
      {kPinhole, unterminated, "longer than 4096"},
      {kPinhole, Bytes().U64(0), "no images"},
      {kPinhole, images + "x", "found 1 more bytes"},
      {kPinhole, ImagesBin({{""}}), "image without a name"},
      {kPinhole, ImagesBin({{"a.png", {0, 0, 0, 0, 0, 0, 0}}}), "image \"a.png\": quaternion has norm 0"},
      {kPinhole, ImagesBin({{"a.png", {1, 0, 0, 0, nan, 0, 0}}}), "image \"a.png\": translation"},
      {kPinhole, ImagesBin({{"a.png", {1, 0, 0, 0, 0, 0, 0}, 3}}), "image \"a.png\": camera 3"},
  };
  for (const auto& c : cases) {
    const TestFolder folder;
    const auto set = ReadBinary(folder, c.cameras, c.images);
    ASSERT_FALSE(set.ok()) << c.expected;
    EXPECT_EQ(set.error().code, ErrorCode::kBadFile) << c.expected;
    EXPECT_NE(set.error().message.find(c.expected), std::string::npos) << c.expected << "\n" << set.error().message;
  }
}

TEST(Colmap, EveryTruncationIsAnError) {
  const TestFolder folder;
  const std::string images = ImagesBin({{"a.png", {1, 0, 0, 0, 0, 0, 0}, 7, 2}, {"b.png"}});
  ASSERT_TRUE(ReadBinary(folder, kPinhole, images).ok());
  for (size_t n = 0; n < images.size(); ++n) EXPECT_FALSE(ReadBinary(folder, kPinhole, images.substr(0, n)).ok()) << n;
  for (size_t n = 0; n < kPinhole.size(); ++n)
    EXPECT_FALSE(ReadBinary(folder, kPinhole.substr(0, n), images).ok()) << n;
}

TEST(Colmap, ProjectFoldersAreUnderstood) {
  for (const std::string model : {"", "sparse", "sparse/0"}) {
    const TestFolder folder;
    const auto project = folder / "scene";
    Write(project / model / "cameras.bin", kPinhole);
    Write(project / model / "images.bin", ImagesBin({{"sub/a.png"}, {"b.png"}}));
    std::filesystem::create_directories(project / "images/sub");
    ASSERT_TRUE(WritePng(project / "images/sub/a.png", Image(4, 4, 3)).ok());
    for (const auto& given : {project, project / model, project / model / "images.bin"}) {
      const auto set = ReadCameras(given);
      ASSERT_TRUE(set.ok()) << set.error().message;
      ASSERT_EQ(set->cameras.size(), 2u);
      EXPECT_EQ(set->cameras[0].name, "sub/a");
      EXPECT_EQ(set->cameras[0].image, project / "images/sub/a.png") << given;
      EXPECT_TRUE(set->cameras[1].image.empty());
    }
  }
}

// COLMAP makes a model for each part of a capture that it cannot join with the others.
TEST(Colmap, OfSeveralModelsTheLargestIsTaken) {
  for (const std::string places : {"sparse", "colmap/sparse"}) {
    const TestFolder folder;
    const auto project = folder / "scene";
    Write(project / places / "0/cameras.bin", kPinhole);
    Write(project / places / "0/images.bin", ImagesBin({{"a.png"}}));
    Write(project / places / "10/cameras.txt", "7 PINHOLE 40 30 50 60 21 14\n");
    Write(project / places / "10/images.txt", "1 1 0 0 0 0 0 0 7 a.png\n\n2 1 0 0 0 0 0 0 7 b.png\n\n");
    std::filesystem::create_directories(project / "images");
    ASSERT_TRUE(WritePng(project / "images/a.png", Image(4, 4, 3)).ok());
    const Messages messages;
    const auto set = ReadCameras(project);
    ASSERT_TRUE(set.ok()) << set.error().message;
    EXPECT_EQ(set->cameras.size(), 2u);
    EXPECT_EQ(set->cameras[0].image, project / "images/a.png");
    ASSERT_EQ(messages.warnings().size(), 1u);
    EXPECT_NE(messages.warnings()[0].find((project / places / "0").string() + " (1 picture)"), std::string::npos)
        << messages.warnings()[0];
    EXPECT_EQ(ReadCameras(project / places)->cameras.size(), 2u);
    const auto named = ReadCameras(project / places / "0");
    ASSERT_TRUE(named.ok()) << named.error().message;
    EXPECT_EQ(named->cameras.size(), 1u);
    EXPECT_EQ(named->cameras[0].image, project / "images/a.png");
  }
}

TEST(Colmap, ModelsElsewhereInTheProjectAreNamed) {
  for (const char* place : {"colmap/sparse/0", "distorted/sparse/0", "sparse_txt"}) {
    const TestFolder folder;
    Write(folder / "sparse/0/cameras.bin", kPinhole);
    Write(folder / "sparse/0/images.bin", ImagesBin({{"a.png"}}));
    Write(folder / place / "cameras.txt", "7 PINHOLE 40 30 50 60 21 14\n");
    const std::string one = "1 1 0 0 0 0 0 0 7 a.png\n\n";
    Write(folder / place / "images.txt", one + "2 1 0 0 0 0 0 0 7 b.png\n\n");
    Messages messages;
    EXPECT_EQ(ReadCameras(folder.path())->cameras.size(), 1u);
    ASSERT_EQ(messages.warnings().size(), 1u) << place;
    const std::string warning = messages.TakeWarnings()[0];
    EXPECT_NE(warning.find((folder / place).string() + " (2 pictures)"), std::string::npos) << warning;
    // As many are the same model as text, or before its pictures were undistorted.
    Write(folder / place / "images.txt", one);
    EXPECT_EQ(ReadCameras(folder.path())->cameras.size(), 1u);
    EXPECT_TRUE(messages.warnings().empty()) << place;
  }
}

TEST(Colmap, QuaternionsNearNormOneAreNormalised) {
  const TestFolder folder;
  const Messages messages;
  const double c = 1.01 * std::sqrt(0.5);
  const auto set = ReadBinary(folder, kPinhole, ImagesBin({{"a.png", {c, 0, c, 0, 1, 2, 3}}, {"b.png"}}));
  ASSERT_TRUE(set.ok()) << set.error().message;
  EXPECT_NEAR(set->cameras[0].world_to_camera.rotation[2], 1, 1e-12);
  ASSERT_EQ(messages.warnings().size(), 1u);
  EXPECT_NE(messages.warnings()[0].find("1 quaternion is not of norm 1 (worst: 1.01)"), std::string::npos)
      << messages.warnings()[0];
}

TEST(Colmap, HalfAModelIsAnError) {
  const TestFolder folder;
  Write(folder / "cameras.txt", "7 PINHOLE 40 30 50 60 21 14\n");
  Write(folder / "images.bin", ImagesBin({{}}));
  EXPECT_EQ(ReadCameras(folder.path()).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(ReadCameras(folder / "images.bin").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(ReadCameras(folder / "cameras.bin").error().code, ErrorCode::kNotFound);
}

// Two points, the first of which is seen in two images.
std::string PointsBin() {
  Bytes bytes;
  bytes.U64(2).U64(11).F64(0.5).F64(-1).F64(2);
  bytes.append("\xff\x00\x33", 3);
  bytes.F64(0.25).U64(2).U32(1).U32(0).U32(2).U32(5);
  bytes.U64(12).F64(1e-3).F64(4).F64(5);
  bytes.append("\x01\x02\x03", 3);
  bytes.F64(-1).U64(0);
  return bytes;
}

TEST(ColmapPoints, BinaryAndTextAreTheSamePoints) {
  const TestFolder folder;
  EXPECT_EQ(ReadColmapPoints(folder.path()).error().code, ErrorCode::kNotFound);
  Write(folder / "points3D.txt", "# X Y Z R G B\n11 0.5 -1 2 255 0 51 0.25 1 0 2 5\r\n\n12 1e-3 4 5 1 2 3 -1");
  const auto text = ReadColmapPoints(folder.path());
  Write(folder / "points3D.bin", PointsBin());
  const auto binary = ReadColmapPoints(folder.path());
  for (const auto* points : {&text, &binary}) {
    ASSERT_TRUE(points->ok()) << points->error().message;
    ASSERT_EQ((*points)->size(), 2u);
    const ColmapPoint &a = (**points)[0], &b = (**points)[1];
    EXPECT_EQ(a.position, (std::array<double, 3>{0.5, -1, 2}));
    EXPECT_EQ(b.position, (std::array<double, 3>{1e-3, 4, 5}));
    EXPECT_EQ(a.color, (std::array<uint8_t, 3>{255, 0, 51}));
    EXPECT_EQ(b.color, (std::array<uint8_t, 3>{1, 2, 3}));
  }
  Write(folder / "points3D.bin", Bytes().U64(0));
  EXPECT_EQ(ReadColmapPoints(folder.path())->size(), 0u);
}

TEST(ColmapPoints, ComeBackFromTheWriter) {
  const std::vector<ColmapPoint> points = {{{0.1, -2, 3e7}, {1, 2, 3}}, {{1.0 / 3, 0, 5}, {255, 254, 0}}};
  for (const ColmapForm form : {ColmapForm::kBinary, ColmapForm::kText}) {
    const TestFolder folder;
    ASSERT_TRUE(WriteColmapPoints(folder.path(), points, form).ok());
    const auto read = ReadColmapPoints(folder.path());
    ASSERT_TRUE(read.ok()) << read.error().message;
    ASSERT_EQ(read->size(), 2u);
    for (size_t i = 0; i < 2; ++i) {
      EXPECT_EQ((*read)[i].position, points[i].position);
      EXPECT_EQ((*read)[i].color, points[i].color);
    }
  }
}

TEST(ColmapPoints, EveryTruncationIsAnError) {
  const TestFolder folder;
  const std::string points = PointsBin();
  for (size_t n = 0; n < points.size(); ++n) {
    Write(folder / "points3D.bin", points.substr(0, n));
    EXPECT_FALSE(ReadColmapPoints(folder.path()).ok()) << n;
  }
  Write(folder / "points3D.bin", points + "x");
  EXPECT_NE(ReadColmapPoints(folder.path()).error().message.find("found 1 more bytes"), std::string::npos);
  Write(folder / "points3D.bin", Bytes().U64(uint64_t{1} << 60) + points);
  EXPECT_NE(ReadColmapPoints(folder.path()).error().message.find("number of points is"), std::string::npos);
}

TEST(ColmapPoints, MessagesNameTheLine) {
  const std::pair<const char*, const char*> cases[] = {
      {"11 0.5 -1 2 255 0 256 0.25\n", "line 1: expected the colour R G B, 0 to 255, found \"256\""},
      {"#\n11 0.5 -1\n", "line 2: ends before the position X Y Z"},
      {"x 0 0 0 0 0 0 0\n", "line 1: expected the point's id, found \"x\""},
      {"3 0 nan 0 0 0 0 0\n", "line 1: point 3 has a position that is not finite"},
      {"3 0 1e400 0 0 0 0 0\n", "line 1: expected the position X Y Z, found \"1e400\""},
  };
  for (const auto& [text, expected] : cases) {
    const TestFolder folder;
    Write(folder / "points3D.txt", text);
    const auto points = ReadColmapPoints(folder.path());
    ASSERT_FALSE(points.ok()) << expected;
    EXPECT_EQ(points.error().code, ErrorCode::kBadFile);
    EXPECT_NE(points.error().message.find(expected), std::string::npos) << points.error().message;
  }
}

}  // namespace
}  // namespace anchorsplat
