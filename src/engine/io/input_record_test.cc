#include "io/input_record.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "io/atomic_file.h"
#include "io/file_bytes.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"
#include "io/input_file.h"
#include "io/mapped_file.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

void Make(const fs::path& path) { std::ofstream(path) << "old"; }

TEST(InputRecord, NothingThatWasReadIsReplaced) {
  const TestFolder folder;
  const InputRecord record;
  for (const char* name : {"input", "mapped", "handle"}) Make(folder / name);
  ASSERT_TRUE(InputFile::Open(folder / "input").ok());
  ASSERT_TRUE(MappedFile::Open(folder / "mapped").ok());
  ASSERT_TRUE(OpenForReading(folder / "handle").ok());
  for (const char* name : {"input", "mapped", "handle"}) {
    fs::create_symlink(name, folder / (std::string(name) + "-soft"));
    fs::create_hard_link(folder / name, folder / (std::string(name) + "-hard"));
    for (const char* link : {"", "-soft", "-hard"}) {
      for (const bool overwrite : {false, true}) {
        const Status status = WriteWholeFile(folder / (std::string(name) + link), "new", overwrite);
        ASSERT_FALSE(status.ok()) << name << link;
        EXPECT_EQ(status.error().code, ErrorCode::kBadArgument);
        EXPECT_NE(status.error().message.find("write to another name"), std::string::npos) << status.error().message;
      }
    }
    EXPECT_EQ(FileBytes(folder / name), "old");
  }
  EXPECT_TRUE(WriteWholeFile(folder / "other", "new", false).ok());
}

TEST(InputRecord, SeesWhatWasReadSinceTheOutputWasOpened) {
  const TestFolder folder;
  const InputRecord record;
  Make(folder / "a");
  auto file = OutputFile::Create(folder / "a", true);
  ASSERT_TRUE(file.ok());
  ASSERT_TRUE(ReadFileBytes(folder / "a", 100).ok());
  const Status status = file->Commit();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kBadArgument);
  EXPECT_EQ(FileBytes(folder / "a"), "old");
  EXPECT_EQ(folder.Entries(), 1);
}

TEST(InputRecord, ForgetsWhenTheOutermostEnds) {
  const TestFolder folder;
  Make(folder / "a");
  ASSERT_TRUE(ReadFileBytes(folder / "a", 100).ok());
  EXPECT_TRUE(CheckNotInput(folder / "a").ok());  // none is open
  {
    const InputRecord outer;
    {
      const InputRecord inner;
      ASSERT_TRUE(ReadFileBytes(folder / "a", 100).ok());
    }
    EXPECT_FALSE(CheckNotInput(folder / "a").ok());
  }
  EXPECT_TRUE(WriteWholeFile(folder / "a", "new", true).ok());
}

TEST(InputRecord, WhatTheCommandWroteIsNoInput) {
  const TestFolder folder;
  const InputRecord record;
  for (const char* bytes : {"one", "two", "three"}) {
    ASSERT_TRUE(WriteWholeFile(folder / "a", bytes, true).ok());
    EXPECT_EQ(*ReadFileBytes(folder / "a", 100), bytes);
  }
  // But it is not to be replaced by accident, as a file of its own state is.
  EXPECT_EQ(WriteWholeFile(folder / "a", "four", false).error().code, ErrorCode::kExists);
}

TEST(InputRecord, OwnStateIsReadAndReplaced) {
  const TestFolder folder;
  const InputRecord record;
  Make(folder / "state");
  RecordOwnFile(folder / "state");
  RecordOwnFile(folder / "not there yet");
  ASSERT_TRUE(ReadFileBytes(folder / "state", 100).ok());
  ASSERT_TRUE(WriteWholeFile(folder / "state", "new", false).ok());
  EXPECT_EQ(FileBytes(folder / "state"), "new");
  // An input does not become state; a file that came into being meanwhile is not the one that was meant.
  Make(folder / "input");
  RecordInput(folder / "input");
  RecordOwnFile(folder / "input");
  EXPECT_FALSE(WriteWholeFile(folder / "input", "new", true).ok());
  Make(folder / "not there yet");
  EXPECT_EQ(WriteWholeFile(folder / "not there yet", "new", false).error().code, ErrorCode::kExists);
}

TEST(InputRecord, OwnStateMakesRoomForNoOtherFile) {
  const TestFolder folder;
  const InputRecord record;
  Make(folder / "left");
  RecordOwnFile(folder / "left");
  auto file = OutputFile::Create(folder / "left", false);
  ASSERT_TRUE(file.ok());
  fs::rename(folder / "left", folder / "elsewhere");
  std::ofstream(folder / "left") << "theirs";
  EXPECT_EQ(file->Commit().error().code, ErrorCode::kExists);
  EXPECT_EQ(FileBytes(folder / "left"), "theirs");
}

TEST(InputRecord, AFolderHoldsAnInput) {
  const TestFolder folder;
  const InputRecord record;
  fs::create_directories(folder / "a" / "deep");
  fs::create_directory(folder / "b");
  Make(folder / "a" / "deep" / "file");
  fs::create_symlink("../a/deep/file", folder / "b" / "link");
  ASSERT_TRUE(ReadFileBytes(folder / "b" / "link", 100).ok());
  EXPECT_EQ(CheckHoldsNoInput(folder / "a").error().code, ErrorCode::kBadArgument);
  EXPECT_TRUE(CheckHoldsNoInput(folder / "b").ok());
  EXPECT_TRUE(CheckHoldsNoInput(folder / "none").ok());
}

}  // namespace
}  // namespace anchorsplat
