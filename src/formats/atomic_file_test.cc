#include "formats/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <string>

#include "formats/test_folder.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

std::string Content(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(AtomicFile, AppearsOnCommitOnly) {
  const TestFolder folder;
  const fs::path path = folder / "a.bin";
  {
    auto file = OutputFile::Create(path, false);
    ASSERT_TRUE(file.ok());
    ASSERT_TRUE(file->Reserve(1000).ok());
    ASSERT_TRUE(file->Write("hello ").ok());
    ASSERT_TRUE(file->Write("world").ok());
    EXPECT_FALSE(fs::exists(path));
    EXPECT_LE(folder.Entries(), 1);  // none where the system has files without names
    ASSERT_TRUE(file->Commit().ok());
  }
  EXPECT_EQ(Content(path), "hello world");
  EXPECT_EQ(folder.Entries(), 1);
}

TEST(AtomicFile, WritesAtOffsetsAndMoves) {
  const TestFolder folder;
  auto file = OutputFile::Create(folder / "a.bin", false);
  ASSERT_TRUE(file.ok());
  ASSERT_TRUE(file->WriteAt(3, "def", 3).ok());
  ASSERT_TRUE(file->WriteAt(0, "abc", 3).ok());
  OutputFile moved = *std::move(file);
  ASSERT_TRUE(moved.Commit().ok());
  EXPECT_EQ(Content(folder / "a.bin"), "abcdef");
}

TEST(AtomicFile, WithoutCommitNothingStays) {
  const TestFolder folder;
  {
    auto file = OutputFile::Create(folder / "a.bin", false);
    ASSERT_TRUE(file.ok());
    ASSERT_TRUE(file->Write("half").ok());
  }
  EXPECT_EQ(folder.Entries(), 0);
}

TEST(AtomicFile, RefusesToOverwriteUnlessTold) {
  const TestFolder folder;
  const fs::path path = folder / "a.bin";
  ASSERT_TRUE(WriteWholeFile(path, "one", false).ok());
  const Status refused = WriteWholeFile(path, "two", false);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kExists);
  EXPECT_NE(refused.error().message.find("a.bin"), std::string::npos);
  EXPECT_EQ(Content(path), "one");
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write);
  ASSERT_TRUE(WriteWholeFile(path, "three", true).ok());
  EXPECT_EQ(Content(path), "three");
  EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(folder.Entries(), 1);
}

TEST(AtomicFile, SeesAFileThatAppearedMeanwhile) {
  const TestFolder folder;
  auto file = OutputFile::Create(folder / "a.bin", false);
  ASSERT_TRUE(file.ok());
  ASSERT_TRUE(file->Write("mine").ok());
  std::ofstream(folder / "a.bin") << "theirs";
  const Status status = file->Commit();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kExists);
  EXPECT_EQ(Content(folder / "a.bin"), "theirs");
  EXPECT_EQ(folder.Entries(), 1);
}

TEST(AtomicFile, ReplacesTheFileASymbolicLinkNames) {
  const TestFolder folder;
  ASSERT_TRUE(WriteWholeFile(folder / "real.bin", "old", false).ok());
  fs::create_symlink("real.bin", folder / "link.bin");
  ASSERT_TRUE(WriteWholeFile(folder / "link.bin", "new", true).ok());
  EXPECT_TRUE(fs::is_symlink(folder / "link.bin"));
  EXPECT_EQ(Content(folder / "real.bin"), "new");
}

TEST(AtomicFile, NamesWhatIsWrongWithTheTarget) {
  const TestFolder folder;
  const auto missing = OutputFile::Create(folder / "no" / "a.bin", false);
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  const auto directory = OutputFile::Create(folder.path(), true);
  ASSERT_FALSE(directory.ok());
  EXPECT_EQ(directory.error().code, ErrorCode::kIo);
  const auto device = OutputFile::Create("/dev/null", true);
  ASSERT_FALSE(device.ok());
  EXPECT_EQ(device.error().code, ErrorCode::kIo);
  EXPECT_FALSE(OutputFile::Create("", false).ok());
}

// A limit on the size of files fails like a full disk does, at the write.
TEST(AtomicFile, AFailedWriteNamesTheFileAndLeavesNothing) {
  const TestFolder folder;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit limited = before;
  limited.rlim_cur = 1000;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limited), 0);
  const Status status = WriteWholeFile(folder / "big.bin", std::string(5000, 'x'), false);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, old_handler);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kIo);
  EXPECT_NE(status.error().message.find("big.bin: cannot write"), std::string::npos) << status.error().message;
  EXPECT_EQ(folder.Entries(), 0);
}

TEST(AtomicFile, AKilledProcessLeavesNoFileUnderTheName) {
  const TestFolder folder;
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    auto file = OutputFile::Create(folder / "a.bin", false);
    if (file.ok() && file->Write("half of it").ok()) ::kill(::getpid(), SIGKILL);
    ::_exit(1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_FALSE(fs::exists(folder / "a.bin"));
  // A later run is not in the way of what was left.
  EXPECT_TRUE(WriteWholeFile(folder / "a.bin", "whole", false).ok());
  EXPECT_EQ(Content(folder / "a.bin"), "whole");
}

}  // namespace
}  // namespace anchorsplat
