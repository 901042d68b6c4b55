#include "tensors/torch_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "tensors/tensor_bytes_for_test.h"

namespace anchorsplat {
namespace {

using namespace testing;       // NOLINT: matchers
using namespace tensor_bytes;  // NOLINT: builders

std::string ErrorOf(const std::string& bytes) {
  const Result<TensorFile> file = TensorFile::FromBytes(ToBuffer(bytes), "x.pth");
  if (file.ok()) return "no error";
  EXPECT_EQ(file.error().code, ErrorCode::kBadFile);
  EXPECT_THAT(file.error().message, StartsWith("x.pth: "));
  return file.error().message;
}

std::string PickleError(const std::string& body) { return ErrorOf(MakeCheckpoint(Pickle(body))); }

std::string TensorError(const std::string& tensor) { return PickleError(Dict({{"w", tensor}})); }

TEST(TorchFile, HandMadeCheckpointReads) {
  const std::string bytes = MakeCheckpoint(Pickle(Dict({{"w", Tensor({2, 2}, {2, 1})}, {"n", Int(-5)}})));
  const Result<TensorFile> file = TensorFile::FromBytes(ToBuffer(bytes), "x.pth");
  ASSERT_TRUE(file.ok()) << file.error().message;
  EXPECT_EQ(file->tensors().size(), 1u);
  EXPECT_EQ(file->scalars().at("n"), TensorFileScalar(int64_t{-5}));
}

TEST(TorchFile, RefusesEverythingThatIsNotATensorByName) {
  EXPECT_THAT(ErrorOf(ReadTestFile("hostile_call.pth")), HasSubstr("asks for \"__builtin__.print\", but only plain"));
  EXPECT_THAT(ErrorOf(ReadTestFile("complex.pth")), HasSubstr("asks for \"torch.ComplexFloatStorage\""));
  EXPECT_THAT(PickleError("cos\nsystem\n" + Tuple({Text("true")}) + "R"), HasSubstr("asks for \"os.system\""));
  EXPECT_THAT(PickleError(Text("posix") + Text("system") + "\x93)R"), HasSubstr("asks for \"posix.system\""));
  EXPECT_THAT(PickleError("ctorch\nload\n)R"), HasSubstr("asks for \"torch.load\""));
  EXPECT_THAT(PickleError("ctorch.\x1b[2J\nx\n"), HasSubstr("asks for \"torch.\\x1b[2J.x\""));
  EXPECT_THAT(PickleError("ctorch\nFloatStorage\n)R"), HasSubstr("a call of \"torch.FloatStorage\""));
  EXPECT_THAT(PickleError("ccollections\nOrderedDict\n)\x81"), HasSubstr("pickle opcode 0x81 is none"));
  EXPECT_THAT(PickleError("I1\n"), HasSubstr("pickle opcode 0x49 is none"));
}

TEST(TorchFile, RefusesOtherContainers) {
  EXPECT_THAT(ErrorOf(ReadTestFile("compressed.pth")), HasSubstr("is compressed (method 8)"));
  EXPECT_THAT(ErrorOf(ReadTestFile("big_endian.pth")), HasSubstr("big-endian"));
  EXPECT_THAT(ErrorOf(ReadTestFile("pickle.pth")), HasSubstr("is a pickle, but not one of torch.save"));
  EXPECT_THAT(ErrorOf(MakeZip({{"weights.npy", "abc"}})), HasSubstr("no data.pkl inside"));
  EXPECT_THAT(ErrorOf(MakeZip({})), HasSubstr("no data.pkl inside"));
  EXPECT_THAT(ErrorOf(MakeZip({{"a/data.pkl", Pickle("}")}, {"b/data.pkl", Pickle("}")}})),
              HasSubstr("two checkpoints"));
  EXPECT_THAT(ErrorOf(MakeZip({{"a/data.pkl", Pickle("}")}, {"a/constants.pkl", Pickle(")")}})),
              HasSubstr("TorchScript"));
}

TEST(TorchFile, EveryCutOfAFileIsAnError) {
  for (const char* name : {"state_dict.pth", "legacy.pth"}) {
    const std::string whole = ReadTestFile(name);
    ASSERT_EQ(ErrorOf(whole), "no error");
    for (size_t size = 0; size < whole.size(); ++size) {
      EXPECT_NE(ErrorOf(whole.substr(0, size)), "no error") << name << " cut to " << size;
    }
  }
  const std::string whole = ReadTestFile("state_dict.pth");
  EXPECT_THAT(ErrorOf(whole.substr(0, whole.size() / 2)), HasSubstr("no end record: the file is cut off or damaged"));
  EXPECT_THAT(ErrorOf(ReadTestFile("legacy.pth") + "x"), HasSubstr("goes on after its last storage"));
}

TEST(TorchFile, TensorsStayInsideTheirStorage) {
  const std::string inside = "no error";
  EXPECT_EQ(TensorError(Tensor({4}, {1})), inside);
  EXPECT_EQ(TensorError(Tensor({2, 2}, {2, 1})), inside);
  EXPECT_EQ(TensorError(Tensor({}, {}, 3)), inside);
  EXPECT_EQ(TensorError(Tensor({0, 5}, {5, 1}, 4)), inside) << "an empty tensor touches nothing";
  EXPECT_EQ(TensorError(Tensor({1000}, {0})), inside) << "expand() is legal";
  EXPECT_EQ(TensorError(Tensor({1, 2}, {INT64_MAX, 1})), inside) << "the stride of a single row is never used";
  const auto outside = HasSubstr("reaches outside its storage of 4 numbers");
  EXPECT_THAT(TensorError(Tensor({5}, {1})), outside);
  EXPECT_THAT(TensorError(Tensor({4}, {1}, 1)), outside);
  EXPECT_THAT(TensorError(Tensor({}, {}, 4)), outside);
  EXPECT_THAT(TensorError(Tensor({2}, {4})), outside);
  EXPECT_THAT(TensorError(Tensor({2}, {INT64_MAX})), outside);
  EXPECT_THAT(TensorError(Tensor({1}, {1}, INT64_MAX)), outside);
  EXPECT_THAT(TensorError(Tensor({2, 2}, {2, 2})), outside);
  EXPECT_THAT(TensorError(Tensor({int64_t{1} << 40}, {0})), HasSubstr("repeats its 4 stored numbers too often"));
  EXPECT_THAT(TensorError(Tensor({int64_t{1} << 40, int64_t{1} << 40}, {0, 0})), HasSubstr("too many elements"));
  EXPECT_THAT(TensorError(Tensor({-1}, {1})), HasSubstr("none negative"));
  EXPECT_THAT(TensorError(Tensor({2}, {-1})), HasSubstr("none negative"));
  EXPECT_THAT(TensorError(Tensor({2}, {1}, -1)), HasSubstr("not negative"));
  EXPECT_THAT(TensorError(Tensor({2, 2}, {1})), HasSubstr("equally many"));
  EXPECT_THAT(TensorError(Tensor(std::vector<int64_t>(33, 1), std::vector<int64_t>(33, 1))), HasSubstr("at most 32"));
}

TEST(TorchFile, StorageSizesMustAgreeWithTheFile) {
  for (const int64_t stored : {int64_t{3}, int64_t{5}, int64_t{0}, INT64_MAX, INT64_MAX / 4 + 2}) {
    EXPECT_THAT(TensorError(Tensor({1}, {1}, 0, stored)), HasSubstr("but the file has 16 bytes for it"));
  }
  EXPECT_THAT(TensorError(Tensor({1}, {1}, 0, -4)), HasSubstr("a storage needs"));
  EXPECT_THAT(TensorError(Tensor({1}, {1}, 0, 4, "DoubleStorage")), HasSubstr("of 4 float64 numbers"));
  EXPECT_EQ(TensorError(Tensor({8}, {1}, 0, 8, "HalfStorage")), "no error");
  const std::string pickle = Pickle(Dict({{"w", Tensor({1}, {1})}}));
  EXPECT_THAT(ErrorOf(MakeZip({{"x/data.pkl", pickle}})), HasSubstr("tensor \"w\" [1] is stored nowhere (data \"0\")"));
}

TEST(TorchFile, BrokenPicklesAreErrors) {
  EXPECT_THAT(PickleError(""), HasSubstr("stops with something other than one value"));
  EXPECT_THAT(PickleError("NN"), HasSubstr("stops with something other than one value"));
  EXPECT_THAT(PickleError("N("), HasSubstr("stops with something other than one value"));
  EXPECT_THAT(PickleError("t"), HasSubstr("no mark"));
  EXPECT_THAT(PickleError("(u"), HasSubstr("too few values"));
  EXPECT_THAT(PickleError("N(NNu"), HasSubstr("adds items to something that holds none"));
  EXPECT_THAT(PickleError("}(Nu"), HasSubstr("a key without a value"));
  EXPECT_THAT(PickleError("R"), HasSubstr("too few values"));
  EXPECT_THAT(PickleError("N(R"), HasSubstr("too few values")) << "values below a mark are out of reach";
  EXPECT_THAT(PickleError("Q"), HasSubstr("too few values"));
  EXPECT_THAT(PickleError("NQ"), HasSubstr("persistent id"));
  EXPECT_THAT(PickleError(Tuple({Text("module"), "N", "N", "N", "N"}) + "Q"), HasSubstr("persistent id"));
  EXPECT_THAT(PickleError("NNb"), HasSubstr("attributes"));
  EXPECT_THAT(PickleError("h\x05"), HasSubstr("memo slot 5 is read before"));
  EXPECT_THAT(PickleError("Nr\xff\xff\xff\x7f"), HasSubstr("memo slot 2147483647 is out of line"));
  EXPECT_THAT(PickleError("X\xff\xff\xff\xff"), HasSubstr("ends before 4294967295 bytes"));
  EXPECT_THAT(PickleError("\x8d\xff\xff\xff\xff\xff\xff\xff\xff"), HasSubstr("ends before"));
  EXPECT_THAT(PickleError(Text("\xff")), HasSubstr("not UTF-8"));
  EXPECT_THAT(PickleError(Text("\xed\xa0\x80")), HasSubstr("not UTF-8")) << "a surrogate";
  EXPECT_THAT(PickleError("ctorch"), HasSubstr("ends within a name"));
  EXPECT_THAT(PickleError("\x80\x09N"), HasSubstr("pickle protocol 9"));
  EXPECT_THAT(ErrorOf(MakeCheckpoint("\x80\x02}")), HasSubstr("the pickle is cut off"));
  EXPECT_THAT(PickleError("}(NNu"), HasSubstr("a key that is neither text nor a whole number"));
  EXPECT_THAT(PickleError("ctorch._utils\n_rebuild_parameter\n(NN\x88tR"), HasSubstr("a parameter without a tensor"));
  EXPECT_THAT(PickleError("ccollections\nOrderedDict\n(NtR"), HasSubstr("an OrderedDict of something else"));
}

TEST(TorchFile, SelfSimilarGraphsAreBounded) {
  // A dictionary that contains itself.
  EXPECT_THAT(PickleError("}q\x01(" + Text("a") + "h\x01u"), HasSubstr("nested deeper than 32"));
  // Each list holds the one before twice: 2^30 leaves in 200 bytes.
  std::string nested = "Nq" + Little(uint8_t{0});
  for (uint8_t i = 0; i < 30; ++i) nested += "](h" + Little(i) + "h" + Little(i) + "eq" + Little(uint8_t(i + 1));
  // All lists lie on the stack; a tuple takes them, the last one is the bomb.
  EXPECT_THAT(PickleError("(" + nested + "t"), HasSubstr("holds more than 262144 values"));
  // One tensor under very many names.
  std::string many = "(" + Tensor({4}, {1}) + "q\x07";
  EXPECT_EQ(PickleError(many + "h\x07h\x07t"), "no error");
  const std::string storage(1 << 22, '\0');
  many = "(" + Tensor({1 << 20}, {1}, 0, 1 << 20) + "q\x07";
  for (int i = 0; i < 100; ++i) many += "h\x07";
  EXPECT_THAT(ErrorOf(MakeCheckpoint(Pickle(many + "t"), storage)), HasSubstr("shares its storage with too many"));
  EXPECT_THAT(PickleError(std::string((1 << 20) + 9, '(')), HasSubstr("makes more than 1048576 values"));
  EXPECT_THAT(PickleError(std::string((1 << 20) + 9, ')')), HasSubstr("makes more than 1048576 values"));
}

TEST(TorchFile, TwoTensorsOfOneNameAreAnError) {
  EXPECT_THAT(PickleError(Dict({{"w", Tensor({1}, {1})}, {"w", Tensor({2}, {1})}})),
              HasSubstr("holds two tensors named \"w\""));
  EXPECT_THAT(PickleError(Dict({{"w", Tensor({1}, {1})}, {"module.w", Tensor({2}, {1})}})),
              HasSubstr("holds two tensors named \"w\""));
}

// The zip directory: every lie about a size or place is found.
TEST(TorchFile, ZipDirectoryLiesAreErrors) {
  const std::string good = MakeCheckpoint(Pickle(Dict({{"w", Tensor({4}, {1})}})));
  ASSERT_EQ(ErrorOf(good), "no error");
  const size_t end = good.size() - 22;
  const size_t last = good.rfind("PK\x01\x02");
  const auto with = [&](size_t at, const std::string& bytes) {
    std::string changed = good;
    changed.replace(at, bytes.size(), bytes);
    return ErrorOf(changed);
  };
  EXPECT_THAT(with(end + 10, Little(uint16_t{2})), HasSubstr("continues after its 2 entries"));
  EXPECT_THAT(with(end + 10, Little(uint16_t{4})), HasSubstr("of 167 bytes cannot hold 4 entries"));
  EXPECT_THAT(with(end + 10, Little(uint16_t{0xffff})), HasSubstr("cannot hold 65535 entries"));
  EXPECT_THAT(with(last, "PK\x01\x03"), HasSubstr("an entry of the zip directory was expected"));
  EXPECT_THAT(with(end + 16, Little(uint32_t{0xfffffff0})), HasSubstr("lies outside the file"));
  EXPECT_THAT(with(end + 4, Little(uint16_t{1})), HasSubstr("split over several files"));
  EXPECT_THAT(with(last + 8, Little(uint16_t{1})), HasSubstr("is encrypted"));
  EXPECT_THAT(with(last + 10, Little(uint16_t{14})), HasSubstr("is compressed (method 14)"));
  EXPECT_THAT(with(last + 20, Little(uint32_t{15})), HasSubstr("two different sizes"));
  EXPECT_THAT(with(last + 20, Little(uint32_t{1000}) + Little(uint32_t{1000})), HasSubstr("reaches past the end"));
  EXPECT_THAT(with(last + 20, Little(uint32_t{0xffffffff}) + Little(uint32_t{0xffffffff})), HasSubstr("zip64"));
  EXPECT_THAT(with(last + 42, Little(uint32_t{0})), HasSubstr("another name in its local header"));
  EXPECT_THAT(with(last + 42, Little(uint32_t{1})), HasSubstr("no local header"));
  EXPECT_THAT(with(last + 28, Little(uint16_t{9})), HasSubstr("reaches past its end"));
  EXPECT_THAT(ErrorOf(MakeZip({{"x/data.pkl", Pickle("}")}, {"x/data.pkl", Pickle("}")}})), HasSubstr("occurs twice"));
  // An entry that contains another archive's local header, pointed at from the directory.
  std::string inner = MakeZip({{"x/data/1", "1234"}});
  inner.resize(inner.find("PK\x01\x02"));
  std::string nested = MakeZip({{"x/data.pkl", Pickle("}")}, {"x/data/0", inner}, {"x/data/1", "1234"}});
  const auto inside = static_cast<uint32_t>(nested.find(inner));
  nested.replace(nested.rfind("PK\x01\x02") + 42, 4, Little(inside));
  EXPECT_THAT(ErrorOf(nested), HasSubstr("overlaps another"));
}

TEST(TorchFile, Zip64RecordsAreUsed) {
  std::string zip = MakeCheckpoint(Pickle(Dict({{"w", Tensor({4}, {1})}})));
  const std::string end = zip.substr(zip.size() - 22);
  zip.resize(zip.size() - 22);
  uint32_t size = 0;
  uint32_t offset = 0;
  std::memcpy(&size, end.data() + 12, 4);
  std::memcpy(&offset, end.data() + 16, 4);
  const uint64_t end64 = zip.size();
  zip += "PK\x06\x06" + Little(uint64_t{44}) + std::string(12, '\0') + Little(uint64_t{3}) + Little(uint64_t{3}) +
         Little(uint64_t{size}) + Little(uint64_t{offset});
  zip += "PK\x06\x07" + std::string(4, '\0') + Little(end64) + Little(uint32_t{1});
  zip += "PK\x05\x06" + std::string(4, '\0') + std::string(12, '\xff') + std::string(2, '\0');
  EXPECT_EQ(ErrorOf(zip), "no error");
  zip.replace(zip.size() - 22 - 12, 8, Little(~uint64_t{0}));
  EXPECT_THAT(ErrorOf(zip), HasSubstr("zip64 locator points at no"));
}

}  // namespace
}  // namespace anchorsplat
