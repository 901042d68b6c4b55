#include "core/companion.h"

#include <gtest/gtest.h>

#include <fstream>

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

TEST(Companion, IsBesideTheProgramOrWhereItWasInstalled) {
  const fs::path prefix = fs::path(testing::TempDir()) / "companion_test";
  fs::remove_all(prefix);
  fs::create_directories(prefix / "bin");
  fs::create_directories(prefix / "lib" / "anchorsplat");
  EXPECT_EQ(CompanionFile("plugin.so", prefix / "bin"), prefix / "bin" / "plugin.so");
  std::ofstream(prefix / "lib" / "anchorsplat" / "plugin.so") << "installed";
  EXPECT_EQ(CompanionFile("plugin.so", prefix / "bin"), prefix / "lib" / "anchorsplat" / "plugin.so");
  std::ofstream(prefix / "bin" / "plugin.so") << "built";
  EXPECT_EQ(CompanionFile("plugin.so", prefix / "bin"), prefix / "bin" / "plugin.so");
  fs::remove_all(prefix);
}

TEST(Companion, KnowsItsOwnFolder) {
  EXPECT_TRUE(ProgramFolder().is_absolute()) << ProgramFolder();
  EXPECT_TRUE(fs::exists(ProgramFolder() / fs::read_symlink("/proc/self/exe").filename())) << ProgramFolder();
}

}  // namespace
}  // namespace anchorsplat
