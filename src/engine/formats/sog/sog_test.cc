#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/messages_for_test.h"
#include "core/parallel.h"
#include "formats/attribute_error.h"
#include "formats/both_ways_for_test.h"
#include "formats/opened_splat.h"
#include "formats/random_cloud_for_test.h"
#include "formats/sog/clustered_cloud_for_test.h"
#include "formats/sog/sog_blocks.h"
#include "formats/sog/sog_reader.h"
#include "formats/sog/sog_writer.h"
#include "formats/splat_order.h"
#include "images/webp_image.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"
#include "io/zip_archive.h"

namespace anchorsplat {
namespace {

Result<GaussianCloud> Read(const std::filesystem::path& path, const ReadLimits& limits = {}) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const InputFile file, InputFile::Open(path));
  return ReadBothWays(ReadSog, BlocksOfSog, file, limits);
}

// Bytes that this process has asked the system for.
uint64_t BytesAskedFor() {
  std::ifstream io("/proc/self/io");
  std::string name;
  uint64_t bytes = 0;
  io >> name >> bytes;
  EXPECT_EQ(name, "rchar:");
  return bytes;
}

#define EXPECT_CONTAINS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

TEST(Sog, RoundTripWithinTheStepsOfTheFormat) {
  const TestFolder folder;
  for (int degree = 0; degree <= kMaxShDegree; ++degree) {
    for (const int64_t n : {1, 5, 3000}) {
      GaussianCloud cloud = Clustered(n, degree, static_cast<uint64_t>(n));
      cloud.render_mode = kRenderModes[static_cast<size_t>(degree) % 3];
      const std::filesystem::path path = degree == 2 ? folder / "meta.json" : folder / "a.sog";
      const Status written = WriteSog(path, cloud, {.overwrite = true});
      ASSERT_TRUE(written.ok()) << written.error().message;
      const auto read = Read(path);
      ASSERT_TRUE(read.ok()) << read.error().message;
      EXPECT_EQ(read->sh_degree, degree);
      EXPECT_EQ(read->render_mode,
                IsCompensated(cloud.render_mode) ? std::optional(RenderMode::kAntialiased) : std::nullopt);
      const auto error = CompareAttributes(*read, cloud, MortonOrder(cloud));
      ASSERT_TRUE(error.ok()) << error.error().message;
      EXPECT_EQ(error->compared, n);
      EXPECT_LT(error->means.max, 5e-4);
      EXPECT_LT(error->rotations.max, 0.02);
      EXPECT_LT(error->log_scales.rms, 0.02);
      EXPECT_LT(error->opacities.max, 0.5 / 255 + 1e-6);
      EXPECT_LT(error->colors.rms, 0.01);
      EXPECT_LT(error->harmonics.rms, n == 3000 ? 0.06 : 0.002);
    }
  }
}

TEST(Sog, CreditsAreItsCopyright) {
  const TestFolder folder;
  GaussianCloud cloud = Clustered(5, 0, 1);
  cloud.comments = {"world up: 0 1 0", "credit: Mug by Ann, CC BY 4.0", "credit: scanned by Bob",
                    "enhanced by anchorsplat: filter, 4 times closer"};
  for (const char* name : {"a.sog", "meta.json"}) {
    ASSERT_TRUE(WriteSog(folder / name, cloud).ok());
    const auto read = Read(folder / name);
    ASSERT_TRUE(read.ok()) << read.error().message;
    std::vector<std::string> kept(cloud.comments.begin() + 1, cloud.comments.end());
    kept.push_back(cloud.comments[0]);
    EXPECT_EQ(read->comments, kept);
  }
  const nlohmann::json meta = nlohmann::json::parse(FileBytes(folder / "meta.json"));
  EXPECT_EQ(meta["asset"]["copyright"], "Mug by Ann, CC BY 4.0\nscanned by Bob");
}

TEST(Sog, EdgeValuesStayDefined) {
  const TestFolder folder;
  GaussianCloud cloud = RandomCloud(30, 1, 5);
  const float inf = std::numeric_limits<float>::infinity();
  for (float* value :
       {&cloud.means[0], &cloud.log_scales[0], &cloud.quats[0], &cloud.sh[0], &cloud.sh[5], &cloud.opacity_logits[0]}) {
    *value = std::nanf("");
  }
  cloud.means[5] = inf;
  cloud.log_scales[7] = -inf;
  cloud.sh[12 * 3 + 4] = -inf;
  std::fill_n(&cloud.quats[16], 4, 0.0f);
  ASSERT_TRUE(WriteSog(folder / "a.sog", cloud, {.order = SplatOrder::kKeep}).ok());
  const auto read = Read(folder / "a.sog");
  ASSERT_TRUE(read.ok()) << read.error().message;
  for (int64_t i = 0; i < 30; ++i) EXPECT_TRUE(IsUsable(*read, i)) << i;
  EXPECT_NEAR(read->log_scales[7], -20, 0.1);
  EXPECT_NEAR(read->quats[16], 1, 0.01);
  EXPECT_LT(CompareAttributes(*read, cloud)->means.max, 1e-3);
}

// Version 1, by hand from what its readers do: ranges instead of codebooks, a logit instead of an opacity.
TEST(Sog, ReadsVersionOne) {
  const TestFolder folder;
  const auto picture = [&](const char* name, int width, std::vector<uint8_t> rgba) {
    ByteImage image{width, static_cast<int>(rgba.size()) / 4 / width, {}};
    image.rgba.assign(rgba.begin(), rgba.end());
    ASSERT_TRUE(WriteWholeFile(folder / name, *EncodeWebp(image), false).ok());
  };
  picture("l.webp", 2, {255, 0, 255, 255, 0, 0, 0, 255});
  picture("u.webp", 2, {255, 0, 127, 255, 0, 0, 0, 255});
  picture("q.webp", 2, {128, 128, 255, 254, 1, 2, 3, 7});
  picture("s.webp", 2, {0, 255, 51, 255, 0, 0, 0, 255});
  picture("c.webp", 2, {0, 255, 51, 255, 0, 0, 0, 0});
  std::vector<uint8_t> palette(4 * 192, 0);
  palette[4 * 3 + 1] = 255;  // entry 1, first coefficient, green
  picture("p.webp", 192, palette);
  picture("n.webp", 2, {1, 0, 0, 255, 63, 0, 0, 255});
  const std::string meta = R"({"means":{"shape":[2,3],"mins":[-1,-1,0],"maxs":[2,1,1],"files":["l.webp","u.webp"]},
    "quats":{"files":["q.webp"]},"scales":{"mins":[-5,-5,-5],"maxs":[0,0,0],"files":["s.webp"]},
    "sh0":{"mins":[0,0,0,-8],"maxs":[1,1,1,8],"files":["c.webp"]},
    "shN":{"mins":-1,"maxs":1,"files":["p.webp","n.webp"]}})";
  ASSERT_TRUE(WriteWholeFile(folder / "meta.json", meta, false).ok());
  const auto cloud = Read(folder / "meta.json");
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  ASSERT_EQ(cloud->size(), 2);
  ASSERT_EQ(cloud->sh_degree, 1);
  EXPECT_NEAR(cloud->means[0], std::expm1(2.0), 1e-5);
  EXPECT_NEAR(cloud->means[1], -std::expm1(1.0), 1e-5);
  EXPECT_NEAR(cloud->means[2], std::expm1(0.5), 1e-4);
  EXPECT_THAT(std::vector<float>(cloud->log_scales.begin(), cloud->log_scales.begin() + 3),
              testing::ElementsAre(-5.0f, 0.0f, -4.0f));
  EXPECT_NEAR(cloud->quats[2], std::sqrt(0.5), 1e-3);
  EXPECT_NEAR(cloud->quats[3], std::sqrt(0.5), 1e-3);
  EXPECT_EQ(cloud->quats[4], 1);  // no mark: no rotation
  EXPECT_THAT(cloud->opacity_logits, testing::ElementsAre(8.0f, -8.0f));
  EXPECT_NEAR(cloud->sh[2], 0.2, 1e-6);
  EXPECT_EQ(cloud->sh[3], -1);
  EXPECT_EQ(cloud->sh[4], 1);
  std::string mismatched = meta;
  mismatched.replace(mismatched.find("\"sh0\":{"), 7, "\"sh0\":{\"shape\":[3,1,4],");
  ASSERT_TRUE(WriteWholeFile(folder / "meta.json", mismatched, true).ok());
  EXPECT_CONTAINS(Read(folder / "meta.json").error().message, "says 3 Gaussians");
}

TEST(Sog, RefusesLiesAndOtherFolders) {
  const TestFolder folder;
  const GaussianCloud cloud = Clustered(2000, 1, 5);
  ASSERT_TRUE(WriteSog(folder / "meta.json", cloud).ok());
  ASSERT_TRUE(WriteSog(folder / "a.sog", cloud).ok());
  EXPECT_EQ(WriteSog(folder / "a.sog", cloud).error().code, ErrorCode::kExists);
  const nlohmann::json good = nlohmann::json::parse(FileBytes(folder / "meta.json"));
  const auto error_of = [&](const nlohmann::json& meta) {
    EXPECT_TRUE(WriteWholeFile(folder / "meta.json", meta.dump(), true).ok());
    const auto read = Read(folder / "meta.json");
    return read.ok() ? std::string("accepted") : read.error().message;
  };
  EXPECT_EQ(error_of(good), "accepted");
  const auto with = [&good](const char* pointer, const nlohmann::json& value) {
    nlohmann::json changed = good;
    changed[nlohmann::json::json_pointer(pointer)] = value;
    return changed;
  };
  EXPECT_CONTAINS(error_of(with("/version", 3)), "expected a whole number from 1 to 2");
  EXPECT_CONTAINS(error_of(with("/count", 0)), "count");
  EXPECT_CONTAINS(error_of(with("/count", 300'000'000)), "count");
  EXPECT_CONTAINS(error_of(with("/count", 200'000'000)), "bomb");
  EXPECT_CONTAINS(error_of(with("/count", 5000)), "pixels");
  EXPECT_CONTAINS(error_of(with("/means/files/0", "../meta.json")), "beside it");
  EXPECT_CONTAINS(error_of(with("/means/files/0", "/etc/passwd")), "beside it");
  EXPECT_CONTAINS(error_of(with("/means/files/0", "meta.json")), "not a WebP");
  EXPECT_CONTAINS(error_of(with("/means/files/0", "gone.webp")), "no such file");
  EXPECT_CONTAINS(error_of(with("/quats/files", nlohmann::json::array())), "expected 1 names");
  EXPECT_CONTAINS(error_of(with("/scales/codebook", {1, 2})), "codebook");
  EXPECT_CONTAINS(error_of(with("/shN/bands", 2)), "bands");
  EXPECT_CONTAINS(error_of(with("/shN/count", 70'000)), "count");
  EXPECT_CONTAINS(error_of(with("/shN/count", 2000)), "room for");
  EXPECT_CONTAINS(error_of(with("/shN/count", 5)), "labels beyond");
  EXPECT_CONTAINS(error_of(with("/means/mins", {-1, 1e308, 0})), "expected -88 to 88");
  EXPECT_CONTAINS(error_of(with("/means/maxs", {100, 1, 1})), "expected -88 to 88");
  EXPECT_CONTAINS(error_of(with("/scales/codebook/7", 1e300)), "out of range");
  EXPECT_CONTAINS(error_of(with("/scales/codebook/7", nullptr)), "codebook");
  EXPECT_CONTAINS(error_of(with("/means/mins", {50, 0, 0})), "above the maximum");
  EXPECT_CONTAINS(error_of(with("/quats/encoding", "euler")), "expected \"quaternion_packed\"");
  {
    const Messages messages;
    EXPECT_EQ(error_of(with("/coordinateSystem", "RFU")), "accepted");
    EXPECT_THAT(messages.warnings(), testing::Contains(testing::HasSubstr("\"coordinateSystem\"")));
  }
  {
    const Messages messages;
    EXPECT_EQ(error_of(with("/model", "2dgs")), "accepted");
    EXPECT_THAT(messages.warnings(), testing::Contains(testing::HasSubstr("unknown model \"2dgs\"")));
  }
  {
    const Messages messages;
    nlohmann::json harmless = with("/model", "default");
    harmless["extras"] = {{"name", "mug"}};
    EXPECT_EQ(error_of(harmless), "accepted");
    EXPECT_THAT(messages.warnings(), testing::IsEmpty());
  }
  ByteImage other{64, 64, {}};
  other.rgba.assign(4 * 64 * 64, 255);
  ASSERT_TRUE(WriteWholeFile(folder / "other.webp", *EncodeWebp(other), false).ok());
  EXPECT_CONTAINS(error_of(with("/sh0/files/0", "other.webp")), "other pictures have");
  EXPECT_CONTAINS(error_of(with("/shN/files/0", "quats.webp")), "expected 192, 512 or 960");
  EXPECT_CONTAINS(error_of(with("/shN/files/1", "quats.webp")), "labels beyond");
  const std::string zip = FileBytes(folder / "a.sog");
  for (const size_t size : {size_t{3}, size_t{100}, zip.size() / 2, zip.size() - 10}) {
    EXPECT_FALSE(ReadBothWays(ReadSog, BlocksOfSog, InputFile::FromBytes("a.sog", zip.substr(0, size))).ok()) << size;
  }
  std::string damaged = zip;
  damaged[zip.size() / 2] = static_cast<char>(damaged[zip.size() / 2] ^ 0x10);
  EXPECT_CONTAINS(ReadBothWays(ReadSog, BlocksOfSog, InputFile::FromBytes("a.sog", damaged)).error().message,
                  "damaged");
  EXPECT_FALSE(Read(folder / "a.sog", {.max_gaussians = 1999}).ok());
}

// Its size, its Gaussians and what it says about itself: `info` wants all of them.
TEST(Sog, AnArchiveIsReadOnce) {
  const TestFolder folder;
  ASSERT_TRUE(WriteSog(folder / "a.sog", RandomCloud(20'000, 3, 1), {}).ok());
  const uint64_t before = BytesAskedFor();
  const auto file = OpenedSplat::Open(folder / "a.sog");
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(file->bytes(), std::filesystem::file_size(folder / "a.sog"));
  EXPECT_TRUE(file->Read().ok());
  EXPECT_TRUE(file->format()->describe(file->input()).ok());
  EXPECT_LT(BytesAskedFor() - before, file->bytes() + file->bytes() / 4);
}

}  // namespace
}  // namespace anchorsplat
