#include "cameras/poses_bounds.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include "cameras/camera_io.h"
#include "core/random.h"
#include "images/image_io.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

std::string Npy(const std::vector<double>& values, size_t rows, const std::string& type = "<f8",
                bool column_major = false) {
  std::string header = "{'descr': '" + type + "', 'fortran_order': " + (column_major ? "True" : "False") +
                       ", 'shape': (" + std::to_string(rows) + ", 17), }";
  header.resize((10 + header.size() + 64) / 64 * 64 - 10 - 1, ' ');
  header += '\n';
  std::string bytes("\x93NUMPY\x01\0", 8);
  bytes += static_cast<char>(header.size());
  bytes += static_cast<char>(header.size() >> 8);
  bytes += header;
  for (size_t i = 0; i < values.size(); ++i) {
    const double value = column_major ? values[i % rows * 17 + i / rows] : values[i];
    char item[8];
    size_t size = 8;
    if (type[2] == '8') {
      std::memcpy(item, &value, 8);
    } else {
      const auto narrow = static_cast<float>(value);
      std::memcpy(item, &narrow, size = 4);
    }
    if (type[0] == '>') std::reverse(item, item + size);
    bytes.append(item, size);
  }
  return bytes;
}

// A camera at (1, 2, 3) that looks along the world's x, up is z: right −y, so that down is −z and back −x.
const std::vector<double> kView = {0,   0,  -1, 1, 6,   //
                                   0,   -1, 0,  2, 8,   //
                                   -1,  0,  0,  3, 10,  //
                                   0.5, 9};

Result<CameraSet> Read(const TestFolder& folder, const std::string& bytes) {
  std::filesystem::remove(folder / "poses_bounds.npy");
  std::ofstream(folder / "poses_bounds.npy", std::ios::binary) << bytes;
  return ReadCameras(folder.path());
}

TEST(PosesBounds, AxesAreDownRightBack) {
  const TestFolder folder;
  std::vector<double> two = kView;
  two.insert(two.end(), kView.begin(), kView.end());
  for (const char* type : {"<f8", "<f4", ">f8"}) {
    for (const bool column_major : {false, true}) {
      const auto set = Read(folder, Npy(two, 2, type, column_major));
      ASSERT_TRUE(set.ok()) << set.error().message;
      ASSERT_EQ(set->cameras.size(), 2u);
      const Camera& camera = set->cameras[1];
      EXPECT_EQ(camera.name, "001");
      EXPECT_EQ(camera.intrinsics, (Pinhole{8, 6, 10, 10, 4, 3}));
      const auto ahead = camera.ToCamera({2, 2, 3}), right = camera.ToCamera({1, 1, 3}),
                 down = camera.ToCamera({1, 2, 2});
      EXPECT_NEAR(ahead[2], 1, 1e-6);
      EXPECT_NEAR(right[0], 1, 1e-6);
      EXPECT_NEAR(down[1], 1, 1e-6);
    }
  }
}

TEST(PosesBounds, PicturesByTheirOrder) {
  const TestFolder folder;
  std::filesystem::create_directories(folder / "images_4");
  std::filesystem::create_directories(folder / "masks");
  for (const char* name : {"b.png", "a.JPG", "notes.txt"}) {
    ASSERT_TRUE(WritePng(folder / "images_4" / name, Image(8, 6, 3)).ok());
  }
  ASSERT_TRUE(WritePng(folder / "masks" / "b.png", Image(8, 6, 1)).ok());
  std::vector<double> two = kView;
  two.insert(two.end(), kView.begin(), kView.end());
  const auto set = Read(folder, Npy(two, 2));
  ASSERT_TRUE(set.ok()) << set.error().message;
  EXPECT_EQ(set->cameras[0].name, "a");
  EXPECT_EQ(set->cameras[1].image, folder / "images_4/b.png");
  EXPECT_EQ(set->cameras[1].photograph.mask, folder / "masks/b.png");
  const auto one = Read(folder, Npy(kView, 1));
  ASSERT_FALSE(one.ok());
  EXPECT_NE(one.error().message.find("has 1 views"), std::string::npos) << one.error().message;
}

TEST(PosesBounds, DamagedFilesAreErrors) {
  const TestFolder folder;
  const std::string good = Npy(kView, 1);
  ASSERT_TRUE(Read(folder, good).ok());
  for (size_t length = 0; length < good.size(); ++length) {
    const auto set = ParsePosesBounds("p.npy", std::string_view(good).substr(0, length), {});
    ASSERT_FALSE(set.ok()) << length;
    EXPECT_EQ(set.error().code, ErrorCode::kBadFile);
  }
  Random random(9);
  for (int i = 0; i < 20000; ++i) {
    std::string bytes = good;
    for (int k = 0; k < 2; ++k) {
      bytes[static_cast<size_t>(random.Uniform(0, static_cast<double>(bytes.size()) - 0.01))] =
          static_cast<char>(random.Uniform(0, 256));
    }
    const auto set = ParsePosesBounds("p.npy", bytes, {});
    EXPECT_TRUE(set.ok() || set.error().code == ErrorCode::kBadFile) << set.error().message;
  }
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{{"(1, 17)", "(9, 17)"},
                                                                                 {"(1, 17)", "(1, 15)"},
                                                                                 {"(1, 17)", "(0, 17)"},
                                                                                 {"<f8", "<i8"},
                                                                                 {"NUMPY", "MUMPY"}}) {
    std::string bytes = good;
    bytes.replace(bytes.find(from), from.size(), to);
    EXPECT_EQ(Read(folder, bytes).error().code, ErrorCode::kBadFile) << to;
  }
  std::vector<double> scaled = kView;
  scaled[2] = -2;
  EXPECT_NE(Read(folder, Npy(scaled, 1)).error().message.find("view 0: camera matrix is not a rotation"),
            std::string::npos);
}

}  // namespace
}  // namespace anchorsplat
