#include "io/zip_archive.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <string>
#include <string_view>

#include "io/file_bytes.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

using testing::HasSubstr;

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
  const auto zip = ZipReader::Open("a.zip", *ReadFileBytes(folder / "a.zip", 1 << 20));
  ASSERT_TRUE(zip.ok()) << zip.error().message;
  EXPECT_EQ(*zip->Read("a.txt", 100), "hello world");
  EXPECT_EQ(*zip->Read("b", 100), "");
  EXPECT_THAT(zip->Read("a.txt", 5).error().message, HasSubstr("the limit of 5 B"));
  EXPECT_THAT(zip->Read("c", 5).error().message, HasSubstr("not in the archive"));
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
  EXPECT_THAT(error_of(DeflatedZip(text, text.size() - 1)), HasSubstr("damaged"));
  EXPECT_THAT(error_of(DeflatedZip(text, text.size() + 1)), HasSubstr("damaged"));
  std::string other = text;
  other[7] = 'x';
  std::string wrong = DeflatedZip(other, text.size());
  wrong.replace(wrong.find("PK\x01\x02") + 16, 4, good.substr(good.find("PK\x01\x02") + 16, 4));
  EXPECT_THAT(error_of(wrong), HasSubstr("check sum"));
  std::string method = good;
  method[good.find("PK\x01\x02") + 10] = 12;
  EXPECT_THAT(error_of(method), HasSubstr("method 12"));
}

TEST(ZipArchive, BombsAreRefused) {
  const std::string archive = DeflatedZip(std::string(100 << 20, 'x'), 100 << 20);
  const auto zip = ZipReader::Open("a.zip", archive);
  ASSERT_TRUE(zip.ok());
  EXPECT_THAT(zip->Read("a", 1 << 30).error().message, HasSubstr("bomb"));
}

}  // namespace
}  // namespace anchorsplat
