#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "core/activations.h"
#include "core/spherical_harmonics.h"
#include "core/text.h"
#include "formats/both_ways_for_test.h"
#include "formats/extra_properties.h"
#include "formats/ply/ply_blocks.h"
#include "formats/ply/ply_reader.h"
#include "formats/random_cloud_for_test.h"
#include "formats/stored_as.h"

// What other programs write where INRIA's has other properties, or the same ones by other names.
namespace anchorsplat {
namespace {

struct Column {
  std::string type, name;
  std::function<double(int64_t)> value;
};

using Columns = std::vector<Column>;

Columns ColumnsOf(const GaussianCloud& cloud) {
  Columns columns;
  const auto add = [&](const std::string& name, const Buffer<float>& array, int64_t width, int64_t component) {
    columns.push_back({"float", name, [&array, width, component](int64_t i) {
                         return array[static_cast<size_t>(i * width + component)];
                       }});
  };
  for (int k = 0; k < 3; ++k) add(std::string(1, "xyz"[k]), cloud.means, 3, k);
  for (int k = 0; k < 3; ++k) add(Cat("f_dc_", k), cloud.sh, cloud.sh_stride(), k);
  const int rest = cloud.coefficients() - 1;
  for (int k = 0; k < 3 * rest; ++k) add(Cat("f_rest_", k), cloud.sh, cloud.sh_stride(), 3 * (1 + k % rest) + k / rest);
  add("opacity", cloud.opacity_logits, 1, 0);
  for (int k = 0; k < 3; ++k) add(Cat("scale_", k), cloud.log_scales, 3, k);
  for (int k = 0; k < 4; ++k) add(Cat("rot_", k), cloud.quats, 4, k);
  return columns;
}

template <typename T>
void Put(std::string& out, double value) {
  const T number = static_cast<T>(value);
  out.append(reinterpret_cast<const char*>(&number), sizeof number);
}

std::string PlyOf(const Columns& columns, int64_t rows, const std::string& behind = "") {
  std::string out = Cat("ply\nformat binary_little_endian 1.0\nelement vertex ", rows, "\n");
  for (const Column& column : columns) out += "property " + column.type + " " + column.name + "\n";
  out += behind + "end_header\n";
  for (int64_t i = 0; i < rows; ++i) {
    for (const Column& column : columns) {
      const double value = column.value(i);
      if (column.type == "uchar") {
        Put<uint8_t>(out, value);
      } else if (column.type == "ushort") {
        Put<uint16_t>(out, value);
      } else if (column.type == "double") {
        Put<double>(out, value);
      } else {
        Put<float>(out, value);
      }
    }
  }
  return out;
}

Result<GaussianCloud> Read(const std::string& bytes) {
  return ReadBothWays(ReadPly, BlocksOfPly, InputFile::FromBytes("a.ply", bytes));
}

std::string ErrorOf(const Columns& columns) {
  const auto cloud = Read(PlyOf(columns, 3));
  return cloud.ok() ? "accepted" : cloud.error().message;
}

std::map<std::string, std::string> FactsOf(const std::string& bytes) {
  const auto facts = DescribePly(InputFile::FromBytes("a.ply", bytes));
  EXPECT_TRUE(facts.ok());
  return {facts->all().begin(), facts->all().end()};
}

void Remove(Columns& columns, const std::string& beginning) {
  std::erase_if(columns, [&](const Column& column) { return column.name.starts_with(beginning); });
}

#define EXPECT_CONTAINS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

TEST(PlyDialects, TwoScalesAreSurfels) {
  GaussianCloud cloud = RandomCloud(9000, 1, 3);
  Columns columns = ColumnsOf(cloud);
  Remove(columns, "scale_2");
  const std::string bytes = PlyOf(columns, cloud.size());
  const auto read = Read(bytes);
  ASSERT_TRUE(read.ok()) << read.error().message;
  for (size_t i = 2; i < cloud.log_scales.size(); i += 3) cloud.log_scales[i] = -std::numeric_limits<float>::infinity();
  ExpectSameCloud(*read, cloud);
  EXPECT_CONTAINS(FactsOf(bytes)["surfels"], "2DGS");
  Remove(columns, "scale_1");
  EXPECT_CONTAINS(ErrorOf(columns), "has no property \"scale_1\"");
}

TEST(PlyDialects, CloudCompareNames) {
  const GaussianCloud cloud = RandomCloud(100, 2, 3);
  for (const std::string prefix : {"scalar_", "scal_", "scalar_scalar_", "scalar_scal_"}) {
    Columns columns = ColumnsOf(cloud);
    for (Column& column : columns) {
      if (column.name.size() > 1) column.name = prefix + column.name;
    }
    columns.push_back({"float", prefix + "label", [](int64_t i) { return static_cast<double>(i); }});
    const std::string bytes = PlyOf(columns, cloud.size());
    const auto read = Read(bytes);
    ASSERT_TRUE(read.ok()) << read.error().message;
    ExpectSameCloud(*read, cloud);
    EXPECT_CONTAINS(FactsOf(bytes)["names"], "CloudCompare");
    EXPECT_EQ(FactsOf(bytes)["other properties"], prefix + "label");
    columns.push_back({"float", "opacity", [](int64_t) { return 1.0; }});
    EXPECT_CONTAINS(ErrorOf(columns), "property \"opacity\" and \"" + prefix + "opacity\" both map to \"opacity\"");
  }
  EXPECT_FALSE(FactsOf(PlyOf(ColumnsOf(cloud), 3)).contains("names"));
}

TEST(PlyDialects, ColoursInPlaceOfCoefficients) {
  const GaussianCloud cloud = RandomCloud(50, 0, 3);
  for (const auto& [type, full] : {std::pair("uchar", 255), std::pair("ushort", 65535), std::pair("float", 1),
                                   std::pair("float", 255), std::pair("double", 65535)}) {
    Columns columns = ColumnsOf(cloud);
    Remove(columns, "f_dc_");
    int k = 0;
    for (const char* name : {"red", "green", "blue"}) {
      columns.push_back({type, name, [k, full = full](int64_t i) {
                           return full * (k == 0 ? 1.0 : k == 1 ? 0.0 : 0.2 * (i % 6));
                         }});
      ++k;
    }
    const std::string bytes = PlyOf(columns, cloud.size());
    const auto read = Read(bytes);
    ASSERT_TRUE(read.ok()) << read.error().message;
    for (int64_t i = 0; i < cloud.size(); ++i) {
      const float* const dc = read->sh.data() + 3 * i;
      EXPECT_FLOAT_EQ(dc[0], DcFromColor(1));
      EXPECT_FLOAT_EQ(dc[1], DcFromColor(0));
      EXPECT_NEAR(ColorFromDc(dc[2]), 0.2 * static_cast<double>(i % 6), 1e-6);
    }
    EXPECT_TRUE(SameBits(read->means, cloud.means));
    EXPECT_CONTAINS(FactsOf(bytes)["colours"], "red green blue");
    ExtraProperties extras;
    GaussianCloud told = *ReadPlyWithExtras(InputFile::FromBytes("x.ply", bytes), {}, extras);
    EXPECT_EQ(extras.full_color, static_cast<float>(full));
    ConvertToStored(told, {.max_color = static_cast<float>(full)}, extras.full_color);
    ExpectSameCloud(told, *read);
    ConvertToStored(told, {.max_color = 2.0f * static_cast<float>(full)}, extras.full_color);
    EXPECT_NEAR(ColorFromDc(told.sh[0]), 0.5, 1e-6) << "one who knows better";
    // Where both are there, the colours are a preview of the coefficients.
    Columns both = ColumnsOf(cloud);
    both.insert(both.end(), columns.end() - 3, columns.end());
    ExpectSameCloud(*Read(PlyOf(both, cloud.size())), cloud);
  }
}

TEST(PlyDialects, AlphaInPlaceOfOpacity) {
  const GaussianCloud cloud = RandomCloud(5, 0, 3);
  Columns columns = ColumnsOf(cloud);
  Remove(columns, "opacity");
  columns.push_back({"uchar", "alpha", [](int64_t i) { return 51.0 * static_cast<double>(i + 1); }});
  const auto read = Read(PlyOf(columns, cloud.size()));
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_NEAR(Sigmoid(read->opacity_logits[0]), 0.2, 1e-6);
  EXPECT_EQ(read->opacity_logits[4], LogitFromOpacity(1));
  columns.back().type = "float";  // which might be logits
  EXPECT_CONTAINS(ErrorOf(columns), "has no property \"opacity\"");
}

TEST(PlyDialects, DegreeFourIsReadAsThree) {
  const GaussianCloud cloud = RandomCloud(40, 3, 3);
  Columns columns = ColumnsOf(cloud);
  Remove(columns, "f_rest_");
  for (int k = 0; k < 72; ++k) {
    columns.push_back({"float", Cat("f_rest_", k), [&cloud, k](int64_t i) {
                         const int coefficient = 1 + k % 24, channel = k / 24;
                         return coefficient < 16 ? cloud.sh[static_cast<size_t>(48 * i + 3 * coefficient + channel)]
                                                 : 9.0;
                       }});
  }
  const std::string bytes = PlyOf(columns, cloud.size());
  const Messages messages;
  const auto read = Read(bytes);
  ASSERT_TRUE(read.ok()) << read.error().message;
  ExpectSameCloud(*read, cloud);
  ASSERT_FALSE(messages.warnings().empty());
  EXPECT_EQ(messages.warnings().front(), "a.ply: SH degree 4 is read as 3");
  ExtraProperties extras;
  ASSERT_TRUE(ReadPlyWithExtras(InputFile::FromBytes("a.ply", bytes), {}, extras).ok());
  EXPECT_TRUE(extras.properties.empty());
  EXPECT_FALSE(FactsOf(bytes).contains("other properties"));
}

TEST(PlyDialects, FacesBesideGaussiansAreNoMesh) {
  const GaussianCloud cloud = RandomCloud(3, 0, 3);
  std::string bytes = PlyOf(ColumnsOf(cloud), 3, "element face 1\nproperty list uchar int vertex_indices\n");
  bytes += '\3';
  for (const int k : {0, 1, 2}) Put<int>(bytes, k);
  const auto read = Read(bytes);
  ASSERT_TRUE(read.ok()) << read.error().message;
  ExpectSameCloud(*read, cloud);
}

}  // namespace
}  // namespace anchorsplat
