#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "formats/attribute_error.h"
#include "formats/opened_splat.h"
#include "formats/random_cloud_for_test.h"
#include "formats/sog/nearest_centroid.h"
#include "formats/sog/scalar_codebook.h"
#include "formats/sog/sh_palette.h"
#include "formats/sog/sog_reader.h"
#include "formats/sog/sog_writer.h"
#include "formats/splat_order.h"
#include "images/webp_image.h"
#include "io/folder_for_test.h"
#include "io/zip_archive.h"

namespace anchorsplat {
namespace {

Result<GaussianCloud> Read(const std::filesystem::path& path, const ReadLimits& limits = {}) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const InputFile file, InputFile::Open(path));
  return ReadSog(file, limits);
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

std::string Bytes(const std::filesystem::path& path) { return *InputFile::Open(path)->ReadAll(1 << 30); }

#define EXPECT_CONTAINS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

// ---- the scalar codebook

double Distortion(const ScalarCodebook& codebook, const std::vector<float>& values) {
  double sum = 0;
  for (const float x : values) sum += std::pow(x - codebook.values[codebook.IndexOf(x)], 2);
  return sum;
}

TEST(ScalarCodebook, FewValuesAreKept) {
  const std::vector<float> values = {3, 1, 2, 2, 2, 1, std::nanf(""), std::numeric_limits<float>::infinity()};
  const ScalarCodebook codebook = BuildScalarCodebook(values.data(), 8, 1, 1);
  for (const float x : {1.0f, 2.0f, 3.0f}) EXPECT_EQ(codebook.values[codebook.IndexOf(x)], x);
  EXPECT_EQ(codebook.values[codebook.IndexOf(1e9f)], 3);
  EXPECT_EQ(codebook.values[codebook.IndexOf(-std::numeric_limits<float>::infinity())], 1);
  EXPECT_EQ(codebook.IndexOf(std::nanf("")), 0);
  const float one = 5;
  EXPECT_EQ(BuildScalarCodebook(&one, 1, 1, 1).values[0], 5);
  EXPECT_EQ(BuildScalarCodebook(&values[6], 1, 1, 1).values[0], 0);
}

// Plain k-means from quantiles, until nothing changes: a local optimum that the exact solution must not be behind.
TEST(ScalarCodebook, AtLeastAsGoodAsLloyd) {
  for (const uint64_t seed : {1, 2, 3}) {
    Random random(seed);
    std::vector<float> values(30'000);
    for (float& x : values) x = static_cast<float>(std::exp(random.Normal()) * (seed == 3 ? random.Normal() : 1.0));
    std::vector<float> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    ScalarCodebook lloyd;
    for (size_t k = 0; k < 256; ++k) lloyd.values[k] = sorted[(2 * k + 1) * sorted.size() / 512];
    for (int round = 0; round < 300; ++round) {
      std::vector<double> sum(256), count(256);
      for (const float x : values) {
        sum[lloyd.IndexOf(x)] += x;
        ++count[lloyd.IndexOf(x)];
      }
      for (size_t k = 0; k < 256; ++k) {
        if (count[k] > 0) lloyd.values[k] = static_cast<float>(sum[k] / count[k]);
      }
    }
    const ScalarCodebook ours = BuildScalarCodebook(values.data(), 10'000, 3, 3);
    EXPECT_LT(Distortion(ours, values), 1.02 * Distortion(lloyd, values)) << seed;
  }
}

TEST(ScalarCodebook, OneOutlierDoesNotTakeTheResolution) {
  std::vector<float> values(10'000);
  Random random(4);
  for (float& x : values) x = static_cast<float>(random.Normal());
  values[17] = 1e6f;
  const ScalarCodebook codebook = BuildScalarCodebook(values.data(), 10'000, 1, 1);
  EXPECT_GT(codebook.values.back(), 1e5f);
  values.erase(values.begin() + 17);
  EXPECT_LT(Distortion(codebook, values) / 10'000, 0.1);
}

// ---- the SH palette

double Distortion(const GaussianCloud& cloud, const ShPalette& palette) {
  const int64_t width = cloud.sh_stride() - 3;
  double sum = 0;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    for (int64_t k = 0; k < width; ++k) {
      sum += std::pow(cloud.sh[static_cast<size_t>(i * cloud.sh_stride() + 3 + k)] -
                          palette.centroids[static_cast<size_t>(palette.labels[static_cast<size_t>(i)] * width + k)],
                      2);
    }
  }
  return sum;
}

// Ten rounds of k-means over all centroids from random vectors, as slow as it gets.
ShPalette PlainKMeans(const GaussianCloud& cloud, int64_t entries) {
  const int64_t width = cloud.sh_stride() - 3;
  ShPalette palette;
  palette.entries = entries;
  palette.centroids.resize(static_cast<size_t>(entries * width));
  palette.labels.resize(static_cast<size_t>(cloud.size()));
  Random random(99);
  for (int64_t c = 0; c < entries; ++c) {
    std::copy_n(cloud.sh.data() + random.Below(cloud.size()) * cloud.sh_stride() + 3, width,
                palette.centroids.data() + c * width);
  }
  for (int round = 0; round <= 10; ++round) {
    std::vector<double> sums(palette.centroids.size()), counts(static_cast<size_t>(entries));
    for (int64_t i = 0; i < cloud.size(); ++i) {
      const float* x = cloud.sh.data() + i * cloud.sh_stride() + 3;
      double best = std::numeric_limits<double>::infinity();
      for (int64_t c = 0; c < entries; ++c) {
        double distance = 0;
        for (int64_t k = 0; k < width; ++k) {
          distance += std::pow(x[k] - palette.centroids[static_cast<size_t>(c * width + k)], 2);
        }
        if (distance < best) {
          best = distance;
          palette.labels[static_cast<size_t>(i)] = static_cast<uint16_t>(c);
        }
      }
      const auto label = int64_t{palette.labels[static_cast<size_t>(i)]};
      ++counts[static_cast<size_t>(label)];
      for (int64_t k = 0; k < width; ++k) sums[static_cast<size_t>(label * width + k)] += x[k];
    }
    if (round == 10) break;
    for (size_t k = 0; k < sums.size(); ++k) {
      const double count = counts[k / static_cast<size_t>(width)];
      if (count > 0) palette.centroids[k] = static_cast<float>(sums[k] / count);
    }
  }
  return palette;
}

// Clusters of clusters, as SH of a scene are.
GaussianCloud Clustered(int64_t n, int degree, uint64_t seed) {
  GaussianCloud cloud = RandomCloud(n, degree, seed);
  Random random(seed + 1);
  const int64_t centres = 300;
  std::vector<float> centre(static_cast<size_t>(centres * cloud.sh_stride()));
  for (float& x : centre) x = static_cast<float>(0.2 * random.Normal());
  for (int64_t i = 0; i < n; ++i) {
    const int64_t c = random.Below(centres);
    const double spread = 0.02 + 0.1 * random.Uniform();
    for (int64_t k = 0; k < cloud.sh_stride(); ++k) {
      float& x = cloud.sh[static_cast<size_t>(i * cloud.sh_stride() + k)];
      x = centre[static_cast<size_t>(c * cloud.sh_stride() + k)] + static_cast<float>(spread) * x;
    }
  }
  return cloud;
}

TEST(ShPalette, AsGoodAsPlainKMeans) {
  for (int degree = 1; degree <= 2; ++degree) {
    const GaussianCloud cloud = Clustered(6000, degree, 7);
    const ShPalette plain = PlainKMeans(cloud, 512);
    const ShPalette ours = BuildShPalette(cloud, 512, 8);
    EXPECT_EQ(ours.entries, 512);
    EXPECT_LT(Distortion(cloud, ours), 1.05 * Distortion(cloud, plain)) << degree;
  }
}

TEST(ShPalette, RoundsImproveAndThreadsDoNotMatter) {
  const GaussianCloud cloud = Clustered(20'000, 3, 5);
  const ShPalette start = BuildShPalette(cloud, 1024, 0);
  SetThreadCount(1);
  const ShPalette one = BuildShPalette(cloud, 1024, 3);
  SetThreadCount(3);
  const ShPalette three = BuildShPalette(cloud, 1024, 3);
  SetThreadCount(0);
  EXPECT_LT(Distortion(cloud, one), 0.99 * Distortion(cloud, start));
  EXPECT_TRUE(SameBits(one.centroids, three.centroids));
  EXPECT_EQ(one.labels, three.labels);
}

TEST(ShPalette, EnoughEntriesKeepEverything) {
  GaussianCloud cloud = RandomCloud(300, 3, 5);
  const ShPalette palette = BuildShPalette(cloud, 1024, 2);
  EXPECT_EQ(palette.entries, 300);
  EXPECT_LT(std::sqrt(Distortion(cloud, palette) / (300 * 45)), 0.002);  // twelve bits
  std::fill(cloud.sh.begin(), cloud.sh.end(), 0.25f);
  cloud.sh[5] = std::nanf("");
  cloud.sh[53] = std::numeric_limits<float>::infinity();
  const ShPalette flat = BuildShPalette(cloud, 1024, 2);
  EXPECT_LE(flat.entries, 3);
  for (const float x : flat.centroids) EXPECT_TRUE(std::isfinite(x));
  std::fill(cloud.sh.begin(), cloud.sh.end(), 0.0f);
  EXPECT_EQ(BuildShPalette(cloud, 1024, 2).entries, 1);
}

TEST(NearestCentroids, MatchesTheDefinition) {
  Random random(3);
  for (const int64_t width : {16, 32, 48}) {
    for (const int64_t entries : {1, 7, 300}) {
      std::vector<int16_t> points(static_cast<size_t>(50 * width)), centroids(static_cast<size_t>(entries * width));
      for (auto* some : {&points, &centroids}) {
        for (int16_t& x : *some) x = static_cast<int16_t>(random.Below(4095) - 2047);
      }
      std::copy_n(centroids.begin(), width, points.begin());
      std::vector<uint16_t> nearest(50);
      NearestCentroids(points.data(), 50, centroids.data(), entries, width, nearest.data());
      for (size_t i = 0; i < 50; ++i) {
        int64_t best = std::numeric_limits<int64_t>::max(), expected = 0;
        for (int64_t c = 0; c < entries; ++c) {
          int64_t distance = 0;
          for (int64_t k = 0; k < width; ++k) {
            const int64_t d = points[i * static_cast<size_t>(width) + static_cast<size_t>(k)] -
                              centroids[static_cast<size_t>(c * width + k)];
            distance += d * d;
          }
          if (distance < best) {
            best = distance;
            expected = c;
          }
        }
        EXPECT_EQ(nearest[i], expected);
      }
      EXPECT_EQ(nearest[0], 0);
    }
  }
}

// ---- the format

TEST(Sog, RoundTripWithinTheStepsOfTheFormat) {
  const TestFolder folder;
  for (int degree = 0; degree <= kMaxShDegree; ++degree) {
    for (const int64_t n : {1, 5, 3000}) {
      const GaussianCloud cloud = Clustered(n, degree, static_cast<uint64_t>(n));
      const std::filesystem::path path = degree == 2 ? folder / "meta.json" : folder / "a.sog";
      const Status written = WriteSog(path, cloud, {.overwrite = true});
      ASSERT_TRUE(written.ok()) << written.error().message;
      const auto read = Read(path);
      ASSERT_TRUE(read.ok()) << read.error().message;
      EXPECT_EQ(read->sh_degree, degree);
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
  const nlohmann::json good = nlohmann::json::parse(Bytes(folder / "meta.json"));
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
  EXPECT_CONTAINS(error_of(with("/means/files/0", "meta.json")), "no WebP");
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
  ByteImage other{64, 64, {}};
  other.rgba.assign(4 * 64 * 64, 255);
  ASSERT_TRUE(WriteWholeFile(folder / "other.webp", *EncodeWebp(other), false).ok());
  EXPECT_CONTAINS(error_of(with("/sh0/files/0", "other.webp")), "other pictures have");
  EXPECT_CONTAINS(error_of(with("/shN/files/0", "quats.webp")), "expected 192, 512 or 960");
  EXPECT_CONTAINS(error_of(with("/shN/files/1", "quats.webp")), "labels beyond");
  const std::string zip = Bytes(folder / "a.sog");
  for (const size_t size : {size_t{3}, size_t{100}, zip.size() / 2, zip.size() - 10}) {
    EXPECT_FALSE(ReadSog(InputFile::FromBytes("a.sog", zip.substr(0, size))).ok()) << size;
  }
  std::string damaged = zip;
  damaged[zip.size() / 2] = static_cast<char>(damaged[zip.size() / 2] ^ 0x10);
  EXPECT_CONTAINS(ReadSog(InputFile::FromBytes("a.sog", damaged)).error().message, "damaged");
  EXPECT_FALSE(Read(folder / "a.sog", {.max_gaussians = 1999}).ok());
}

TEST(WebpImage, KeepsEveryByte) {
  Random random(1);
  ByteImage image{37, 11, {}};
  image.rgba.resize(4 * 37 * 11);
  for (uint8_t& x : image.rgba) x = static_cast<uint8_t>(random.Below(random.Below(2) == 0 ? 2 : 256));
  const auto bytes = EncodeWebp(image);
  ASSERT_TRUE(bytes.ok());
  const auto read = DecodeWebp("a.webp", *bytes, 1, 1000);
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->rgba, image.rgba);
  EXPECT_FALSE(DecodeWebp("a.webp", *bytes, 1, 406).ok());
  EXPECT_FALSE(DecodeWebp("a.webp", *bytes, 408, 1000).ok());
  EXPECT_FALSE(DecodeWebp("a.webp", bytes->substr(0, bytes->size() - 9), 1, 1000).ok());
  EXPECT_FALSE(EncodeWebp(ByteImage{16384, 1, Buffer<uint8_t>(4 * 16384)}).ok());
}

// An archive with one deflated member "a" that claims `size` bytes.
std::string DeflatedZip(const std::string& text, size_t size) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string packed(deflateBound(&stream, text.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  const auto number = [](uint64_t value, int bytes) {
    std::string out;
    for (int k = 0; k < bytes; ++k, value >>= 8) out += static_cast<char>(value & 255);
    return out;
  };
  const uint64_t crc = crc32(0, reinterpret_cast<const Bytef*>(text.data()), static_cast<uInt>(text.size()));
  const std::string sizes = number(crc, 4) + number(packed.size(), 4) + number(size, 4) + number(1, 2) + number(0, 2);
  const std::string local =
      "PK\x03\x04" + number(20, 2) + number(0, 2) + number(8, 2) + number(0, 4) + sizes + "a" + packed;
  const std::string central = "PK\x01\x02" + number(20, 2) + number(20, 2) + number(0, 2) + number(8, 2) +
                              number(0, 4) + sizes + number(0, 14) + "a";
  return local + central + "PK\x05\x06" + number(0, 4) + number(1, 2) + number(1, 2) + number(central.size(), 4) +
         number(local.size(), 4) + number(0, 2);
}

TEST(ZipArchive, MembersComeBack) {
  const TestFolder folder;
  {
    auto file = OutputFile::Create(folder / "a.zip", false);
    ASSERT_TRUE(file.ok());
    ZipWriter writer(*file);
    const std::string_view parts[] = {"hello ", "", "world"};
    ASSERT_TRUE(writer.Add("a.txt", parts).ok());
    ASSERT_TRUE(writer.Add("b", std::string_view()).ok());
    ASSERT_TRUE(writer.Finish().ok());
    ASSERT_TRUE(file->Commit().ok());
  }
  const auto zip = ZipReader::Open("a.zip", Bytes(folder / "a.zip"));
  ASSERT_TRUE(zip.ok()) << zip.error().message;
  EXPECT_EQ(*zip->Read("a.txt", 100), "hello world");
  EXPECT_EQ(*zip->Read("b", 100), "");
  EXPECT_CONTAINS(zip->Read("a.txt", 5).error().message, "at most");
  EXPECT_CONTAINS(zip->Read("c", 5).error().message, "not in the archive");
  EXPECT_FALSE(ZipReader::Open("a.zip", "PK\x03\x04 and nothing more").ok());
}

TEST(ZipArchive, DeflatedMembers) {
  const std::string text = [] {
    std::string repeated;
    for (int k = 0; k < 300; ++k) repeated += "hello ";
    return repeated;
  }();
  const std::string good = DeflatedZip(text, text.size());
  const auto error_of = [](const std::string& archive) {
    const auto zip = ZipReader::Open("a.zip", archive);
    if (!zip.ok()) return zip.error().message;
    const auto contents = zip->Read("a", 1 << 20);
    return contents.ok() ? *contents : contents.error().message;
  };
  EXPECT_EQ(error_of(good), text);
  EXPECT_CONTAINS(error_of(DeflatedZip(text, text.size() - 1)), "damaged");
  EXPECT_CONTAINS(error_of(DeflatedZip(text, text.size() + 1)), "damaged");
  std::string other = text;
  other[7] = 'x';
  std::string wrong = DeflatedZip(other, text.size());
  wrong.replace(wrong.find("PK\x01\x02") + 16, 4, good.substr(good.find("PK\x01\x02") + 16, 4));
  EXPECT_CONTAINS(error_of(wrong), "check sum");
  std::string method = good;
  method[good.find("PK\x01\x02") + 10] = 12;
  EXPECT_CONTAINS(error_of(method), "method 12");
}

TEST(ZipArchive, BombsAreRefused) {
  const std::string archive = DeflatedZip(std::string(100 << 20, 'x'), 100 << 20);
  const auto zip = ZipReader::Open("a.zip", archive);
  ASSERT_TRUE(zip.ok());
  EXPECT_CONTAINS(zip->Read("a", 1 << 30).error().message, "bomb");
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
