#include "io/inflating_reader.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/random.h"

namespace anchorsplat {
namespace {

// Text that compresses to about half: blocks of the file end anywhere in it.
std::string Text(size_t size) {
  Random random(3);
  std::string text;
  while (text.size() < size) text += static_cast<char>('a' + (random.Next() >> 60));
  return text;
}

std::string Gzipped(const std::string& raw) {
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

TEST(InflatingReader, CopiesGoOnFromWhereTheyWereMade) {
  const std::string text = Text(1'500'000);
  const InputFile file = InputFile::FromBytes("a.gz", "before" + Gzipped(text));
  ASSERT_GT(file.size(), 500'000u);
  std::unique_ptr<CopyableReader> reader = OpenGzip(file, 6);
  std::vector<std::pair<size_t, std::unique_ptr<CopyableReader>>> copies;
  std::string read(text.size(), '\0');
  for (size_t at = 0; at < text.size();) {
    copies.emplace_back(at, reader->Copy());
    const size_t size = std::min<size_t>(123'457, text.size() - at);
    ASSERT_TRUE(reader->Read(read.data() + at, size).ok());
    at += size;
  }
  copies.emplace_back(text.size(), reader->Copy());
  EXPECT_TRUE(reader->ExpectEnd().ok());
  copies.emplace_back(text.size(), reader->Copy());
  reader.reset();
  EXPECT_EQ(read, text);
  for (auto copy = copies.rbegin(); copy != copies.rend(); ++copy) {
    const auto& [begin, from] = *copy;
    for (const std::unique_ptr<CopyableReader>& one : {from->Copy(), from->Copy()}) {
      std::string rest(text.size() - begin, '\0');
      ASSERT_TRUE(one->Read(rest.data(), rest.size()).ok());
      EXPECT_EQ(rest, text.substr(begin));
      EXPECT_TRUE(one->ExpectEnd().ok());
    }
  }
}

TEST(InflatingReader, CopiesSeeDamageWhereItIs) {
  const std::string text = Text(600'000);
  std::string bytes = Gzipped(text);
  bytes[bytes.size() - 6] = static_cast<char>(bytes[bytes.size() - 6] ^ 1);  // the checksum
  const InputFile file = InputFile::FromBytes("a.gz", bytes);
  std::string room(text.size(), '\0');
  const std::unique_ptr<CopyableReader> reader = OpenGzip(file, 0);
  ASSERT_TRUE(reader->Read(room.data(), 400'000).ok());
  const std::unique_ptr<CopyableReader> copy = reader->Copy();
  const auto rest = [&](InflatingReader& one) {
    const Status status = one.Read(room.data(), 200'000);
    return status.ok() ? one.ExpectEnd() : status;
  };
  const Status original = rest(*reader), copied = rest(*copy);
  ASSERT_FALSE(original.ok());
  ASSERT_FALSE(copied.ok());
  EXPECT_EQ(original.error().message, copied.error().message);
}

}  // namespace
}  // namespace anchorsplat
