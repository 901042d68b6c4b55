#include "tensors/tensor_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "core/source_dir_for_test.h"
#include "tensors/tensor_bytes_for_test.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;

std::string TestPath(const std::string& name) { return SourceDirForTest().string() + "/testdata/tensors/" + name; }

TensorFile OpenOrDie(const std::string& name) {
  Result<TensorFile> file = TensorFile::Open(TestPath(name));
  if (!file.ok()) throw std::runtime_error(file.error().message);
  return *std::move(file);
}

std::vector<std::string> Names(const TensorFile& file) {
  std::vector<std::string> names;
  for (const TensorEntry& tensor : file.tensors()) names.push_back(tensor.name);
  return names;
}

// The values of scripts/make_tensor_testdata.py.
std::vector<float> Ramp(int t, int count) {
  std::vector<float> values;
  for (int i = 0; i < count; ++i) values.push_back(static_cast<float>(t) + static_cast<float>(i) / 16);
  return values;
}

std::vector<float> Floats(const TensorFile& file, const std::string& name, const std::vector<int64_t>& shape) {
  const Result<Float32Values> values = file.ReadFloat32(name, shape);
  if (!values.ok()) throw std::runtime_error(values.error().message);
  return {values->values().begin(), values->values().end()};
}

void ExpectStateDict(const TensorFile& file) {
  EXPECT_THAT(Names(file), testing::ElementsAre("embedding.0.weight", "embedding.0.bias", "embedding.1.running_mean",
                                                "embedding.1.num_batches_tracked"));
  EXPECT_EQ(Floats(file, "embedding.0.weight", {4, 3}), Ramp(0, 12));
  EXPECT_EQ(Floats(file, "embedding.0.bias", {4}), Ramp(1, 4));
  EXPECT_EQ(Floats(file, "embedding.1.running_mean", {4}), Ramp(2, 4));
  const TensorEntry* counter = file.Find("embedding.1.num_batches_tracked");
  ASSERT_NE(counter, nullptr);
  EXPECT_EQ(counter->type, TensorType::kInt64);
  EXPECT_TRUE(counter->shape.empty());
  EXPECT_THAT(*CopyInt64(*counter), testing::ElementsAre(7));
}

TEST(TensorFile, ReadsAStateDictWithMetadataAttribute) {
  const TensorFile file = OpenOrDie("state_dict.pth");
  ExpectStateDict(file);
  EXPECT_TRUE(file.scalars().empty());
  EXPECT_TRUE(file.ReadFloat32("embedding.0.weight", std::vector<int64_t>{4, 3})->is_view());
}

TEST(TensorFile, ReadsTheContainerFromBeforePyTorch16) { ExpectStateDict(OpenOrDie("legacy.pth")); }

TEST(TensorFile, ReadsPickleProtocol4) { ExpectStateDict(OpenOrDie("protocol4.pth")); }

TEST(TensorFile, UnwrapsStateDictAndModulePrefixAndKeepsScalars) {
  const TensorFile file = OpenOrDie("wrapped.pth");
  ExpectStateDict(file);
  const std::map<std::string, TensorFileScalar> expected = {
      {"epoch", int64_t{12}}, {"best", 31.25},   {"arch", std::string("ptv3")}, {"finished", true}, {"note", {}},
      {"betas.0", 0.9},       {"betas.1", 0.999}};
  EXPECT_EQ(file.scalars(), expected);
}

TEST(TensorFile, HonoursOffsetsAndStrides) {
  const TensorFile file = OpenOrDie("views.pth");
  const std::vector<float> base = Ramp(0, 24);
  EXPECT_EQ(Floats(file, "base", {6, 4}), base);
  EXPECT_EQ(Floats(file, "rows", {2, 4}), std::vector<float>(base.begin() + 8, base.begin() + 16));
  std::vector<float> transposed;
  for (size_t c = 0; c < 4; ++c) {
    for (size_t r = 0; r < 6; ++r) transposed.push_back(base[4 * r + c]);
  }
  EXPECT_EQ(Floats(file, "transposed", {4, 6}), transposed);
  EXPECT_EQ(Floats(file, "column", {6}), std::vector<float>(transposed.begin() + 6, transposed.begin() + 12));
  EXPECT_EQ(Floats(file, "second", {3, 2}),
            (std::vector<float>{base[1], base[3], base[9], base[11], base[17], base[19]}));
  std::vector<float> repeated;
  for (int i = 0; i < 5; ++i) repeated.insert(repeated.end(), base.begin(), base.begin() + 4);
  EXPECT_EQ(Floats(file, "repeated", {5, 4}), repeated);
  EXPECT_TRUE(Floats(file, "empty", {0, 4}).empty());
  EXPECT_EQ(Floats(file, "scalar", {}), std::vector<float>{base[23]});
  EXPECT_TRUE(file.ReadFloat32("rows", std::vector<int64_t>{2, 4})->is_view());
  EXPECT_FALSE(file.ReadFloat32("transposed", std::vector<int64_t>{4, 6})->is_view());
  EXPECT_EQ(file.Find("rows")->data, file.Find("base")->data + 32) << "shared storage is stored once";
}

TEST(TensorFile, ReadsEveryElementType) {
  const TensorFile file = OpenOrDie("types.pth");
  EXPECT_EQ(file.tensors().size(), 13u);
  for (const TensorEntry& tensor : file.tensors()) {
    EXPECT_EQ(tensor.name, TypeName(tensor.type));
    EXPECT_THAT(tensor.shape, testing::ElementsAre(3, 2));
  }
  for (const char* name : {"float64", "float32", "float16", "bfloat16"}) {
    EXPECT_EQ(Floats(file, name, {3, 2}), Ramp(1, 6)) << name;
  }
  for (const char* name : {"int64", "int32", "int16", "int8", "uint8", "bool", "uint16", "uint32", "uint64"}) {
    EXPECT_THAT(*CopyInt64(*file.Find(name)), testing::Each(1)) << name;
    const Result<Float32Values> values = file.ReadFloat32(name, std::vector<int64_t>{3, 2});
    ASSERT_FALSE(values.ok());
    EXPECT_THAT(values.error().message, HasSubstr("types.pth: tensor \"" + std::string(name) + "\" holds " + name));
  }
}

TEST(TensorFile, ReadsParameters) {
  const TensorFile file = OpenOrDie("parameters.pth");
  EXPECT_THAT(Names(file), testing::ElementsAre("parameter", "same", "frozen"));
  EXPECT_EQ(Floats(file, "parameter", {2, 2}), Ramp(0, 4));
  EXPECT_EQ(file.Find("same")->data, file.Find("parameter")->data);
  EXPECT_EQ(Floats(file, "frozen", {2}), Ramp(1, 2));
}

TEST(TensorFile, ReadsTheLayoutOfGsplatCheckpoints) {
  const TensorFile file = OpenOrDie("ckpt_degree3.pt");
  EXPECT_THAT(Names(file), testing::UnorderedElementsAre("splats.means", "splats.scales", "splats.quats",
                                                         "splats.opacities", "splats.sh0", "splats.shN"));
  EXPECT_EQ(file.scalars().at("step"), TensorFileScalar(int64_t{14999}));
  EXPECT_EQ(Floats(file, "splats.shN", {5, 15, 3}), Ramp(5, 225));
}

TEST(TensorFile, SurvivesMoving) {
  TensorFile first = OpenOrDie("state_dict.pth");
  const std::byte* data = first.Find("embedding.0.bias")->data;
  TensorFile second = std::move(first);
  TensorFile third = OpenOrDie("views.pth");
  third = std::move(second);
  EXPECT_EQ(third.Find("embedding.0.bias")->data, data);
  ExpectStateDict(third);
}

TEST(TensorFile, MessagesSayWhatWasExpected) {
  const TensorFile file = OpenOrDie("state_dict.pth");
  EXPECT_EQ(file.Find("embedding"), nullptr);
  EXPECT_THAT(file.Require("head.weight").error().message,
              HasSubstr("state_dict.pth: has no tensor \"head.weight\" (it holds 4 tensors, the first is "
                        "\"embedding.0.weight\")"));
  EXPECT_THAT(file.Require("embedding.0.bias", std::vector<int64_t>{5, 1}).error().message,
              HasSubstr("tensor \"embedding.0.bias\" has shape [4], expected [5, 1]"));
  EXPECT_EQ(file.Require("head.weight").error().code, ErrorCode::kBadFile);
}

TEST(TensorFile, OpeningFailsWithTheRightCode) {
  EXPECT_EQ(TensorFile::Open(TestPath("nowhere.pth")).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(TensorFile::Open(TestPath("")).error().code, ErrorCode::kIo);
  EXPECT_EQ(TensorFile::Open("/dev/null").error().code, ErrorCode::kIo);
  EXPECT_THAT(TensorFile::FromBytes({}, "x").error().message, HasSubstr("x: is empty"));
  EXPECT_THAT(TensorFile::FromBytes(tensor_bytes::ToBuffer("ply\nformat ascii 1.0\n"), "x").error().message,
              HasSubstr("neither a PyTorch checkpoint"));
}

TEST(TensorFile, ConvertsSpecialHalfValuesExactly) {
  const auto convert = [](TensorType type, uint16_t bits) {
    TensorEntry entry;
    entry.type = type;
    entry.data = reinterpret_cast<const std::byte*>(&bits);
    return (*CopyFloat32(entry))[0];
  };
  EXPECT_EQ(convert(TensorType::kFloat16, 0x3c00), 1.0f);
  EXPECT_EQ(convert(TensorType::kFloat16, 0xc000), -2.0f);
  EXPECT_EQ(convert(TensorType::kFloat16, 0x7bff), 65504.0f);
  EXPECT_EQ(convert(TensorType::kFloat16, 0x0001), 0x1p-24f);
  EXPECT_EQ(convert(TensorType::kFloat16, 0x83ff), -0x3ffp-24f);
  EXPECT_EQ(convert(TensorType::kFloat16, 0x0400), 0x1p-14f);
  EXPECT_TRUE(std::signbit(convert(TensorType::kFloat16, 0x8000)));
  EXPECT_EQ(convert(TensorType::kFloat16, 0xfc00), -INFINITY);
  EXPECT_TRUE(std::isnan(convert(TensorType::kFloat16, 0x7e01)));
  EXPECT_EQ(convert(TensorType::kBFloat16, 0x3f80), 1.0f);
  EXPECT_EQ(convert(TensorType::kBFloat16, 0xff80), -INFINITY);
}

TEST(TensorFile, CheckFiniteNamesTensorAndIndex) {
  std::vector<float> values(10000, 1.5f);
  EXPECT_TRUE(CheckFinite("w", values).ok());
  values[9876] = -INFINITY;
  EXPECT_EQ(CheckFinite("w", values).error().message, "tensor \"w\" holds infinity at index 9876");
  values[77] = NAN;
  EXPECT_EQ(CheckFinite("w", values).error().message, "tensor \"w\" holds NaN at index 77");
  EXPECT_TRUE(CheckFinite("w", std::span<const float>()).ok());
}

TEST(TensorFile, LargeStridedTensorsGatherTheSameOnEveryPath) {
  // Large enough for several parallel ranges, whose starts fall inside rows.
  std::vector<float> values(3 * 700 * 801);
  for (size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i);
  TensorEntry entry = MakeEntry("x", {3, 700, 801}, values);
  std::swap(entry.shape[0], entry.shape[2]);
  std::swap(entry.strides[0], entry.strides[2]);
  const Buffer<float> copy = *CopyFloat32(entry);
  const Buffer<std::byte> bytes = *CopyContiguous(entry);
  ASSERT_EQ(bytes.size(), copy.size() * 4);
  EXPECT_EQ(std::memcmp(bytes.data(), copy.data(), bytes.size()), 0);
  size_t i = 0;
  for (size_t c = 0; c < 801; ++c) {
    for (size_t b = 0; b < 700; ++b) {
      for (size_t a = 0; a < 3; ++a) ASSERT_EQ(copy[i++], values[(a * 700 + b) * 801 + c]);
    }
  }
}

}  // namespace
}  // namespace anchorsplat
