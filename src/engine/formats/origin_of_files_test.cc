#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>

#include "core/messages_for_test.h"
#include "core/world_origin.h"
#include "formats/convert.h"
#include "formats/extra_properties.h"
#include "formats/opened_splat.h"
#include "formats/ply/ply_points.h"
#include "formats/ply/ply_reader.h"
#include "formats/ply/ply_writer.h"
#include "formats/random_cloud_for_test.h"
#include "formats/registry.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;

constexpr WorldOrigin kFar = {500000, 4500000, 0};

// Positions with more digits than floats have, around kFar.
struct Scene {
  GaussianCloud cloud = RandomCloud(300, 1, 5);
  ExtraProperties extras;

  Scene() {
    for (float& x : cloud.log_scales) x = 0.3f * x - 3;
    for (float& x : cloud.sh) x *= 0.3f;
    cloud.origin = kFar;
    cloud.double_means = true;
    for (size_t i = 0; i < cloud.means.size(); ++i) {
      extras.world.push_back(kFar[i % 3] + 20 * double{cloud.means[i]} + 1e-7 * static_cast<double>(i));
      cloud.means[i] = static_cast<float>(extras.world.back() - kFar[i % 3]);
    }
  }
};

std::filesystem::path WriteDoubles(const TestFolder& folder, const Scene& scene) {
  EXPECT_TRUE(WritePlyWithExtras(folder / "map.ply", scene.cloud, {.overwrite = true}, scene.extras).ok());
  return folder / "map.ply";
}

std::string BytesOf(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

double FarthestApart(const GaussianCloud& cloud, const Buffer<double>& world) {
  double farthest = 0;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    const auto at = ToWorld(cloud.means.data() + 3 * i, cloud.origin);
    for (size_t k = 0; k < 3; ++k) {
      farthest = std::max(farthest, std::fabs(at[k] - world[static_cast<size_t>(3 * i) + k]));
    }
  }
  return farthest;
}

TEST(OriginOfFiles, DoublesThatFloatsCannotHoldGetOne) {
  const TestFolder folder;
  const Scene scene;
  const auto read = ReadCloud(WriteDoubles(folder, scene));
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->origin, kFar);
  EXPECT_TRUE(read->double_means);
  EXPECT_LT(FarthestApart(*read, scene.extras.world), 1e-5) << "floats of a hundred";
  EXPECT_TRUE(read->comments.empty());
}

TEST(OriginOfFiles, SmallDoublesStayAsTheyAre) {
  const TestFolder folder;
  GaussianCloud cloud = RandomCloud(50, 0, 1);
  cloud.double_means = true;
  ASSERT_TRUE(WritePly(folder / "small.ply", cloud).ok());
  const auto read = ReadCloud(folder / "small.ply");
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->origin, WorldOrigin{});
  EXPECT_EQ(read->means, cloud.means);
  // Doubles stay doubles, bit for bit.
  ASSERT_TRUE(ConvertFile(folder / "small.ply", folder / "again.ply", {}).ok());
  EXPECT_EQ(BytesOf(folder / "again.ply"), BytesOf(folder / "small.ply"));
}

TEST(OriginOfFiles, TextHasItsDigits) {
  std::string text = "ply\nformat ascii 1.0\nelement vertex 2\n";
  for (const char* name : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
                           "rot_0", "rot_1", "rot_2", "rot_3"}) {
    text += std::string("property float ") + name + "\n";
  }
  text +=
      "end_header\n500000.125 4500000.25 1 0 0 0 1 -3 -3 -3 1 0 0 0\n500001.5 4500000.75 2 0 0 0 1 -3 -3 -3 1 0 0 0\n";
  const auto read = ReadPly(InputFile::FromBytes("map.ply", text));
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->origin, kFar);
  EXPECT_EQ(read->means, (Buffer<float>{0.125f, 0.25f, 1, 1.5f, 0.75f, 2}));
  EXPECT_FALSE(read->double_means) << "the file says float";
}

TEST(OriginOfFiles, ACommentBringsItBack) {
  const TestFolder folder;
  Scene scene;
  scene.cloud.double_means = false;
  ASSERT_TRUE(WritePly(folder / "relative.ply", scene.cloud).ok());
  EXPECT_THAT(BytesOf(folder / "relative.ply").substr(0, 200), HasSubstr("comment SplatOrigin: 500000 4500000 0\n"));
  const auto read = ReadCloud(folder / "relative.ply");
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->origin, kFar);
  EXPECT_EQ(read->means, scene.cloud.means);
  const auto file = OpenedSplat::Open(folder / "relative.ply");
  ASSERT_TRUE(file.ok());
  const auto blocks = file->Blocks();
  ASSERT_TRUE(blocks.ok());
  EXPECT_EQ((*blocks)->origin(), kFar);
}

TEST(OriginOfFiles, DoublesToDoublesKeepEveryBit) {
  const TestFolder folder;
  const Scene scene;
  const auto input = WriteDoubles(folder, scene);
  const auto report = ConvertFile(input, folder / "out.ply", {.measure = true});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(BytesOf(folder / "out.ply"), BytesOf(input));
  EXPECT_EQ(report->error->means.max, 0);
  EXPECT_EQ(report->output_bytes, report->predicted_bytes);
}

TEST(OriginOfFiles, DoubleOnRequest) {
  const TestFolder folder;
  Scene scene;
  scene.cloud.double_means = false;
  ASSERT_TRUE(WritePly(folder / "relative.ply", scene.cloud).ok());
  ASSERT_TRUE(ConvertFile(folder / "relative.ply", folder / "out.ply", {.double_means = true}).ok());
  EXPECT_THAT(BytesOf(folder / "out.ply").substr(0, 100), HasSubstr("property double x\n"));
  const auto read = ReadCloud(folder / "out.ply");
  ASSERT_TRUE(read.ok());
  EXPECT_LT(FarthestApart(*read, scene.extras.world), 1e-5);
}

TEST(OriginOfFiles, EveryFormatKeepsItOrSaysSo) {
  const TestFolder folder;
  const Scene scene;
  const auto input = WriteDoubles(folder, scene);
  int kept = 0, lost = 0;
  for (const SplatFormat& format : Formats()) {
    if (format.write == nullptr) continue;
    SCOPED_TRACE(format.name);
    const std::string extension(format.extensions.front());
    const auto output = folder / (extension.starts_with('.') ? "out" + extension : extension);
    const Messages messages;
    const auto report =
        ConvertFile(input, output, {.write = {.overwrite = true, .order = SplatOrder::kKeep}, .measure = true});
    ASSERT_TRUE(report.ok()) << report.error().message;
    const std::string said = testing::PrintToString(messages.warnings());
    if (!format.keeps_origin) {
      EXPECT_THAT(said, HasSubstr("relative to 500000 4500000 0"));
      ++lost;
      continue;
    }
    EXPECT_THAT(said, testing::Not(HasSubstr("origin")));
    ++kept;
    if (format.read == nullptr) continue;
    const auto back = ReadCloud(output);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(back->origin, kFar);
    EXPECT_LT(report->error->means.max, 0.1) << "a step of the coarsest format in a scene of a hundred";
    if (!format.written_rows) {
      EXPECT_NEAR(report->error->means.max, FarthestApart(*back, scene.extras.world), 0.2);
    }
  }
  EXPECT_GE(kept, 6);
  EXPECT_GE(lost, 2);
}

TEST(OriginOfFiles, TheReportMeasuresAgainstTheFile) {
  const TestFolder folder;
  // A planet: no single origin makes floats fine enough for all of it.
  GaussianCloud cloud = RandomCloud(200, 0, 2);
  ExtraProperties extras;
  cloud.double_means = true;
  for (float& x : cloud.means) {
    extras.world.push_back(6e6 * double{x} + 0.123);
    x = static_cast<float>(extras.world.back());
  }
  ASSERT_TRUE(WritePlyWithExtras(folder / "planet.ply", cloud, {}, extras).ok());
  const auto report = ConvertFile(folder / "planet.ply", folder / "planet.glb", {.measure = true});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_GT(report->error->means.max, 0.1) << "half a step of floats at ten million";
  EXPECT_LT(report->error->means.max, 2);
}

TEST(OriginOfFiles, WhatLiesTooFarApartIsSaid) {
  const TestFolder folder;
  Scene scene;
  for (size_t i = 0; i < size_t{3} * 100; ++i) {
    scene.extras.world[i] -= kFar[i % 3];  // a third of it at zero
    scene.cloud.means[i] = static_cast<float>(scene.extras.world[i] - kFar[i % 3]);
  }
  const auto input = WriteDoubles(folder, scene);
  const Messages messages;
  const auto report = ConvertFile(input, folder / "out.ply", {.measure = true});
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(BytesOf(folder / "out.ply"), BytesOf(input)) << "doubles are kept all the same";
  EXPECT_EQ(report->error->means.max, 0);
  EXPECT_THAT(testing::PrintToString(messages.warnings()), HasSubstr("positions of 100 of 300 Gaussians are rounded"));
}

TEST(OriginOfFiles, BrokenOnesAreRefused) {
  Scene scene;
  const TestFolder folder;
  ASSERT_TRUE(WritePly(folder / "a.ply", RandomCloud(2, 0, 1)).ok());
  for (const char* broken :
       {"SplatOrigin: 1 2", "SplatOrigin: nan 0 0", "SplatOrigin:1,2,3", "SplatOrigin: 1e300 0 0"}) {
    std::string bytes = BytesOf(folder / "a.ply");
    bytes.insert(bytes.find("element vertex"), std::string("comment ") + broken + "\n");
    const auto read = ReadPly(InputFile::FromBytes("a.ply", bytes));
    ASSERT_FALSE(read.ok()) << broken;
    EXPECT_THAT(read.error().message, HasSubstr("is not an origin"));
  }
}

TEST(OriginOfFiles, AxesTurnItAlong) {
  const TestFolder folder;
  const Scene scene;
  const auto input = WriteDoubles(folder, scene);
  ASSERT_TRUE(ConvertFile(input, folder / "out.ply", {.input_axes = AxesFromName("RUB")}).ok());
  const auto read = ReadCloud(folder / "out.ply");
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->origin, (WorldOrigin{500000, -4500000, 0}));
  EXPECT_NEAR(ToWorld(read->means.data(), read->origin)[1], -scene.extras.world[1], 1e-5);
}

TEST(OriginOfFiles, PointsOfAPlyAreDoubles) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty double x\nproperty double y\nproperty double "
      "z\nend_header\n";
  const double at[] = {500000.123, 4500000.456, 120.789};
  bytes.append(reinterpret_cast<const char*>(at), sizeof at);
  const auto points = ReadPlyPoints(InputFile::FromBytes("points.ply", bytes));
  ASSERT_TRUE(points.ok()) << points.error().message;
  EXPECT_EQ(points->positions, (Buffer<double>{500000.123, 4500000.456, 120.789}));
}

}  // namespace
}  // namespace anchorsplat
