#include "formats/wrapped_splat.h"

#include <gtest/gtest.h>
#include <zlib.h>
#include <zstd.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/messages_for_test.h"
#include "core/text.h"
#include "formats/blocks_for_test.h"
#include "formats/cloud_bytes.h"
#include "formats/opened_splat.h"
#include "formats/random_cloud_for_test.h"
#include "io/atomic_file.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"
#include "io/zip_archive.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

#define EXPECT_CONTAINS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

std::string Gzip(const std::string& raw, const char* name = nullptr) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, 16 + MAX_WBITS, 9, Z_DEFAULT_STRATEGY), Z_OK);
  gz_header header{};
  std::string kept = name != nullptr ? name : "";
  header.name = reinterpret_cast<Bytef*>(kept.data());
  if (name != nullptr) deflateSetHeader(&stream, &header);
  std::string out(deflateBound(&stream, raw.size()) + 1000, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(raw.data()));
  stream.avail_in = static_cast<uInt>(raw.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

std::string Zstd(const std::string& raw) {
  std::string out(ZSTD_compressBound(raw.size()), '\0');
  ZSTD_CCtx* const context = ZSTD_createCCtx();
  ZSTD_CCtx_setParameter(context, ZSTD_c_checksumFlag, 1);  // as the program zstd does
  out.resize(ZSTD_compress2(context, out.data(), out.size(), raw.data(), raw.size()));
  ZSTD_freeCCtx(context);
  return out;
}

std::string Gunzip(const std::string& bytes) {
  std::string out(size_t{1} << 22, '\0');
  z_stream stream{};
  EXPECT_EQ(inflateInit2(&stream, 16 + MAX_WBITS), Z_OK);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  inflateEnd(&stream);
  return out;
}

class WrappedSplat : public ::testing::Test {
 protected:
  // The path of a new file.
  fs::path File(const std::string& name, const std::string& bytes) {
    const fs::path path = folder_ / name;
    fs::create_directories(path.parent_path());
    const Status written = WriteWholeFile(path, bytes, true);
    EXPECT_TRUE(written.ok());
    return path;
  }
  fs::path Zip(const std::string& name, const std::vector<std::pair<std::string, std::string>>& members) {
    auto file = OutputFile::Create(folder_ / name, true);
    EXPECT_TRUE(file.ok());
    ZipWriter zip(*file);
    for (const auto& [member, bytes] : members) EXPECT_TRUE(zip.Add(member, bytes).ok());
    EXPECT_TRUE(zip.Finish().ok() && file->Commit().ok());
    return folder_ / name;
  }
  std::string As(const std::string& name, int spz_version = 4) {
    EXPECT_TRUE(WriteCloud(folder_ / name, cloud_, {.overwrite = true, .spz_version = spz_version}).ok());
    return FileBytes(folder_ / name);
  }
  static std::string ErrorOf(const fs::path& path) {
    const auto opened = OpenedSplat::Open(path);
    if (!opened.ok()) return opened.error().message;
    const auto cloud = opened->Read();
    return cloud.ok() ? "accepted" : cloud.error().message;
  }
  // That it is read as what `plain` is, whole and block by block; what was around it.
  static std::string ExpectSame(const fs::path& path, const fs::path& plain) {
    const auto expected = OpenedSplat::Open(plain);
    const auto opened = OpenedSplat::Open(path);
    EXPECT_TRUE(expected.ok());
    if (!opened.ok()) {
      ADD_FAILURE() << opened.error().message;
      return {};
    }
    EXPECT_EQ(opened->format(), expected->format()) << path;
    EXPECT_EQ(opened->bytes(), fs::file_size(path));
    const auto cloud = opened->Read(), other = expected->Read();
    EXPECT_TRUE(other.ok());
    if (!cloud.ok()) {
      ADD_FAILURE() << cloud.error().message;
      return {};
    }
    ExpectSameCloud(*cloud, *other);
    if (opened->format()->blocks != nullptr) {
      EXPECT_EQ(DifferenceOfBlocks(opened->format()->blocks, opened->input(), {}, cloud), "");
    }
    return opened->packed();
  }

  TestFolder folder_;
  GaussianCloud cloud_ = RandomCloud(2000, 1, 7);
};

TEST_F(WrappedSplat, EveryFormatInEachPacking) {
  for (const char* name : {"a.ply", "a.compressed.ply", "a.splat", "a.spz", "a.sog", "a.glb"}) {
    const std::string raw = As(name);
    const fs::path plain = folder_ / name;
    EXPECT_CONTAINS(ExpectSame(File(Cat(name, ".gz"), Gzip(raw)), plain), "gzip around ");
    EXPECT_CONTAINS(ExpectSame(File(Cat(name, ".zst"), Zstd(raw)), plain), "zstd around ");
    // As a server's Content-Encoding leaves it on disk, and with a name of nothing.
    EXPECT_CONTAINS(ExpectSame(File(Cat("b/", name), Gzip(raw)), plain), "gzip around ");
    EXPECT_CONTAINS(ExpectSame(File("scan", Gzip(raw, name)), plain), "gzip around ");
    const std::string twice = ExpectSame(File(Cat(name, ".gz.zst"), Zstd(Gzip(raw))), plain);
    EXPECT_CONTAINS(twice, "zstd around ");
    EXPECT_CONTAINS(twice, "in it gzip around ");
    EXPECT_CONTAINS(ErrorOf(File("thrice.gz", Gzip(Zstd(Gzip(raw))))), "is packed more than twice");
    EXPECT_CONTAINS(
        ExpectSame(Zip("scan.zip", {{"folder/", ""}, {"__MACOSX/._a.ply", "x"}, {name, raw}, {"a.txt", "a"}}), plain),
        Cat("ZIP archive around ", name));
    EXPECT_CONTAINS(ExpectSame(Zip("packed.zip", {{Cat(name, ".gz"), Gzip(raw)}}), plain), "in it gzip around ");
  }
}

TEST_F(WrappedSplat, SpzInOtherPackings) {
  const std::string v3 = As("a.spz", 3), content = Gunzip(v3);
  const fs::path plain = folder_ / "a.spz";
  EXPECT_EQ(ExpectSame(plain, plain), "");  // its own gzip is none around it
  EXPECT_CONTAINS(ExpectSame(File("b.spz", Zstd(content)), plain), "zstd around ");
  EXPECT_EQ(ExpectSame(File("c.spz", content), plain), "");
  EXPECT_CONTAINS(ExpectSame(File("d.spz.gz", Gzip(v3)), plain), "gzip around ");
  const size_t half = content.size() / 2;
  EXPECT_EQ(ExpectSame(File("e.spz", Gzip(content.substr(0, half)) + Gzip(content.substr(half))), plain), "");
  const std::string v4 = As("4.spz");
  EXPECT_CONTAINS(ExpectSame(File("f.spz", Gzip(v4)), folder_ / "4.spz"), "gzip around ");
  EXPECT_CONTAINS(ErrorOf(File("g.spz", content.substr(0, half))), "ends before its data does");
  EXPECT_CONTAINS(ErrorOf(File("h.spz", content + "x")), "continues after its data");
}

TEST_F(WrappedSplat, SeveralMembersAndWhatIsBehindThem) {
  const std::string raw = As("a.ply");
  const fs::path plain = folder_ / "a.ply";
  const size_t half = raw.size() / 2;
  for (const auto& pack : {+[](const std::string& bytes) { return Gzip(bytes); }, &Zstd}) {
    const std::string whole = pack(raw), parts = pack(raw.substr(0, half)) + pack("") + pack(raw.substr(half));
    const Messages messages;
    ExpectSame(File("b.ply", parts), plain);
    ExpectSame(File("b.ply", whole + std::string(512, '\0')), plain);
    EXPECT_TRUE(messages.warnings().empty());
    ExpectSame(File("b.ply", whole + "garbage"), plain);
    ASSERT_EQ(messages.warnings().size(), 1u);
    EXPECT_CONTAINS(messages.warnings()[0], "ignoring 7 bytes after its ");
    // Wherever it is cut, and whatever is changed.
    for (const size_t size : {size_t{11}, size_t{40}, whole.size() / 2, whole.size() - 1}) {
      const std::string error = ErrorOf(File("b.ply", whole.substr(0, size)));
      EXPECT_TRUE(error.find("ends before") != error.npos || error.find("cut off") != error.npos) << size << error;
      EXPECT_CONTAINS(error, ": byte ");
    }
    std::string damaged = whole;
    damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] ^ 0x55);
    EXPECT_NE(ErrorOf(File("b.ply", damaged)), "accepted");
  }
}

TEST_F(WrappedSplat, BombsAreRefusedBeforeTheyAreUnpacked) {
  const std::string bomb = Gzip(std::string(size_t{100} << 20, '\0'));
  EXPECT_CONTAINS(ErrorOf(File("a.ply.gz", bomb)), "bomb");
  EXPECT_CONTAINS(ErrorOf(File("a.ply.zst", Zstd(std::string(size_t{100} << 20, '\0')))), "bomb");
  // Each packing alone would be within bounds.
  std::string text;
  for (int k = 0; text.size() < (size_t{80} << 20); ++k) text += Cat(k % 1000, std::string(900, 'a'));
  EXPECT_CONTAINS(ErrorOf(File("a.ply.gz.gz", Gzip(Gzip(text)))), "bomb");
}

TEST_F(WrappedSplat, ArchivesOfOtherThings) {
  const std::string ply = As("a.ply"), sog = As("a.sog");
  EXPECT_CONTAINS(ErrorOf(Zip("a.zip", {{"x/one.ply", ply}, {"two.spz", "x"}})),
                  "a.zip: is a ZIP archive with 2 splats (x/one.ply, two.spz): unpack it and pass one of them");
  EXPECT_CONTAINS(ErrorOf(Zip("a.zip", {{"a.txt", "a"}, {"b.txt", "b"}})), "without a splat; it contains a.txt, b.txt");
  EXPECT_CONTAINS(ErrorOf(Zip("a.zip", {})), "is an empty ZIP archive");
  EXPECT_CONTAINS(ErrorOf(Zip("a.zip", {{"scene/0_0/meta.json", "{}"}, {"scene/lod-meta.json", "{}"}})),
                  "ZIP archive of a streamed SOG");
  // What lies beside the archive is nothing of what is in it.
  As("a.gltf");
  EXPECT_CONTAINS(ErrorOf(Zip("a.zip", {{"a.gltf", FileBytes(folder_ / "a.gltf")}, {"a.bin", "x"}})),
                  "a.gltf: consists of several files (a.bin is one of them), which cannot be read from memory or");
  EXPECT_CONTAINS(ErrorOf(Zip("a.zip", {{"notes.txt", "something else"}})),
                  "notes.txt: byte 0: is not in a known splat format");
  EXPECT_CONTAINS(ErrorOf(Zip("a.zip", {{"deep.zip", ply}})), "accepted");  // by its content
  // A SOG is an archive itself, whatever it is called, and so is a folder that somebody has packed.
  EXPECT_EQ(ExpectSame(File("sog.zip", sog), folder_ / "a.sog"), "");
  const auto archive = ZipReader::Open("a.sog", sog);
  std::vector<std::pair<std::string, std::string>> members;
  for (const std::string& name : archive->Members())
    members.emplace_back("scan/" + name, *archive->Read(name, 1 << 24));
  EXPECT_EQ(ExpectSame(Zip("folder.zip", members), folder_ / "a.sog"), "");
}

TEST_F(WrappedSplat, EachFormatUnderEachName) {
  const GaussianCloud kept = cloud_;
  const std::vector<std::string> extensions = {".ply", ".compressed.ply", ".splat", ".spz", ".sog", ".glb"};
  for (const std::string& is : extensions) {
    const std::string bytes = As("right" + is);
    for (const std::string name : {".ply", ".compressed.ply", ".splat", ".ksplat", ".spz", ".sog", ".glb", ".gltf",
                                   ".pt", ".zip", ".csv", ".bin", ""}) {
      const fs::path wrong = File("wrong" + name, bytes);
      if (is == ".splat" && FormatOfExtension(wrong) == nullptr) {  // which has no mark, and --from is for
        EXPECT_CONTAINS(ErrorOf(wrong), "is not in a known splat format");
      } else {
        EXPECT_EQ(ExpectSame(wrong, folder_ / ("right" + is)), "") << is << " as " << name;
      }
    }
  }
}

TEST_F(WrappedSplat, SaysWhatIsNoSplat) {
  const auto expect = [&](const std::string& bytes, const std::string& part) {
    for (const char* name : {"a.ply", "a.splat", "a.ksplat", "a.spz", "a.sog", "a.pt", "a"}) {
      EXPECT_CONTAINS(ErrorOf(File(name, bytes)), part);
      EXPECT_CONTAINS(ErrorOf(File(name, Gzip(bytes))), part);
    }
  };
  expect("", "is empty");
  expect("\r\n <!DOCTYPE HTML><html>" + std::string(100, ' '), "is a web page, not a splat");
  expect("\xef\xbb\xbf<HTML lang='en'>", "is a web page, not a splat");
  expect("<?xml version='1.0'?><Error><Code>AccessDenied</Code>", "is an XML document");
  expect("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 12345\n", "is a Git LFS pointer");
  expect("BZh91AY&SY" + std::string(50, 'x'),
         "is compressed with bzip2, which is not supported: decompress it with bunzip2");
  expect(std::string("\xfd"
                     "7zXZ\0",
                     6) +
             std::string(50, 'x'),
         "is compressed with xz");
  expect("Rar!\x1a\x07" + std::string(50, 'x'), "is a RAR archive");
  expect("7z\xbc\xaf\x27\x1c" + std::string(50, 'x'), "is a 7z archive");
  EXPECT_CONTAINS(ErrorOf(File("a.splat", "404: Not Found\n")),
                  "is text, not a .splat file; it begins with \"404: Not Found");
  EXPECT_CONTAINS(ErrorOf(File("a.ksplat", "{\"message\": \"no\"}")), "is text, not a .ksplat file");
  expect(std::string(257, 'x') + "ustar" + std::string(250, '\0'), "is a tar archive");
}

TEST_F(WrappedSplat, BytesInMemoryAreUnpackedToo) {
  const std::string bytes = Gzip(As("a.ply"));
  const auto cloud = ReadCloudBytes(std::as_bytes(std::span(bytes)), "");
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  ExpectSameCloud(*cloud, cloud_);
  const auto named = ReadCloudBytes(std::as_bytes(std::span(bytes)), ".ply");
  ASSERT_TRUE(named.ok()) << named.error().message;
}

}  // namespace
}  // namespace anchorsplat
