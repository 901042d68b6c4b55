#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "core/half.h"
#include "core/messages_for_test.h"
#include "core/parallel.h"
#include "formats/attribute_error.h"
#include "formats/axes.h"
#include "formats/both_ways_for_test.h"
#include "formats/random_cloud_for_test.h"
#include "formats/splat_order.h"
#include "formats/spz/spz_blocks.h"
#include "formats/spz/spz_reader.h"
#include "formats/spz/spz_writer.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"
#include "io/inflating_reader.h"
#include "io/little_endian.h"

namespace anchorsplat {
namespace {

Result<GaussianCloud> Read(const std::filesystem::path& path, const ReadLimits& limits = {}) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const InputFile file, InputFile::Open(path));
  return ReadBothWays(ReadSpz, BlocksOfSpz, file, limits);
}

std::string ErrorOf(std::string bytes) {
  const auto cloud = ReadBothWays(ReadSpz, BlocksOfSpz, InputFile::FromBytes("a.spz", std::move(bytes)));
  return cloud.ok() ? "accepted" : cloud.error().message;
}

std::string Gzip(const std::string& raw) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, 16 + MAX_WBITS, 9, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&stream, raw.size()) + 32, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(raw.data()));
  stream.avail_in = static_cast<uInt>(raw.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

std::string RawHeader(uint32_t version, uint32_t count, uint8_t degree, uint8_t bits, uint8_t flags) {
  const uint32_t numbers[3] = {0x5053474e, version, count};
  std::string out(reinterpret_cast<const char*>(numbers), sizeof numbers);
  for (const uint8_t byte : {degree, bits, flags, uint8_t{0}}) out += static_cast<char>(byte);
  return out;
}

// Values within what the format can hold.
GaussianCloud Tame(int64_t n, int degree, uint64_t seed) {
  GaussianCloud cloud = RandomCloud(n, degree, seed);
  for (float& x : cloud.log_scales) x -= 5;
  for (int64_t i = 0; i < n; ++i) {
    for (int64_t k = 0; k < cloud.sh_stride(); ++k) {
      float& x = cloud.sh[static_cast<size_t>(i * cloud.sh_stride() + k)];
      x = k < 3 ? std::clamp(x, -3.3f, 3.3f) : std::clamp(x * 0.2f, -1.0f, 0.9f);
    }
  }
  return cloud;
}

TEST(Spz, RoundTripWithinTheStepsOfTheFormat) {
  const TestFolder folder;
  for (const int version : {3, 4}) {
    for (int degree = 0; degree <= kMaxShDegree; ++degree) {
      for (const int64_t n : {1, 100, 150'000}) {
        if (n > 100 && degree == 1) continue;  // enough
        GaussianCloud cloud = Tame(n, degree, static_cast<uint64_t>(n + degree));
        if (degree >= 2) cloud.render_mode = degree == 2 ? RenderMode::kAntialiased : RenderMode::kMip;
        ASSERT_TRUE(WriteSpz(folder / "a.spz", cloud, {.overwrite = true, .spz_version = version}).ok());
        const auto read = Read(folder / "a.spz");
        ASSERT_TRUE(read.ok()) << read.error().message;
        ASSERT_EQ(read->sh_degree, degree);
        EXPECT_EQ(read->render_mode,
                  degree >= 2 ? std::optional(RenderMode::kAntialiased) : std::nullopt);  // which one is not said
        const auto error = CompareAttributes(*read, cloud);
        ASSERT_TRUE(error.ok());
        EXPECT_EQ(error->compared, n);
        EXPECT_LT(error->means.max, 0.9 / 4096);
        EXPECT_LT(error->log_scales.max, 0.5 / 16 + 1e-5);
        EXPECT_LT(error->rotations.max, 0.01);
        EXPECT_LT(error->opacities.max, 0.5 / 255 + 1e-6);
        EXPECT_LT(error->colors.max, 0.2820948 * 0.5 / 38 + 1e-4);
        EXPECT_LE(error->harmonics.max, (degree > 1 ? 1.0 / 16 : 1.0 / 32) + 1e-6);
        EXPECT_GE(error->harmonics.max, degree > 0 && n > 50 ? 0.02 : 0.0);
      }
    }
  }
}

TEST(Spz, BytesOfOneGaussian) {
  // Versions 1–3 side by side, by hand from the specification: x right, y up, z back.
  std::string body;
  const std::string fixed("\x00\x18\x00\x00\xe8\xff\x00\x10\x00", 9);  // 1.5, −1.5, 1 with 12 bits
  const std::string halves("\x00\x3e\x00\xbe\x00\x3c", 6);
  const std::string middle("\x80\xff\x80\x00\xa0\x90\x00", 7);
  const std::string xyz("\xff\x80\x80", 3);
  const uint32_t three = 0u << 30 | (512u | 255u) << 20 | 0u << 10 | 511u;  // x largest; y, z, w
  const std::string smallest(reinterpret_cast<const char*>(&three), 4);
  std::string sh(9, '\x80');
  sh[0] = '\xc0';  // Y_1,−1 (odd in y) of red
  sh[8] = '\x00';  // Y_1,1 (odd in x) of blue
  for (const uint32_t version : {1u, 2u, 3u}) {
    const std::string file = Gzip(RawHeader(version, 1, 1, 12, version == 2 ? 1 : 0) + (version == 1 ? halves : fixed) +
                                  middle + (version < 3 ? xyz : smallest) + sh);
    const auto cloud = ReadBothWays(ReadSpz, BlocksOfSpz, InputFile::FromBytes("a.spz", file));
    ASSERT_TRUE(cloud.ok()) << cloud.error().message;
    EXPECT_THAT(cloud->means, testing::ElementsAre(1.5f, 1.5f, -1.0f));
    EXPECT_THAT(cloud->log_scales, testing::ElementsAre(0.0f, -1.0f, -10.0f));
    EXPECT_NEAR(1 / (1 + std::exp(-cloud->opacity_logits[0])), 128.0 / 255, 1e-6);
    EXPECT_NEAR(cloud->sh[0], 127.5 / 38.25, 1e-5);
    EXPECT_NEAR(cloud->sh[2], -127.5 / 38.25, 1e-5);
    EXPECT_EQ(cloud->sh[3], -0.5f);
    EXPECT_EQ(cloud->sh[11], -1.0f);
    EXPECT_EQ(cloud->render_mode.has_value(), version == 2);
    if (version < 3) {
      EXPECT_NEAR(cloud->quats[1], 1, 1e-6);
    } else {
      const double y = -255.0 / 511 * std::sqrt(0.5), w = std::sqrt(0.5);
      EXPECT_NEAR(cloud->quats[0], w, 1e-6);
      EXPECT_NEAR(cloud->quats[1], std::sqrt(1 - y * y - w * w), 1e-6);
      EXPECT_NEAR(cloud->quats[2], -y, 1e-6);
      EXPECT_NEAR(cloud->quats[3], 0, 1e-6);
    }
  }
}

TEST(Spz, DegreeFourIsReadAsThree) {
  std::string sh(72, '\x80');
  sh[44] = '\x81';
  sh[45] = '\xff';
  const std::string file = Gzip(RawHeader(3, 1, 4, 12, 0) + std::string(9 + 7 + 4, '\x80') + sh);
  const auto cloud = ReadBothWays(ReadSpz, BlocksOfSpz, InputFile::FromBytes("a.spz", file));
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  EXPECT_EQ(cloud->sh_degree, 3);
  EXPECT_EQ(std::fabs(cloud->sh[47]), 1.0f / 128);
}

TEST(Spz, FractionalBitsFollowTheScene) {
  const TestFolder folder;
  for (const auto& [scale, allowed] :
       {std::pair(1e-3f, 1e-7), std::pair(1.0f, 1e-4), std::pair(100.0f, 2.2e-4), std::pair(1e5f, 0.2)}) {
    GaussianCloud cloud = Tame(500, 0, 8);
    for (float& x : cloud.means) x *= scale;
    ASSERT_TRUE(WriteSpz(folder / "a.spz", cloud, {.overwrite = true}).ok());
    EXPECT_LT(CompareAttributes(*Read(folder / "a.spz"), cloud)->means.max, allowed) << scale;
  }
}

TEST(Spz, SameBytesForAnyNumberOfThreads) {
  const TestFolder folder;
  const GaussianCloud cloud = Tame(200'000, 1, 8);
  for (const int version : {3, 4}) {
    SetThreadCount(1);
    ASSERT_TRUE(WriteSpz(folder / "one.spz", cloud, {.overwrite = true, .spz_version = version}).ok());
    SetThreadCount(3);
    ASSERT_TRUE(WriteSpz(folder / "three.spz", cloud, {.overwrite = true, .spz_version = version}).ok());
    SetThreadCount(0);
    EXPECT_EQ(FileBytes(folder / "one.spz"), FileBytes(folder / "three.spz"));
  }
}

TEST(Spz, OrderWhenAsked) {
  const TestFolder folder;
  const GaussianCloud cloud = Tame(2000, 1, 8);
  ASSERT_TRUE(WriteSpz(folder / "a.spz", cloud, {.order = SplatOrder::kMorton}).ok());
  EXPECT_LT(CompareAttributes(*Read(folder / "a.spz"), cloud, MortonOrder(cloud))->means.max, 1e-3);
}

TEST(Spz, EdgeValuesStayDefined) {
  const TestFolder folder;
  GaussianCloud cloud = Tame(8, 1, 4);
  const float inf = std::numeric_limits<float>::infinity();
  for (float* value :
       {&cloud.means[0], &cloud.log_scales[0], &cloud.quats[0], &cloud.sh[0], &cloud.sh[5], &cloud.opacity_logits[0]}) {
    *value = std::nanf("");
  }
  cloud.means[3] = -inf;
  cloud.log_scales[6] = -inf;
  cloud.sh[12 * 3 + 4] = inf;
  std::fill_n(&cloud.quats[16], 4, 0.0f);
  ASSERT_TRUE(WriteSpz(folder / "a.spz", cloud).ok());
  const auto read = Read(folder / "a.spz");
  ASSERT_TRUE(read.ok());
  for (int64_t i = 0; i < 8; ++i) EXPECT_TRUE(IsUsable(*read, i)) << i;
  EXPECT_EQ(read->log_scales[6], -10);
  EXPECT_EQ(read->quats[16], 1);
  EXPECT_EQ(read->sh[5], 0);
  EXPECT_EQ(CompareAttributes(*read, cloud)->left_out, 3);
}

TEST(Spz, HalfFloats) {
  for (const auto& [bits, value] :
       {std::pair(0x0000, 0.0f), std::pair(0x3c00, 1.0f), std::pair(0xc000, -2.0f), std::pair(0x7bff, 65504.0f),
        std::pair(0x0001, 5.9604645e-8f), std::pair(0x0400, 6.1035156e-5f), std::pair(0x7c00, INFINITY)}) {
    const uint8_t bytes[2] = {static_cast<uint8_t>(bits), static_cast<uint8_t>(bits >> 8)};
    EXPECT_EQ(FloatFromHalf(LoadLittleEndian<uint16_t>(bytes)), value);
  }
  const uint8_t nan[2] = {1, 0x7c};
  EXPECT_TRUE(std::isnan(FloatFromHalf(LoadLittleEndian<uint16_t>(nan))));
}

TEST(Spz, RefusesDamageLiesAndBombs) {
  const TestFolder folder;
  const auto expect = [](const std::string& message, const std::string& part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  const GaussianCloud cloud = Tame(3000, 1, 8);
  ASSERT_TRUE(WriteSpz(folder / "3.spz", cloud, {.spz_version = 3}).ok());
  ASSERT_TRUE(WriteSpz(folder / "4.spz", cloud, {.spz_version = 4}).ok());
  const std::string v3 = FileBytes(folder / "3.spz"), v4 = FileBytes(folder / "4.spz");
  for (const std::string& good : {v3, v4}) {
    EXPECT_EQ(ErrorOf(good), "accepted");
    for (const size_t size : {size_t{0}, size_t{1}, size_t{5}, size_t{20}, good.size() / 2, good.size() - 40}) {
      EXPECT_NE(ErrorOf(good.substr(0, size)), "accepted") << size;
    }
  }
  const auto changed = [](std::string bytes, size_t at, char to) {
    bytes[at] = to;
    return bytes;
  };
  expect(ErrorOf(changed(v4, 0, 'X')), "NGSP");
  expect(ErrorOf(changed(v4, 4, 9)), "version 9");
  expect(ErrorOf(changed(v4, 12, 5)), "SH degree 5");
  expect(ErrorOf(changed(v4, 13, 25)), "25 fractional bits");
  expect(ErrorOf(changed(v4, 15, 5)), "5 streams");
  expect(ErrorOf(changed(v4, 16, 31)), "byte 31");
  expect(ErrorOf(changed(v4, 11, 100)), "limit");
  expect(ErrorOf(changed(v4, 11, 5)), "bomb");
  expect(ErrorOf(changed(v4, 9, 1)), "stream 0");
  expect(ErrorOf(changed(v4, 39, 1)), "stream 0");
  expect(ErrorOf(changed(v4, 32 + 96 + 20, static_cast<char>(v4[32 + 96 + 20] ^ 0x55))), "damaged");
  // 2 million Gaussians of zeros in a few kilobytes.
  const std::string bomb = Gzip(RawHeader(3, 2'000'000, 3, 12, 0) + std::string(130'000'000, '\0'));
  expect(ErrorOf(bomb), "bomb");
  expect(ErrorOf(Gzip(RawHeader(4, 1, 0, 12, 0) + std::string(20, '\0'))), "version 4 in a gzip stream");
  expect(ErrorOf(Gzip(RawHeader(3, 2, 0, 12, 0) + std::string(39, '\0'))), "ends before");
  // A splat of one Gaussian is 20 bytes of values and not one more, and nothing follows it.
  expect(ErrorOf(Gzip(RawHeader(3, 1, 0, 12, 0) + std::string(20, '\0'))), "accepted");
  expect(ErrorOf(Gzip(RawHeader(3, 1, 0, 12, 0) + std::string(21, '\0'))), "continues after its data");
  expect(ErrorOf(v3 + "x"), "bytes after the gzip stream");
  expect(ErrorOf(v3.substr(0, v3.size() - 1)), "ends before its gzip stream");
  expect(ErrorOf(changed(v3, v3.size() - 6, static_cast<char>(v3[v3.size() - 6] ^ 1))), "damaged");  // the checksum
  EXPECT_EQ(Read(folder / "4.spz", {.max_gaussians = 2999}).error().code, ErrorCode::kBadFile);
  EXPECT_EQ(WriteSpz(folder / "b.spz", cloud, {.spz_version = 2}).error().code, ErrorCode::kBadArgument);
  EXPECT_EQ(folder.Entries(), 2);
}

std::string Record(uint32_t id, const std::string& payload) {
  const uint32_t head[2] = {id, static_cast<uint32_t>(payload.size())};
  return std::string(reinterpret_cast<const char*>(head), sizeof head) + payload;
}

std::string Number(uint32_t number) { return {reinterpret_cast<const char*>(&number), sizeof number}; }

constexpr uint32_t kOrbit = 0xADBE0002, kSystem = 0xADBE0003, kPlace = 0x4E530001;

// A file with records: of version 4 between header and table, of version 3 behind the sections.
std::string WithRecords(const GaussianCloud& cloud, int version, const std::string& records, uint8_t flags = 2) {
  const TestFolder folder;
  EXPECT_TRUE(WriteSpz(folder / "a.spz", cloud, {.spz_version = version}).ok());
  std::string bytes = FileBytes(folder / "a.spz");
  if (version == 4) {
    const auto table = static_cast<uint32_t>(32 + records.size());
    std::memcpy(bytes.data() + 16, &table, sizeof table);
    bytes[14] = static_cast<char>(flags);
    return bytes.insert(32, records);
  }
  const size_t size = 16 + static_cast<size_t>(cloud.size()) * (20 + 3 * static_cast<size_t>(cloud.coefficients() - 1));
  std::string raw(size, '\0');
  const InputFile file = InputFile::FromBytes("a.spz", bytes);
  EXPECT_TRUE(OpenGzip(file, 0)->Read(raw.data(), raw.size()).ok());
  raw[14] = static_cast<char>(flags);
  return Gzip(raw + records);
}

TEST(Spz, AxesThatARecordDeclares) {
  const GaussianCloud cloud = Tame(500, 3, 6);
  const GaussianCloud plain =
      *ReadBothWays(ReadSpz, BlocksOfSpz, InputFile::FromBytes("a.spz", WithRecords(cloud, 4, "", 0)));
  const char* systems[] = {"LDB", "RDB", "LUB", "RUB", "LDF", "RDF", "LUF", "RUF",
                           "LBD", "RBD", "LBU", "RBU", "LFD", "RFD", "LFU", "RFU"};
  for (uint32_t k = 0; k < 16; ++k) {
    const Axes axes = *AxesFromName(systems[k]);
    // Stored along these axes: the writer takes RDF to RUB.
    GaussianCloud stored = cloud;
    TurnAxes(stored, Concatenate(TurnBetween(kRdf, axes), TurnBetween(kRub, kRdf)));
    for (const int version : {3, 4}) {
      const std::string bytes = WithRecords(stored, version, Record(kSystem, Number(k + 1)));
      const InputFile file = InputFile::FromBytes("a.spz", bytes);
      const Messages messages;
      const auto read = ReadBothWays(ReadSpz, BlocksOfSpz, file);
      ASSERT_TRUE(read.ok()) << read.error().message;
      EXPECT_THAT(messages.warnings(), testing::IsEmpty());
      const auto error = CompareAttributes(*read, cloud);
      EXPECT_EQ(error->compared, 500);
      EXPECT_LT(error->means.max, 0.9 / 4096) << systems[k];
      EXPECT_LT(error->log_scales.max, 0.5 / 16 + 1e-5) << systems[k];
      EXPECT_LT(error->rotations.max, 0.01) << systems[k];
      EXPECT_LT(error->harmonics.max, 0.2) << systems[k];  // steps of a sixteenth, in other directions
      EXPECT_EQ(*DeclaredAxesOfSpz(file), axes);
      const auto facts = DescribeSpz(file);
      ASSERT_TRUE(facts.ok());
      EXPECT_THAT(facts->all(), testing::Contains(testing::Pair("axes", systems[k])));
      if (k == 3) ExpectSameCloud(*read, plain);
    }
  }
}

TEST(Spz, RecordsOfExtensions) {
  const GaussianCloud cloud = Tame(100, 1, 6);
  const float limits[] = {-0.5f, 1.25f, 0.75f};
  const std::string orbit = Record(kOrbit, {reinterpret_cast<const char*>(limits), sizeof limits});
  const std::string place = Record(kPlace, std::string(80, '\x01')), unknown = Record(0x12345678, "hello");
  for (const int version : {3, 4}) {
    const auto said = [&](const std::string& records, GaussianCloud* out = nullptr, uint8_t flags = 2) {
      const Messages messages;
      const auto read = ReadBothWays(ReadSpz, BlocksOfSpz,
                                     InputFile::FromBytes("a.spz", WithRecords(cloud, version, records, flags)));
      EXPECT_TRUE(read.ok()) << read.error().message;
      if (read.ok() && out != nullptr) *out = *read;
      return messages.warnings();
    };
    GaussianCloud read;
    EXPECT_THAT(said(orbit + place, &read), testing::IsEmpty());
    EXPECT_THAT(read.comments, testing::ElementsAre(testing::HasSubstr("SPZ_ADOBE_safe_orbit_camera"),
                                                    testing::HasSubstr("SPZ_NIANTIC_georeference")));
    // They go into another SPZ as they came.
    const TestFolder folder;
    for (const int other : {3, 4}) {
      ASSERT_TRUE(WriteSpz(folder / "b.spz", read, {.overwrite = true, .spz_version = other}).ok());
      EXPECT_EQ(Read(folder / "b.spz")->comments, read.comments);
      EXPECT_TRUE(other == 3 || FileBytes(folder / "b.spz").find(orbit + place) != std::string::npos);
    }
    EXPECT_THAT(said(unknown + orbit, &read), testing::ElementsAre(testing::HasSubstr("0x12345678 of 5 bytes")));
    EXPECT_EQ(read.comments.size(), 1u);
    // A place is one in the axes that it was said for.
    EXPECT_THAT(said(Record(kSystem, Number(6)) + place, &read),
                testing::ElementsAre(testing::HasSubstr("georeference) is not used: dropped")));
    EXPECT_TRUE(read.comments.empty());
    EXPECT_THAT(said(Record(kOrbit, "short")), testing::ElementsAre(testing::HasSubstr("is not used: dropped")));
    EXPECT_THAT(said("", nullptr, 0x12), testing::ElementsAre(testing::HasSubstr("unknown flags")));
    EXPECT_THAT(said(Record(kSystem, Number(0))), testing::IsEmpty());

    const auto error_of = [&](const std::string& records) { return ErrorOf(WithRecords(cloud, version, records)); };
    EXPECT_THAT(error_of(Record(kSystem, Number(17))), testing::HasSubstr("is 17, expected 1 to 16"));
    EXPECT_THAT(error_of(Record(kSystem, "ab")), testing::HasSubstr("has 2 bytes, expected 4"));
    EXPECT_THAT(error_of(Record(kSystem, Number(4)) + Record(kSystem, Number(6))),
                testing::HasSubstr("says RUB and RDF"));
    EXPECT_NE(error_of(orbit.substr(0, 13)), "accepted");
    EXPECT_NE(error_of(orbit.substr(0, 5)), "accepted");
    std::string longer = orbit;
    longer[7] = '\x7f';
    EXPECT_NE(error_of(longer), "accepted");
  }
  std::string far = WithRecords(cloud, 4, orbit);
  far[19] = '\x7f';
  EXPECT_THAT(ErrorOf(far), testing::HasSubstr("its table at byte"));
}

// Sections are looked at side by side, and the error is still that of the first one, wherever in it.
TEST(Spz, BlocksNameTheFirstDamagedSection) {
  const TestFolder folder;
  const int64_t n = 300'000;
  for (const int version : {3, 4}) {
    ASSERT_TRUE(WriteSpz(folder / "a.spz", Tame(n, 1, 8), {.overwrite = true, .spz_version = version}).ok());
    std::string bytes = FileBytes(folder / "a.spz");
    EXPECT_EQ(ErrorOf(bytes), "accepted");
    // Behind the first rows of the means, and the harmonics. So many bytes are no value that happens to be another, as
    // a few in a stream without a checksum.
    constexpr size_t kDamaged = 300'000;
    size_t means = bytes.size() / 3, harmonics = bytes.size() - kDamaged;
    if (version == 4) {
      std::array<uint64_t, 12> table;  // compressed and raw size of each section
      std::memcpy(table.data(), bytes.data() + 32, sizeof table);
      means = 32 + sizeof table + table[0] - kDamaged;
      harmonics = bytes.size() - table[10];
    }
    bytes.replace(harmonics, kDamaged, kDamaged, '\xff');
    const std::string later = ErrorOf(bytes);
    EXPECT_NE(later, "accepted");
    bytes.replace(means, kDamaged, kDamaged, '\xff');
    const std::string first = ErrorOf(bytes);
    EXPECT_NE(first, "accepted");
    EXPECT_NE(first, later);
    EXPECT_NE(ErrorOf(bytes.substr(0, harmonics)), "accepted");
  }
}

}  // namespace
}  // namespace anchorsplat
