#include "io/staged_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;

// A staged folder with `name`/file in it.
Result<StagedFolder> Staged(const fs::path& file, const Names& names) {
  Result<StagedFolder> staged = StagedFolder::Create(file);
  for (const std::string& name : names) {
    if (!staged.ok()) break;
    fs::create_directory(staged->path() / name);
    std::ofstream(staged->path() / name / "file") << name;
  }
  return staged;
}

TEST(StagedFolder, GivesNamesWhenAllIsThere) {
  const TestFolder folder;
  {
    auto staged = Staged(folder / "index", {"a", "b"});
    ASSERT_TRUE(staged.ok()) << staged.error().message;
    EXPECT_FALSE(fs::exists(folder / "a"));
    ASSERT_TRUE(staged->Publish(Names{"a", "b"}, Names{"a-2", "b-2"}).ok());
    staged->Keep();
  }
  EXPECT_EQ(FileBytes(folder / "a-2/file"), "a");
  EXPECT_EQ(FileBytes(folder / "b-2/file"), "b");
  EXPECT_EQ(folder.Entries(), 2);
}

TEST(StagedFolder, LeavesNothingUnlessItIsKept) {
  const TestFolder folder;
  {
    auto staged = Staged(folder / "index", {"a", "b"});
    ASSERT_TRUE(staged->Publish(Names{"a"}, Names{"a"}).ok());
    EXPECT_TRUE(fs::exists(folder / "a"));
  }
  EXPECT_EQ(folder.Entries(), 0);
}

TEST(StagedFolder, ReplacesNothing) {
  const TestFolder folder;
  fs::create_directory(folder / "b");  // empty, which a rename would replace
  {
    auto staged = Staged(folder / "index", {"a", "b"});
    const Status published = staged->Publish(Names{"a", "b"}, Names{"a", "b"});
    ASSERT_FALSE(published.ok());
    EXPECT_NE(published.error().message.find("was created by another program"), std::string::npos);
  }
  EXPECT_EQ(folder.Entries(), 1);
  EXPECT_TRUE(fs::is_empty(folder / "b"));
}

TEST(StagedFolder, ClearsAwayWhatAKilledRunLeft) {
  const TestFolder folder;
  fs::create_directory(folder / ".anchorsplat-index.partial");
  std::ofstream(folder / ".anchorsplat-index.partial/half") << "half";
  const auto staged = Staged(folder / "index", {});
  ASSERT_TRUE(staged.ok());
  EXPECT_TRUE(fs::is_empty(staged->path()));
}

TEST(StagedFolder, OneAtATime) {
  const TestFolder folder;
  const auto first = Staged(folder / "index", {"a"});
  ASSERT_TRUE(first.ok());
  const auto second = StagedFolder::Create(folder / "index");
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::kExists);
  EXPECT_TRUE(fs::exists(first->path() / "a/file"));
  EXPECT_TRUE(StagedFolder::Create(folder / "other").ok());
}

}  // namespace
}  // namespace anchorsplat
