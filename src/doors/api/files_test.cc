#include <anchorsplat/files.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "api/small_splat_for_test.h"
#include "core/source_dir_for_test.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

using ::testing::HasSubstr;

std::vector<std::byte> BytesOf(const std::filesystem::path& path) {
  const std::string text = FileBytes(path);
  std::vector<std::byte> bytes(text.size());
  std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

TEST(Splat, OwnsAndLendsItsColumns) {
  Splat splat = SmallSplat(7, 2, 1);
  EXPECT_EQ(splat.size(), 7);
  EXPECT_EQ(splat.sh().size(), 7u * 9 * 3);
  splat.set_comments({"of a test"});
  splat.set_rasterization(Rasterization::kMip);
  const Splat copy = *Splat::CopyOf(splat);
  EXPECT_TRUE(SameBits(copy, splat));
  EXPECT_EQ(copy.view().comments.size(), 1u);
  EXPECT_EQ(copy.view().rasterization, Rasterization::kMip);
  EXPECT_NE(copy.view().means.data(), splat.view().means.data());

  const float* const means = splat.view().means.data();
  const Splat moved = std::move(splat);
  EXPECT_EQ(moved.view().means.data(), means);  // nothing is copied
  EXPECT_EQ(splat.size(), 0);                   // NOLINT: what it says of moved-from ones
  EXPECT_TRUE(splat.means().empty());           // NOLINT
  EXPECT_EQ(Splat().size(), 0);
}

TEST(Splat, RefusesShapesThatDoNotFit) {
  EXPECT_EQ(Splat::OfSize(-1, 0).failure().kind, FailureKind::kBadArgument);
  EXPECT_EQ(Splat::OfSize(1, 4).failure().kind, FailureKind::kBadArgument);
  EXPECT_EQ(Splat::OfSize(int64_t{1} << 40, 3).failure().kind, FailureKind::kBadArgument);
  const Splat splat = SmallSplat(7, 1, 1);
  SplatView view = splat;
  EXPECT_TRUE(CheckShape(view).ok());
  view.quats = view.quats.first(27);
  EXPECT_EQ(CheckShape(view).failure().kind, FailureKind::kBadArgument);
  EXPECT_THAT(CheckShape(view).failure().message, HasSubstr("quats"));
  EXPECT_EQ(Splat::CopyOf(view).failure().kind, FailureKind::kBadArgument);
  EXPECT_EQ(WriteSplatBytes(view, ".ply").failure().kind, FailureKind::kBadArgument);
}

TEST(Files, EveryWrittenFormatHasTheSameBytesOnDiskAndInMemory) {
  const TestFolder folder;
  const Splat splat = SmallSplat(3000, 1, 5);
  int in_memory = 0, of_several_files = 0, read_back = 0;
  for (const FileFormat& format : FileFormats()) {
    if (!format.is_written) continue;
    SCOPED_TRACE(format.name);
    const std::string& extension = format.extensions.front();
    const std::filesystem::path path = folder / (extension.starts_with('.') ? "splat" + extension : extension);
    ASSERT_TRUE(WriteSplat(path, splat).ok());
    const auto bytes = WriteSplatBytes(splat, extension);
    if (!bytes.ok()) {
      EXPECT_EQ(bytes.failure().kind, FailureKind::kBadArgument);
      EXPECT_THAT(bytes.failure().message, HasSubstr("several files"));
      ++of_several_files;
      continue;
    }
    ++in_memory;
    EXPECT_EQ(*bytes, BytesOf(path));
    if (!format.is_read) continue;
    ++read_back;
    const auto from_path = ReadSplat(path);
    const auto from_bytes = ReadSplat(*bytes, extension);
    ASSERT_TRUE(from_path.ok()) << from_path.failure().message;
    ASSERT_TRUE(from_bytes.ok()) << from_bytes.failure().message;
    EXPECT_EQ(from_path->size(), 3000);
    EXPECT_TRUE(SameBits(*from_path, *from_bytes));
  }
  EXPECT_EQ(of_several_files, 2);  // glTF as JSON, streamed SOG
  EXPECT_GE(in_memory, 8);
  EXPECT_GE(read_back, 6);
}

TEST(Files, AnyPlyGoesThroughMemoryUnchanged) {
  const Splat splat = SmallSplat(1000, 3, 9);
  const auto bytes = WriteSplatBytes(splat, "ply");
  ASSERT_TRUE(bytes.ok());
  const auto back = ReadSplat(*bytes);  // by its content
  ASSERT_TRUE(back.ok()) << back.failure().message;
  EXPECT_TRUE(SameBits(splat, *back));
}

TEST(Files, KeepsAFileUnlessToldOtherwise) {
  const TestFolder folder;
  const Splat splat = SmallSplat(10, 0, 1);
  ASSERT_TRUE(WriteSplat(folder / "a.ply", splat).ok());
  EXPECT_EQ(WriteSplat(folder / "a.ply", splat).failure().kind, FailureKind::kExists);
  // What an earlier call has read may be replaced: calls do not know of each other.
  ASSERT_TRUE(ReadSplat(folder / "a.ply").ok());
  EXPECT_TRUE(WriteSplat(folder / "a.ply", SmallSplat(11, 0, 1), {.overwrite = true}).ok());
  EXPECT_EQ(ReadSplat(folder / "a.ply")->size(), 11);
  EXPECT_EQ(WriteSplat(folder / "none/a.ply", splat).failure().kind, FailureKind::kNotFound);
  EXPECT_EQ(WriteSplat(folder / "a.txt", splat).failure().kind, FailureKind::kBadArgument);
  EXPECT_EQ(WriteSplat(folder / "b.ply", Splat()).failure().kind, FailureKind::kBadArgument);
  EXPECT_EQ(WriteSplatBytes(splat, "txt").failure().kind, FailureKind::kBadArgument);
  EXPECT_EQ(WriteSplatBytes(splat, "ksplat").failure().kind, FailureKind::kBadArgument);  // read only
}

TEST(Files, SaysWhatIsWrongWithBytes) {
  EXPECT_EQ(ReadSplat("/there/is/no.ply").failure().kind, FailureKind::kNotFound);
  EXPECT_EQ(ReadSplat(std::span<const std::byte>()).failure().kind, FailureKind::kBadFile);
  EXPECT_EQ(ReadSplat(std::vector<std::byte>(100), "nothing").failure().kind, FailureKind::kBadArgument);
  const Splat splat = SmallSplat(500, 1, 3);
  for (const char* format : {"ply", "compressed.ply", "spz", "sog", "glb", "splat"}) {
    SCOPED_TRACE(format);
    const std::vector<std::byte> bytes = *WriteSplatBytes(splat, format);
    for (const size_t kept : {size_t{1}, bytes.size() / 3, bytes.size() - 1}) {
      const auto cut = ReadSplat(std::span(bytes).first(kept), format);
      ASSERT_FALSE(cut.ok()) << kept;
      EXPECT_EQ(cut.failure().kind, FailureKind::kBadFile) << cut.failure().message;
    }
  }
}

// A name in bytes that come from anywhere must not lead to a file.
TEST(Files, BytesInMemoryHaveNothingBesideThem) {
  const TestFolder folder;
  ASSERT_TRUE(WriteSplat(folder / "a.gltf", SmallSplat(10, 0, 1)).ok());
  ASSERT_TRUE(ReadSplat(folder / "a.gltf").ok());
  std::filesystem::create_directory(folder / "sog");
  ASSERT_TRUE(WriteSplat(folder / "sog/meta.json", SmallSplat(10, 0, 1)).ok());
  ASSERT_TRUE(ReadSplat(folder / "sog").ok());
  const std::filesystem::path before = std::filesystem::current_path();
  for (const auto& [name, place] : {std::pair("a.gltf", "."), std::pair("meta.json", "sog")}) {
    std::filesystem::current_path(folder / place);
    const auto read = ReadSplat(BytesOf(folder / place / name), name == std::string("a.gltf") ? "gltf" : "");
    std::filesystem::current_path(before);
    ASSERT_FALSE(read.ok()) << name;
    EXPECT_EQ(read.failure().kind, FailureKind::kBadFile);
    EXPECT_THAT(read.failure().message, HasSubstr("cannot be read from memory"));
  }
}

TEST(Files, ValuesThatAreNoNumbersComeThrough) {
  Splat splat = SmallSplat(20, 0, 1);
  splat.means()[4] = std::numeric_limits<float>::quiet_NaN();
  const auto back = ReadSplat(*WriteSplatBytes(splat, "ply"));
  ASSERT_TRUE(back.ok());
  EXPECT_TRUE(SameBits(splat, *back));
}

TEST(Files, MessagesGoToTheirRunAndNowhereElse) {
  const Splat splat = SmallSplat(100, 2, 1);
  std::vector<std::string> said;
  testing::internal::CaptureStderr();
  const RunSettings run{.message = [&](MessageLevel level, const std::string& sentence) {
    if (level == MessageLevel::kWarning) said.push_back(sentence);
  }};
  ASSERT_TRUE(WriteSplatBytes(splat, "splat", {}, run).ok());  // has no place for spherical harmonics
  ASSERT_TRUE(WriteSplatBytes(splat, "splat").ok());
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  ASSERT_FALSE(said.empty());
  EXPECT_THAT(said.front(), HasSubstr("harmonics"));
}

}  // namespace
}  // namespace anchorsplat
