#include "io/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <string>
#include <vector>

#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

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
  EXPECT_EQ(FileBytes(path), "hello world");
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
  EXPECT_EQ(FileBytes(folder / "a.bin"), "abcdef");
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
  EXPECT_EQ(FileBytes(path), "one");
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write);
  ASSERT_TRUE(WriteWholeFile(path, "three", true).ok());
  EXPECT_EQ(FileBytes(path), "three");
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
  EXPECT_EQ(FileBytes(folder / "a.bin"), "theirs");
  EXPECT_EQ(folder.Entries(), 1);
}

TEST(AtomicFile, ReplacesTheFileASymbolicLinkNames) {
  const TestFolder folder;
  ASSERT_TRUE(WriteWholeFile(folder / "real.bin", "old", false).ok());
  fs::create_symlink("real.bin", folder / "link.bin");
  ASSERT_TRUE(WriteWholeFile(folder / "link.bin", "new", true).ok());
  EXPECT_TRUE(fs::is_symlink(folder / "link.bin"));
  EXPECT_EQ(FileBytes(folder / "real.bin"), "new");
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
  EXPECT_EQ(FileBytes(folder / "a.bin"), "whole");
}

TEST(AtomicFile, WritesTheFileThatALinkNamesAndIsNotThereYet) {
  const TestFolder folder;
  fs::create_directory(folder / "in");
  fs::create_symlink("in/real.bin", folder / "link.bin");
  fs::create_symlink("link.bin", folder / "second.bin");
  ASSERT_TRUE(WriteWholeFile(folder / "second.bin", "new", false).ok());
  EXPECT_TRUE(fs::is_symlink(folder / "link.bin"));
  EXPECT_EQ(FileBytes(folder / "in" / "real.bin"), "new");
}

TEST(AtomicFile, ANameThatCannotBeIsKnownBeforeTheWork) {
  const TestFolder folder;
  fs::create_symlink("b", folder / "a");
  fs::create_symlink("a", folder / "b");
  for (const fs::path& path : {folder / std::string(300, 'x'), folder / "a", folder / "a" / "file"}) {
    for (const bool overwrite : {false, true}) {
      const Status status = CheckWritable(path, overwrite);
      ASSERT_FALSE(status.ok()) << path;
      EXPECT_EQ(status.error().code, ErrorCode::kIo);
    }
  }
}

// As a process that had our number leaves them when it is killed: under all names that are tried next.
TEST(AtomicFile, LeftoversOfTheSameNameAreNotInTheWay) {
  const TestFolder folder;
  ASSERT_TRUE(WriteWholeFile(folder / "a.bin", "old", false).ok());
  for (int k = 0; k < 1000; ++k) {
    std::ofstream(folder / (".anchorsplat-" + std::to_string(::getpid()) + "-" + std::to_string(k) + ".partial"));
  }
  const Status status = WriteWholeFile(folder / "a.bin", "new", true);
  ASSERT_TRUE(status.ok()) << status.error().message;
  EXPECT_EQ(FileBytes(folder / "a.bin"), "new");
  EXPECT_EQ(folder.Entries(), 1001);
}

// Three files that belong together. The name of number `fails` becomes that of a folder before they are committed, or
// of a file where nothing may be replaced.
class CommitOfThree : public testing::TestWithParam<int> {
 protected:
  std::vector<OutputFile> Written(bool overwrite) {
    std::vector<OutputFile> files;
    for (const char* name : {"a", "b", "c"}) {
      auto file = OutputFile::Create(folder_ / name, overwrite);
      EXPECT_TRUE(file.ok());
      EXPECT_TRUE(file->Write("new").ok());
      files.push_back(*std::move(file));
    }
    return files;
  }
  fs::path Failing() const { return folder_ / std::string(1, static_cast<char>('a' + GetParam())); }
  TestFolder folder_;
};

TEST_P(CommitOfThree, GivesTheNamesBackToTheFilesThatHadThem) {
  for (const char* name : {"a", "b", "c"}) std::ofstream(folder_ / name) << "old " << name;
  auto files = Written(true);
  fs::remove(Failing());
  fs::create_directory(Failing());
  const Status status = CommitTogether(files);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kIo);
  for (const char* name : {"a", "b", "c"}) {
    if (folder_ / name == Failing()) continue;
    EXPECT_EQ(FileBytes(folder_ / name), std::string("old ") + name);
  }
  EXPECT_EQ(folder_.Entries(), 3);  // nothing is left aside
}

TEST_P(CommitOfThree, LeavesLinksAndWhatTheyName) {
  fs::create_directory(folder_ / "real");
  for (const char* name : {"a", "b", "c"}) {
    std::ofstream(folder_ / "real" / name) << "old " << name;
    fs::create_symlink(fs::path("real") / name, folder_ / name);
  }
  auto files = Written(true);
  fs::remove(folder_ / "real" / Failing().filename());
  fs::create_directory(folder_ / "real" / Failing().filename());
  ASSERT_FALSE(CommitTogether(files).ok());
  for (const char* name : {"a", "b", "c"}) {
    EXPECT_TRUE(fs::is_symlink(folder_ / name));
    if (folder_ / name == Failing()) continue;
    EXPECT_EQ(FileBytes(folder_ / name), std::string("old ") + name);
  }
}

TEST_P(CommitOfThree, TakesBackNamesThatNobodyHad) {
  auto files = Written(false);
  std::ofstream(Failing()) << "theirs";
  const Status status = CommitTogether(files);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kExists);
  EXPECT_EQ(FileBytes(Failing()), "theirs");
  EXPECT_EQ(folder_.Entries(), 1);
}

INSTANTIATE_TEST_SUITE_P(EachOrderOfFailure, CommitOfThree, testing::Values(0, 1, 2));

TEST(AtomicFile, FilesThatBelongTogetherReplaceOldOnes) {
  const TestFolder folder;
  std::ofstream(folder / "b") << "old";
  std::vector<OutputFile> files;
  for (const char* name : {"a", "b"}) {
    files.push_back(*OutputFile::Create(folder / name, true));
    ASSERT_TRUE(files.back().Write("new").ok());
  }
  ASSERT_TRUE(CommitTogether(files).ok());
  EXPECT_EQ(FileBytes(folder / "a") + FileBytes(folder / "b"), "newnew");
  EXPECT_EQ(folder.Entries(), 2);
}

TEST(AtomicFile, GoesIntoMemoryWholeOrNotAtAll) {
  const auto text = [](const std::vector<std::byte>& bytes) {
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  OutputMemory memory;
  {
    OutputFile file = *OutputFile::Create("none/a", false, &memory);
    ASSERT_TRUE(file.Write("dropped").ok());
  }
  EXPECT_TRUE(memory.files.empty());
  OutputFile first = *OutputFile::Create("none/a", false, &memory);
  ASSERT_TRUE(first.Reserve(100).ok());
  ASSERT_TRUE(first.WriteAt(4, "d", 1).ok());  // what nobody writes is 0
  ASSERT_TRUE(first.Write("ab").ok());
  OutputFile moved = std::move(first);
  ASSERT_TRUE(moved.Write("c").ok());
  ASSERT_TRUE(moved.Commit().ok());
  EXPECT_EQ(text(memory.files.at("none/a")), std::string("abc\0d", 5));
  std::vector<OutputFile> files;
  for (const char* name : {"b", "c"}) files.push_back(*OutputFile::Create(name, false, &memory));
  ASSERT_TRUE(files[0].Write("b").ok());
  ASSERT_TRUE(CommitTogether(files).ok());
  EXPECT_EQ(text(memory.files.at("b")), "b");
  EXPECT_TRUE(memory.files.at("c").empty());
  EXPECT_FALSE(fs::exists("b"));
  EXPECT_EQ(OutputFile::Create("", false, &memory).error().code, ErrorCode::kBadArgument);
}

TEST(AtomicFile, KeepsAResultWhoseNameWasTaken) {
  const TestFolder folder;
  const auto write = [](const fs::path& path, bool overwrite) { return WriteWholeFile(path, "mine", overwrite); };
  std::ofstream(folder / "scan.compressed.ply") << "theirs";
  std::ofstream(folder / "scan-2.compressed.ply") << "theirs";
  const Status status = WriteOrSaveBeside(folder / "scan.compressed.ply", false, write);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kExists);
  EXPECT_NE(status.error().message.find("scan-3.compressed.ply"), std::string::npos) << status.error().message;
  EXPECT_EQ(FileBytes(folder / "scan.compressed.ply"), "theirs");
  EXPECT_EQ(FileBytes(folder / "scan-3.compressed.ply"), "mine");
  ASSERT_TRUE(WriteOrSaveBeside(folder / "scan.compressed.ply", true, write).ok());
  EXPECT_EQ(FileBytes(folder / "scan.compressed.ply"), "mine");
  EXPECT_EQ(folder.Entries(), 3);
}

}  // namespace
}  // namespace anchorsplat
