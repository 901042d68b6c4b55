#include "io/file_lock.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <optional>

#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

TEST(FileLock, IsHeldOnce) {
  const TestFolder folder;
  {
    const auto lock = FileLock::Take(folder / "lock", false);
    ASSERT_TRUE(lock.ok());
    EXPECT_EQ(FileLock::Take(folder / "lock", false).error().code, ErrorCode::kExists);
  }
  EXPECT_TRUE(FileLock::Take(folder / "lock", true).ok());
  EXPECT_EQ(FileLock::Take(folder / "none" / "lock", false).error().code, ErrorCode::kIo);
}

TEST(FileLock, LeavesNothingBehind) {
  const TestFolder folder;
  const auto path = folder / "lock";
  {
    auto lock = FileLock::TakeAndRemove(path);
    ASSERT_TRUE(lock.ok()) << lock.error().message;
    EXPECT_EQ(FileLock::TakeAndRemove(path).error().code, ErrorCode::kExists);
    EXPECT_TRUE(std::filesystem::exists(path)) << "who was refused takes nothing away";
    std::optional<FileLock> moved(*std::move(lock));
    EXPECT_EQ(FileLock::TakeAndRemove(path).error().code, ErrorCode::kExists);
  }
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_TRUE(FileLock::TakeAndRemove(path).ok());
}

}  // namespace
}  // namespace anchorsplat
