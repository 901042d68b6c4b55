#include "formats/tables/table_writers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <sstream>
#include <string>

#include "formats/random_cloud_for_test.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"
#include "io/zip_archive.h"

namespace anchorsplat {
namespace {

TEST(TableWriters, CsvReadsBackAsTheSameFloats) {
  const TestFolder folder;
  GaussianCloud cloud = RandomCloud(10'000, 1, 3);
  cloud.opacity_logits[1] = -std::numeric_limits<float>::infinity();
  ASSERT_TRUE(WriteCsv(folder / "a.csv", cloud).ok());
  std::istringstream text(FileBytes(folder / "a.csv"));
  std::string line;
  std::getline(text, line);
  EXPECT_EQ(line,
            "x,y,z,f_dc_0,f_dc_1,f_dc_2,f_rest_0,f_rest_1,f_rest_2,f_rest_3,f_rest_4,f_rest_5,f_rest_6,f_rest_7,"
            "f_rest_8,opacity,scale_0,scale_1,scale_2,rot_0,rot_1,rot_2,rot_3");
  for (size_t i = 0; i < 10'000; ++i) {
    ASSERT_TRUE(std::getline(text, line));
    std::istringstream row(line);
    std::vector<float> values;
    for (std::string cell; std::getline(row, cell, ',');) values.push_back(std::strtof(cell.c_str(), nullptr));
    ASSERT_EQ(values.size(), 23u);
    ASSERT_EQ(values[0], cloud.means[3 * i]);
    ASSERT_EQ(values[7], cloud.sh[12 * i + 6]);  // red of the second coefficient
    ASSERT_EQ(values[9], cloud.sh[12 * i + 4]);  // green of the first
    ASSERT_EQ(values[15], cloud.opacity_logits[i]);
    ASSERT_EQ(values[22], cloud.quats[4 * i + 3]);
  }
  EXPECT_FALSE(std::getline(text, line));
}

TEST(TableWriters, NpzHoldsTheArrays) {
  const TestFolder folder;
  for (int degree = 0; degree <= 3; ++degree) {
    const GaussianCloud cloud = RandomCloud(123, degree, 3);
    ASSERT_TRUE(WriteNpz(folder / "a.npz", cloud, {.overwrite = true}).ok());
    EXPECT_EQ(std::filesystem::file_size(folder / "a.npz"), PredictedNpzSize(123, degree));
    const auto zip = ZipReader::Open("a.npz", FileBytes(folder / "a.npz"));
    ASSERT_TRUE(zip.ok()) << zip.error().message;
    const std::string sh = *zip->Read("sh.npy", 1 << 20);
    EXPECT_EQ(sh.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8));
    const size_t header = 10 + static_cast<uint8_t>(sh[8]) + 256u * static_cast<uint8_t>(sh[9]);
    EXPECT_EQ(header % 64, 0u);
    EXPECT_EQ(sh[header - 1], '\n');
    const std::string shape = "'shape': (123, " + std::to_string(ShCoefficients(degree)) + ", 3)";
    EXPECT_NE(sh.find(shape), std::string::npos);
    ASSERT_EQ(sh.size(), header + 4 * cloud.sh.size());
    EXPECT_EQ(std::memcmp(sh.data() + header, cloud.sh.data(), 4 * cloud.sh.size()), 0);
    EXPECT_EQ(zip->Read("opacity_logits.npy", 1 << 20)->substr(10, 61).find("(123,)") != std::string::npos, true);
  }
  EXPECT_EQ(WriteNpz(folder / "a.npz", RandomCloud(1, 0, 1)).error().code, ErrorCode::kExists);
}

}  // namespace
}  // namespace anchorsplat
