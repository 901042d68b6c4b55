#include "formats/ply/ply_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "core/messages_for_test.h"
#include "core/text.h"
#include "formats/ply/ply_header.h"
#include "formats/random_cloud_for_test.h"

namespace anchorsplat {
namespace {

// A property of the files this test makes; `value` gives row i's number. Without it, some number.
struct TestProperty {
  std::string type;
  std::string name;
  std::function<float(int64_t)> value;
};

// The properties of a cloud, in the order INRIA writes them.
std::vector<TestProperty> Properties(const GaussianCloud& cloud, const std::string& type) {
  std::vector<TestProperty> list;
  const auto add = [&](std::string name, const Buffer<float>& array, int64_t width, int64_t component) {
    list.push_back({type, std::move(name), [&array, width, component](int64_t i) {
                      return array[static_cast<size_t>(i * width + component)];
                    }});
  };
  for (int k = 0; k < 3; ++k) add(std::string(1, "xyz"[k]), cloud.means, 3, k);
  for (int k = 0; k < 3; ++k) add(Cat("f_dc_", k), cloud.sh, cloud.sh_stride(), k);
  const int rest = cloud.coefficients() - 1;
  for (int k = 0; k < 3 * rest; ++k) {  // f_rest index = rgb·rest + (coefficient − 1)
    add(Cat("f_rest_", k), cloud.sh, cloud.sh_stride(), 3 * (1 + k % rest) + k / rest);
  }
  add("opacity", cloud.opacity_logits, 1, 0);
  for (int k = 0; k < 3; ++k) add(Cat("scale_", k), cloud.log_scales, 3, k);
  for (int k = 0; k < 4; ++k) add(Cat("rot_", k), cloud.quats, 4, k);
  return list;
}

struct TestFile {
  std::string encoding = "binary_little_endian";
  std::string line_end = "\n";
  std::vector<TestProperty> properties;
  std::string header_lines;  // after "format"
  bool lists = false;        // a list property inside the vertices, elements with lists before and after them

  std::string Bytes(int64_t count) const;

 private:
  template <typename T>
  void Put(std::string& out, T value) const {
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    if (encoding == "binary_big_endian") std::reverse(bytes, bytes + sizeof(T));
    out.append(bytes, sizeof(T));
  }
  void PutNumber(std::string& out, const std::string& type, double value) const;
  void PutList(std::string& out, int64_t items) const;
};

void TestFile::PutNumber(std::string& out, const std::string& type, double value) const {
  if (encoding == "ascii") {
    char text[40];
    std::snprintf(text, sizeof text, "%.9g ", value);
    out += text;
  } else if (type == "double" || type == "float64") {
    Put(out, value);
  } else if (type == "float" || type == "float32") {
    Put(out, static_cast<float>(value));
  } else if (type == "uchar" || type == "char") {
    Put(out, static_cast<uint8_t>(7));
  } else if (type == "short" || type == "ushort") {
    Put(out, static_cast<uint16_t>(777));
  } else {
    Put(out, static_cast<uint32_t>(77777));
  }
}

void TestFile::PutList(std::string& out, int64_t items) const {
  if (encoding == "ascii") {
    out += Cat(items, ' ');
    for (int64_t k = 0; k < items; ++k) out += Cat(k, ' ');
    return;
  }
  Put(out, static_cast<uint8_t>(items));
  for (int64_t k = 0; k < items; ++k) Put(out, static_cast<uint16_t>(k));
}

std::string TestFile::Bytes(int64_t count) const {
  const std::string extra =
      lists ? "element around 3\nproperty list uchar ushort numbers\nproperty double weight\n" : "";
  std::string header =
      "ply\nformat " + encoding + " 1.0\n" + header_lines + extra + Cat("element vertex ", count, "\n");
  if (lists) header += "property list uchar ushort inside\n";
  for (const TestProperty& p : properties) header += "property " + p.type + " " + p.name + "\n";
  if (lists) header += "element face 1\nproperty list uchar ushort vertex_indices\n";
  header += "end_header\n";
  std::string out;
  for (const char c : header) out += c == '\n' ? line_end : std::string(1, c);
  const auto end_row = [&] {
    if (encoding == "ascii") out += line_end;
  };
  for (int64_t i = 0; lists && i < 3; ++i) {
    PutList(out, 5 * i);
    PutNumber(out, "double", 0.5);
    end_row();
  }
  for (int64_t i = 0; i < count; ++i) {
    if (lists) PutList(out, i % 4);
    for (const TestProperty& p : properties) PutNumber(out, p.type, p.value ? p.value(i) : 42);
    end_row();
  }
  if (lists) {
    PutList(out, 3);
    end_row();
  }
  return out;
}

Result<GaussianCloud> ReadBytes(std::string bytes) {
  return ReadPly(InputFile::FromBytes("test.ply", std::move(bytes)));
}

std::string ErrorOf(const std::string& bytes) {
  const auto cloud = ReadBytes(bytes);
  if (cloud.ok()) return "accepted";
  EXPECT_EQ(cloud.error().code, ErrorCode::kBadFile);
  EXPECT_EQ(cloud.error().message.substr(0, 10), "test.ply: ") << cloud.error().message;
  return cloud.error().message;
}

#define EXPECT_ERROR(bytes, part) EXPECT_NE(ErrorOf(bytes).find(part), std::string::npos) << ErrorOf(bytes)

TEST(PlyReader, EveryDegreeEncodingTypeAndLineEnd) {
  for (int degree = 0; degree <= kMaxShDegree; ++degree) {
    const GaussianCloud cloud = RandomCloud(37, degree, static_cast<uint64_t>(degree));
    for (const char* encoding : {"binary_little_endian", "binary_big_endian", "ascii"}) {
      for (const char* type : {"float", "double", "float32", "float64"}) {
        for (const char* line_end : {"\n", "\r\n", "\r"}) {
          for (const bool lists : {false, true}) {
            const TestFile file{encoding, line_end, Properties(cloud, type), "", lists};
            const auto read = ReadBytes(file.Bytes(cloud.size()));
            ASSERT_TRUE(read.ok()) << read.error().message;
            SCOPED_TRACE(Cat(degree, " ", encoding, " ", type, " lists ", lists, " line end ", line_end[0] == '\r'));
            ExpectSameCloud(*read, cloud);
          }
        }
      }
    }
  }
}

TEST(PlyReader, AnyOrderWithExtrasOfEveryType) {
  const GaussianCloud cloud = RandomCloud(50, 2, 9);
  Random random(1);
  for (const char* encoding : {"binary_little_endian", "binary_big_endian", "ascii"}) {
    TestFile file{encoding, "\n", Properties(cloud, "float"), "", false};
    for (const char* type : {"char", "uchar", "short", "ushort", "int", "uint", "float", "double"}) {
      file.properties.push_back({type, Cat("extra_", type), {}});
    }
    for (size_t k = file.properties.size() - 1; k > 0; --k) {
      std::swap(file.properties[k], file.properties[static_cast<size_t>(random.Below(static_cast<int64_t>(k) + 1))]);
    }
    const auto read = ReadBytes(file.Bytes(cloud.size()));
    ASSERT_TRUE(read.ok()) << read.error().message;
    ExpectSameCloud(*read, cloud);
  }
}

// In the file all red coefficients come first; in the cloud rgb of each coefficient are neighbours.
TEST(PlyReader, RestIsChannelMajorInTheFile) {
  GaussianCloud cloud = RandomCloud(1, 1, 3);
  TestFile file{"ascii", "\n", Properties(cloud, "float"), "", false};
  for (TestProperty& p : file.properties) {
    if (p.name.starts_with("f_rest_")) p.value = [n = std::stoi(p.name.substr(7))](int64_t) { return float(n); };
  }
  const auto read = ReadBytes(file.Bytes(1));
  ASSERT_TRUE(read.ok());
  const std::vector<float> rest(read->sh.begin() + 3, read->sh.end());
  EXPECT_EQ(rest, (std::vector<float>{0, 3, 6, 1, 4, 7, 2, 5, 8}));
}

TEST(PlyReader, ManyBlocksAndThreads) {
  const GaussianCloud cloud = RandomCloud(60'000, 1, 4);
  const TestFile file{"binary_little_endian", "\n", Properties(cloud, "float"), "", false};
  const auto read = ReadBytes(file.Bytes(cloud.size()));
  ASSERT_TRUE(read.ok());
  ExpectSameCloud(*read, cloud);
}

TEST(PlyReader, CommentsAndRenderMode) {
  const GaussianCloud cloud = RandomCloud(2, 0, 5);
  const auto read_with = [&](const std::string& lines) {
    return ReadBytes(TestFile{"binary_little_endian", "\n", Properties(cloud, "float"), lines, false}.Bytes(2));
  };
  const auto plain = read_with("");
  ASSERT_TRUE(plain.ok());
  EXPECT_FALSE(plain->render_mode.has_value());
  const auto brush = read_with("comment Exported from Brush\nobj_info x 1\ncomment SplatRenderMode: mip\ncomment\n");
  ASSERT_TRUE(brush.ok()) << brush.error().message;
  EXPECT_EQ(brush->render_mode, RenderMode::kMip);
  EXPECT_EQ(brush->comments, (std::vector<std::string>{"Exported from Brush", ""}));
  const auto later = read_with("comment SplatRenderMode: mip\ncomment antialiased 0\n");
  ASSERT_TRUE(later.ok());
  EXPECT_EQ(later->render_mode, RenderMode::kClassic);
}

TEST(PlyHeader, LongHeadersAreRead) {
  const GaussianCloud cloud = RandomCloud(2, 0, 5);
  std::string lines;
  for (int k = 0; k < 5000; ++k) lines += Cat("comment number ", k, "\n");
  const auto read = ReadBytes(TestFile{"ascii", "\r\n", Properties(cloud, "float"), lines, false}.Bytes(2));
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->comments.size(), 5000u);
  for (size_t k = 0; k < 5000; ++k) ASSERT_EQ(read->comments[k], Cat("number ", k));
}

class PlyErrors : public ::testing::Test {
 protected:
  GaussianCloud cloud = RandomCloud(4, 1, 6);
  TestFile file{"binary_little_endian", "\n", Properties(cloud, "float"), "", false};

  std::vector<TestProperty>::iterator Named(const std::string& name) {
    return std::find_if(file.properties.begin(), file.properties.end(),
                        [&](const TestProperty& p) { return p.name == name; });
  }
};

TEST_F(PlyErrors, Header) {
  EXPECT_ERROR("", "is empty");
  EXPECT_ERROR("solid mesh", "is not a PLY file");
  EXPECT_ERROR("plywood\n", "line 1: expected \"ply\"");
  EXPECT_ERROR("ply\nelement vertex 1\nend_header\n", "no \"format\" line");
  EXPECT_ERROR("ply\nformat binary 1.0\n", "line 2: expected ascii, binary_little_endian");
  EXPECT_ERROR("ply\nformat ascii 2.0\n", "expected version 1.0, found \"2.0\"");
  EXPECT_ERROR("ply\nformat ascii 1.0\nformat ascii 1.0\n", "a second \"format\"");
  EXPECT_ERROR("ply\nformat ascii 1.0\nproperty float x\n", "line 3: a property before the first element");
  EXPECT_ERROR("ply\nformat ascii 1.0\nelement vertex -1\n", "expected a count of rows");
  EXPECT_ERROR("ply\nformat ascii 1.0\nelement vertex 99999999999999999999\n", "expected a count of rows");
  EXPECT_ERROR("ply\nformat ascii 1.0\nelement vertex 1x\n", "found \"1x\"");
  EXPECT_ERROR("ply\nformat ascii 1.0\nelement a 1\nelement a 1\n", "a second element \"a\"");
  EXPECT_ERROR("ply\nformat ascii 1.0\nelement a 1\nproperty half x\n", "expected a type");
  EXPECT_ERROR("ply\nformat ascii 1.0\nelement a 1\nproperty list float int x\n", "integer type for the count");
  EXPECT_ERROR("ply\nformat ascii 1.0\nelement a 1\nproperty float\n", "without a name");
  EXPECT_ERROR("ply\nformat ascii 1.0\nelement a 1\nproperty float x y\n", "expected the end of the line");
  EXPECT_ERROR("ply\nformat ascii 1.0\nelement a 1\nproperty float x\nproperty int x\n", "a second property \"x\"");
  EXPECT_ERROR("ply\nformat ascii 1.0\nnonsense\n", "line 3: expected format, comment");
  EXPECT_ERROR("ply\nformat ascii 1.0\nelement vertex 3\n", "no \"end_header\" within");
  EXPECT_ERROR("ply\nformat ascii 1.0\ncomment " + std::string(2 << 20, 'x'),
               "no \"end_header\" within 1,048,576 bytes");
  EXPECT_ERROR("ply\nformat ascii 1.0\nend_header\n", "no element \"vertex\"");
}

TEST_F(PlyErrors, MissingProperty) {
  file.properties.erase(Named("opacity"));
  const std::string bytes = file.Bytes(4);
  EXPECT_EQ(ErrorOf(bytes), Cat("test.ply: byte ", bytes.find("end_header\n") + 11,
                                ": element \"vertex\" has no property \"opacity\" (needed: x y z f_dc_0..2 opacity "
                                "scale_0..2 rot_0..3)"));
}

TEST_F(PlyErrors, EachRequiredPropertyIsNamed) {
  for (const char* name : {"x", "y", "z", "f_dc_0", "f_dc_2", "scale_1", "rot_3"}) {
    file.properties = Properties(cloud, "float");
    file.properties.erase(Named(name));
    EXPECT_ERROR(file.Bytes(4), Cat("has no property \"", name, "\""));
  }
}

TEST_F(PlyErrors, RestCountsAndGaps) {
  file.properties.erase(Named("f_rest_8"));
  EXPECT_ERROR(file.Bytes(4), "has 8 f_rest properties (expected 0, 9, 24 or 45");
  file.properties.push_back({"float", "f_rest_9", {}});
  EXPECT_ERROR(file.Bytes(4), "\"f_rest_9\" of 9 (expected f_rest_0 to f_rest_8 without gaps)");
  file.properties.back().name = "f_rest_08";
  EXPECT_ERROR(file.Bytes(4), "\"f_rest_08\" is not f_rest_ and a number");
  file.properties.back().name = "f_rest_99999999999";
  EXPECT_ERROR(file.Bytes(4), "is not f_rest_ and a number");
}

TEST_F(PlyErrors, TypesOfRequiredProperties) {
  Named("opacity")->type = "uchar";
  EXPECT_ERROR(file.Bytes(4), "property \"opacity\" has type uchar (expected float or double)");
  Named("opacity")->type = "list uchar float";
  EXPECT_ERROR(file.Bytes(4), "property \"opacity\" is a list");
  Named("opacity")->type = "float";
  Named("f_rest_3")->type = "int";
  EXPECT_ERROR(file.Bytes(4), "property \"f_rest_3\" has type int");
}

TEST_F(PlyErrors, OtherKindsOfPly) {
  const std::string points = "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
  EXPECT_ERROR("ply\nformat ascii 1.0\n" + points + "end_header\n1 2 3\n", "is a PLY point cloud without Gaussians");
  EXPECT_ERROR("ply\nformat ascii 1.0\n" + points +
                   "element face 1\nproperty list uchar int vertex_indices\nend_header\n1 2 3\n3 0 0 0\n",
               "is a PLY mesh without Gaussians");
  EXPECT_ERROR("ply\nformat ascii 1.0\nelement chunk 1\nproperty float min_x\n" + points + "end_header\n1\n1 2 3\n",
               "is a compressed PLY");
}

TEST_F(PlyErrors, NoGaussians) { EXPECT_ERROR(file.Bytes(0), "the file has no Gaussians"); }

TEST_F(PlyErrors, EveryTruncationIsAnError) {
  for (const char* encoding : {"binary_little_endian", "binary_big_endian", "ascii"}) {
    for (const bool lists : {false, true}) {
      TestFile made{encoding, "\n", file.properties, "", lists};
      if (encoding[0] == 'a') made.lists = false;
      std::string bytes = made.Bytes(4);
      // Elements after the vertices are not needed; in ASCII the last digits cannot be missed.
      const size_t needed = bytes.size() - (made.lists ? 7 : encoding[0] == 'a' ? 12 : 0);
      for (size_t size = 0; size < needed; ++size) {
        ASSERT_NE(ErrorOf(bytes.substr(0, size)), "accepted") << encoding << " " << size << " of " << bytes.size();
      }
      EXPECT_EQ(ErrorOf(bytes), "accepted");
    }
  }
}

TEST_F(PlyErrors, PromisesAreCheckedBeforeTheyBecomeMemory) {
  for (const char* encoding : {"binary_little_endian", "ascii"}) {
    for (const bool lists : {false, true}) {
      file.encoding = encoding;
      file.lists = lists;
      std::string bytes = file.Bytes(4);
      const size_t at = bytes.find("vertex 4\n");
      for (const char* count : {"5000", "200000000", "9223372036854775807"}) {
        std::string lie = bytes;
        lie.replace(at, 9, Cat("vertex ", count, "\n"));
        const std::string message = ErrorOf(lie);
        EXPECT_TRUE(message.find("the file ends") != std::string::npos ||
                    message.find("more than the limit") != std::string::npos)
            << message;
      }
      std::string lie = bytes;
      if (lists) {
        lie.replace(lie.find("around 3\n"), 9, "around 9223372036854775807\n");
        EXPECT_NE(ErrorOf(lie), "accepted");
      }
    }
  }
  const auto limited = ReadPly(InputFile::FromBytes("test.ply", file.Bytes(4)), ReadLimits{.max_gaussians = 3});
  ASSERT_FALSE(limited.ok());
  EXPECT_NE(limited.error().message.find("4 Gaussians, more than the limit of 3"), std::string::npos);
}

TEST_F(PlyErrors, AsciiRows) {
  file.encoding = "ascii";
  const std::string bytes = file.Bytes(4);
  const size_t body = bytes.find("end_header\n") + 11;
  const auto with_first_word = [&](const std::string& word) {
    return bytes.substr(0, body) + word + bytes.substr(bytes.find(' ', body));
  };
  EXPECT_ERROR(with_first_word("abc"), "property \"x\": expected a number, found \"abc\"");
  EXPECT_ERROR(with_first_word("1e9999"), "expected a number");
  EXPECT_ERROR(with_first_word("1 2"), "expected the end of the line after 23 properties");
  EXPECT_ERROR(with_first_word(""), "the line ends before property \"rot_3\"");
  EXPECT_ERROR(with_first_word(std::string(100, '1')), "expected a number, found \"111");
  for (const char* word : {"+1", "nan", "-inf", "1e300", "1e-300", "1e-400", "-2.5E-9999", "0x1", "."}) {
    const bool number = std::string(word) != "0x1" && std::string(word) != ".";
    EXPECT_EQ(ErrorOf(with_first_word(word)) == "accepted", number) << word;
  }
  for (const char* word : {"1e-400", "-1e-400"}) {
    const auto read = ReadPly(InputFile::FromBytes("test.ply", with_first_word(word)));
    ASSERT_TRUE(read.ok()) << word;
    EXPECT_EQ(read->means[0], 0) << word;
    EXPECT_EQ(std::signbit(read->means[0]), *word == '-') << word;
  }
  // Blank lines between rows are no rows.
  EXPECT_EQ(ErrorOf(bytes.substr(0, body) + "\n \n" + bytes.substr(body)), "accepted");
}

TEST_F(PlyErrors, NegativeListCount) {
  TestFile made = file;
  made.properties.push_back({"list char float", "l", {}});
  std::string bytes = made.Bytes(1);
  // Make room for the list: the writer above put one uchar-sized number for it.
  const size_t header = bytes.find("end_header\n") + 11;
  bytes = bytes.substr(0, header + 23 * 4) + "\xff" + std::string(64, '\0');
  EXPECT_ERROR(bytes, "list property \"l\" has -1 items");
}

TEST(PlyReader, RowsThatTheHeaderKnowsNothingOf) {
  const GaussianCloud cloud = RandomCloud(3, 0, 1);
  TestFile file;
  file.properties = Properties(cloud, "float");
  for (const char* encoding : {"ascii", "binary_little_endian"}) {
    file.encoding = encoding;
    const std::string two = file.Bytes(2), row = file.Bytes(3).substr(two.size());
    const Messages messages;
    ASSERT_TRUE(ReadBytes(two + "\n").ok());
    EXPECT_TRUE(messages.warnings().empty());
    const auto read = ReadBytes(two + row);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->size(), 2);
    ASSERT_EQ(messages.warnings().size(), 1u) << encoding;
    EXPECT_NE(messages.warnings()[0].find("its 2 Gaussians, as the header does not mention"), std::string::npos)
        << messages.warnings()[0];
  }
}

}  // namespace
}  // namespace anchorsplat
