#include "tensors/safetensors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/text.h"
#include "io/folder_for_test.h"
#include "tensors/tensor_bytes_for_test.h"

namespace anchorsplat {
namespace {

using namespace testing;       // NOLINT: matchers
using namespace tensor_bytes;  // NOLINT: builders

std::string ErrorOf(const std::string& bytes) {
  const Result<TensorFile> file = TensorFile::FromBytes(ToBuffer(bytes), "x.safetensors");
  if (file.ok()) return "no error";
  EXPECT_EQ(file.error().code, ErrorCode::kBadFile);
  EXPECT_THAT(file.error().message, StartsWith("x.safetensors: "));
  return file.error().message;
}

std::string HeaderError(const std::string& header, size_t data_bytes = 16) {
  return ErrorOf(MakeSafetensors(header, std::string(data_bytes, '\0')));
}

// A header of one tensor "w".
std::string One(const std::string& dtype, const std::string& shape, const std::string& offsets) {
  return Cat(R"({"w":{"dtype":")", dtype, R"(","shape":)", shape, R"(,"data_offsets":)", offsets, "}}");
}

TEST(Safetensors, ReadsHandMadeFile) {
  const std::string header = R"({"__metadata__":{"k":"20"},"b":{"dtype":"F32","shape":[2],"data_offsets":[8,16]},)"
                             R"("a":{"data_offsets":[0,8],"shape":[],"dtype":"I64"}}   )";
  const std::string data = Little(int64_t{-3}) + Little(1.5f) + Little(-2.0f);
  const Result<TensorFile> file = TensorFile::FromBytes(ToBuffer(MakeSafetensors(header, data)), "x");
  ASSERT_TRUE(file.ok()) << file.error().message;
  ASSERT_EQ(file->tensors().size(), 2u);
  EXPECT_EQ(file->tensors()[0].name, "b") << "in the order of the header";
  EXPECT_THAT(file->metadata(), ElementsAre(Pair("k", "20")));
  EXPECT_THAT(*CopyInt64(*file->Find("a")), ElementsAre(-3));
  EXPECT_THAT(*CopyFloat32(*file->Find("b")), ElementsAre(1.5f, -2.0f));
}

TEST(Safetensors, EmptyFilesAreLegal) {
  EXPECT_EQ(HeaderError("{}", 0), "no error");
  EXPECT_EQ(HeaderError(R"({"__metadata__":{}})", 0), "no error");
  EXPECT_EQ(HeaderError(One("F32", "[0,7]", "[0,0]"), 0), "no error");
}

TEST(Safetensors, RefusesWhatTheFormatForbids) {
  EXPECT_EQ(HeaderError(One("F32", "[2,2]", "[0,16]")), "no error");
  EXPECT_THAT(HeaderError(One("F32", "[2,2]", "[0,12]")), HasSubstr("12 bytes of data, which do not fit it"));
  EXPECT_THAT(HeaderError(One("F16", "[2,2]", "[0,16]")), HasSubstr("do not fit it"));
  EXPECT_THAT(HeaderError(One("F32", "[4]", "[16,0]")), HasSubstr("lies at bytes 16 to 0 of the 16"));
  EXPECT_THAT(HeaderError(One("F32", "[5]", "[0,20]")), HasSubstr("cut off or damaged"));
  EXPECT_THAT(HeaderError(One("F32", "[3]", "[0,12]")), HasSubstr("4 bytes after its last tensor"));
  EXPECT_THAT(HeaderError(One("F32", "[3]", "[4,16]")), HasSubstr("leave a hole at byte 0"));
  EXPECT_THAT(HeaderError(One("F32", "[4294967296,4294967296]", "[0,16]")), HasSubstr("do not fit it"));
  EXPECT_THAT(HeaderError(One("F32", "[-4]", "[0,16]")), HasSubstr("a negative number"));
  EXPECT_THAT(HeaderError(One("F32", "[4.0]", "[0,16]")), HasSubstr("a fraction"));
  EXPECT_THAT(HeaderError(One("F32", "[18446744073709551615]", "[0,16]")), HasSubstr("a number where \"shape\""));
  EXPECT_THAT(HeaderError(One("F32", "[[4]]", "[0,16]")), HasSubstr("a list"));
  EXPECT_THAT(HeaderError(One("F32", "4", "[0,16]")), HasSubstr("a number where \"shape\" cannot have it"));
  EXPECT_THAT(HeaderError(One("F32", "[4]", "[0,16,16]")), HasSubstr("two data_offsets"));
  EXPECT_THAT(HeaderError(One("F8_E4M3", "[16]", "[0,16]")), HasSubstr("unknown dtype \"F8_E4M3\""));
  EXPECT_THAT(HeaderError(R"({"w":{"dtype":"F32","shape":[4]}})"), HasSubstr("needs dtype, shape and two"));
  EXPECT_THAT(HeaderError(R"({"w":[1]})"), HasSubstr("a list where \"w\""));
  EXPECT_THAT(HeaderError(R"({"w":null})"), HasSubstr("null where \"w\""));
  EXPECT_THAT(HeaderError(R"({"w":{"dtype":{}}})"), HasSubstr("an object where \"dtype\""));
  EXPECT_THAT(HeaderError(R"({"__metadata__":{"a":1}})"), HasSubstr("a number where \"a\""));
  EXPECT_THAT(HeaderError(R"({"__metadata__":"a"})"), HasSubstr("text where \"__metadata__\""));
  EXPECT_THAT(HeaderError(R"({"w":{},"w":{}})"), HasSubstr("needs dtype"));
  EXPECT_THAT(HeaderError(R"({"__metadata__":{},"__metadata__":{}})"), HasSubstr("stands there twice"));
  EXPECT_THAT(HeaderError(R"({"w":{"dtype":"F32","dtype":"F32"}})"), HasSubstr("stands there twice"));
  EXPECT_THAT(HeaderError("{\"w\":"), HasSubstr("broken JSON"));
  EXPECT_THAT(HeaderError("{} x"), HasSubstr("broken JSON"));
  EXPECT_THAT(HeaderError("{\"\xff\":{}}"), HasSubstr("byte 11: safetensors header: broken JSON"));
  EXPECT_THAT(HeaderError("{" + std::string(100000, '[')), HasSubstr("broken JSON"));
  EXPECT_THAT(HeaderError(One("F32", Cat("[", std::string(100000, '[')), "[0,16]")), HasSubstr("a list where"));
  const std::string overlap = R"({"a":{"dtype":"U8","shape":[10],"data_offsets":[0,10]},)"
                              R"("b":{"dtype":"U8","shape":[8],"data_offsets":[8,16]}})";
  EXPECT_THAT(HeaderError(overlap), HasSubstr("overlap or leave a hole at byte 10"));
  EXPECT_THAT(ErrorOf(Little(uint64_t{500}) + "{}"), HasSubstr("its header has 500 bytes, the file 10"));
  EXPECT_THAT(ErrorOf(Little(uint64_t{100'000'001}) + "{}"), HasSubstr("neither a PyTorch checkpoint"));
  EXPECT_THAT(ErrorOf(Little(~uint64_t{0}) + "{}"), HasSubstr("neither a PyTorch checkpoint"));
}

TEST(Safetensors, EveryCutOfAFileIsAnError) {
  const std::string whole = MakeSafetensors(One("F32", "[2,2]", "[0,16]"), std::string(16, 'x'));
  for (size_t size = 0; size < whole.size(); ++size) EXPECT_NE(ErrorOf(whole.substr(0, size)), "no error") << size;
}

TEST(Safetensors, WrittenFilesReadBackBitForBit) {
  const TestFolder folder;
  const auto path = folder / "written.safetensors";
  const std::vector<float> weight = {1, -2, 3e-40f, std::numeric_limits<float>::quiet_NaN(), -0.0f, 6};
  const std::vector<int64_t> counter = {41};
  const std::vector<float> nothing;
  const uint16_t half[3] = {0x3c00, 0x0001, 0xfbff};
  TensorEntry transposed = MakeEntry("transposed", {2, 3}, weight);
  transposed.shape = {3, 2};
  transposed.strides = {1, 3};
  TensorEntry halves;
  halves.name = "half \"quoted\" \xc3\xa9";
  halves.type = TensorType::kFloat16;
  halves.shape = {3};
  halves.strides = {1};
  halves.data = reinterpret_cast<const std::byte*>(half);
  const std::vector<TensorEntry> tensors = {halves, MakeEntry("weight", {2, 3}, weight), transposed,
                                            MakeEntry("counter", {}, counter), MakeEntry("nothing", {0, 4}, nothing)};
  const std::map<std::string, std::string> metadata = {{"K", "20"}, {"licence", "Apache-2.0 \xe2\x80\x93 \n\"x\""}};
  ASSERT_TRUE(WriteSafetensors(path, tensors, metadata, {.overwrite = true}).ok());

  const Result<TensorFile> file = TensorFile::Open(path);
  ASSERT_TRUE(file.ok()) << file.error().message;
  EXPECT_EQ(file->metadata(), metadata);
  ASSERT_EQ(file->tensors().size(), tensors.size());
  for (size_t i = 0; i < tensors.size(); ++i) {
    const TensorEntry& read = file->tensors()[i];
    EXPECT_EQ(read.name, tensors[i].name);
    EXPECT_EQ(read.type, tensors[i].type);
    EXPECT_EQ(read.shape, tensors[i].shape);
    EXPECT_EQ(*CopyContiguous(read), *CopyContiguous(tensors[i])) << read.name;
    EXPECT_EQ(reinterpret_cast<uintptr_t>(read.data) % static_cast<uintptr_t>(ItemSize(read.type)), 0u) << read.name;
  }
  EXPECT_EQ(WriteSafetensors(path, tensors, metadata).error().code, ErrorCode::kExists);
}

TEST(Safetensors, ConvertsACheckpoint) {
  const TestFolder folder;
  const auto path = folder / "converted.safetensors";
  const Result<TensorFile> source = TensorFile::FromBytes(ToBuffer(ReadTestFile("views.pth")), "views.pth");
  ASSERT_TRUE(source.ok());
  ASSERT_TRUE(WriteSafetensors(path, source->tensors(), {}, {.overwrite = true}).ok());
  const Result<TensorFile> file = TensorFile::Open(path);
  ASSERT_TRUE(file.ok()) << file.error().message;
  ASSERT_EQ(file->tensors().size(), source->tensors().size());
  for (const TensorEntry& tensor : source->tensors()) {
    EXPECT_EQ(*CopyFloat32(*file->Find(tensor.name)), *CopyFloat32(tensor)) << tensor.name;
  }
}

TEST(Safetensors, WriterRefusesWhatCannotBeReadBack) {
  const TestFolder folder;
  const std::vector<float> values = {1, 2};
  const auto error = [&](const std::vector<TensorEntry>& tensors, const std::map<std::string, std::string>& metadata) {
    const Status status = WriteSafetensors(folder / "refused.safetensors", tensors, metadata);
    EXPECT_EQ(status.error().code, ErrorCode::kBadArgument);
    return status.error().message;
  };
  EXPECT_THAT(error({MakeEntry("a", {2}, values), MakeEntry("a", {2}, values)}, {}), HasSubstr("is there twice"));
  EXPECT_THAT(error({MakeEntry("__metadata__", {2}, values)}, {}), HasSubstr("reserves"));
  EXPECT_THAT(error({MakeEntry("\xc3", {2}, values)}, {}), HasSubstr("not UTF-8"));
  EXPECT_THAT(error({MakeEntry("a", {-2}, values)}, {}), HasSubstr("impossible shape"));
  EXPECT_THAT(error({}, {{"k", "\x80"}}), HasSubstr("metadata \"k\" is not UTF-8"));
  EXPECT_FALSE(std::filesystem::exists(folder / "refused.safetensors"));
}

}  // namespace
}  // namespace anchorsplat
