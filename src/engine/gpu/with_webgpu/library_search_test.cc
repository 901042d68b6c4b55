#include "gpu/with_webgpu/library_search.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "gpu/open_gpu.h"
#include "gpu/with_webgpu/webgpu_api.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;

class LibrarySearchTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              ("library_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string Put(const fs::path& below) {
    const fs::path file = folder_ / below;
    fs::create_directories(file.parent_path());
    std::ofstream(file) << "text";
    return file.string();
  }

  fs::path folder_;
};

TEST_F(LibrarySearchTest, OnlyTheNamedFileIsTaken) {
  Put("bin/libwgpu_native.so");
  const LibrarySearch search{.named = "/nowhere/libwgpu.so", .program_folder = folder_ / "bin"};
  EXPECT_EQ(LibraryCandidates(search), std::vector<std::string>{"/nowhere/libwgpu.so"});
}

TEST_F(LibrarySearchTest, CondaAndPyenvAreLookedInto) {
  const std::string conda = Put("conda/lib/python3.12/site-packages/wgpu/resources/libwgpu_native-release.so");
  const std::string pyenv = Put("pyenv/versions/3.11.9/lib/python3.11/site-packages/wgpu/resources/libwgpu_native.so");
  const LibrarySearch search{.conda_environment = folder_ / "conda", .pyenv = folder_ / "pyenv"};
  EXPECT_EQ(LibraryCandidates(search), (std::vector<std::string>{conda, pyenv, "libwgpu_native.so"}));
}

TEST_F(LibrarySearchTest, ALibraryThatIsCutShortIsNotLoaded) {
  const GpuLibrary whole = FindGpuLibrary();
  ASSERT_FALSE(whole.path.empty()) << whole.problem;
  std::ifstream file(whole.path, std::ios::binary);
  std::string bytes(fs::file_size(whole.path), 0);
  ASSERT_TRUE(file.read(bytes.data(), static_cast<std::streamsize>(bytes.size())));
  for (const size_t kept : {size_t{64}, size_t{4096}, bytes.size() / 2}) {
    const std::string cut = Put("cut.so");
    std::ofstream(cut, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(kept));
    const auto loaded = LoadWebGpu(cut);
    ASSERT_FALSE(loaded.ok()) << kept;
    EXPECT_NE(loaded.error().message.find("is cut short: get it again"), std::string::npos) << loaded.error().message;
  }
}

TEST_F(LibrarySearchTest, NearPlacesComeFirst) {
  const std::string of_module = Put("site-packages/wgpu/resources/libwgpu_native-release.so");
  const std::string beside = Put("build/lean/bin/libwgpu_native.so");
  const std::string installed = Put("build/lean/lib/anchorsplat/libwgpu_native-release.so");
  const std::string of_build = Put("build/webgpu/libwgpu_native-release.so");
  const std::string of_environment = Put("venv/lib/python3.11/site-packages/wgpu/resources/libwgpu_native-release.so");
  const std::string of_path = Put("usr/lib/python3/dist-packages/wgpu/resources/libwgpu_native-release.so");
  Put("usr/bin/python3");
  Put("other/lib/python3.12/site-packages/wgpu/resources/libwgpu_native-release.so");  // its bin has no Python
  const std::string of_user = Put("home/.local/lib/python3.11/site-packages/wgpu/resources/libwgpu_native-release.so");
  const LibrarySearch search{.named = "",
                             .module_folder = folder_ / "site-packages" / "anchorsplat",
                             .program_folder = folder_ / "build" / "lean" / "bin",
                             .virtual_environment = folder_ / "venv",
                             .executables = {folder_ / "other" / "bin", folder_ / "usr" / "bin"},
                             .home = folder_ / "home"};
  EXPECT_EQ(LibraryCandidates(search), (std::vector<std::string>{of_module, beside, installed, of_build, of_environment,
                                                                 of_path, of_user, "libwgpu_native.so"}));
}

TEST_F(LibrarySearchTest, AWheelsProgramLooksBesideItsPackage) {
  const std::string beside = Put("site-packages/wgpu/resources/libwgpu_native-release.so");
  const LibrarySearch search{.named = "", .program_folder = folder_ / "site-packages" / "anchorsplat" / "_bin"};
  EXPECT_EQ(LibraryCandidates(search), (std::vector<std::string>{beside, "libwgpu_native.so"}));
}

TEST_F(LibrarySearchTest, WhereThereIsNothingTheSystemIsAsked) {
  EXPECT_EQ(LibraryCandidates({}), std::vector<std::string>{"libwgpu_native.so"});
  EXPECT_EQ(LibraryCandidates({.named = "",
                               .module_folder = folder_ / "a",
                               .program_folder = folder_ / "b",
                               .virtual_environment = folder_ / "c",
                               .executables = {folder_ / "d"},
                               .home = folder_ / "e"}),
            std::vector<std::string>{"libwgpu_native.so"});
}

TEST_F(LibrarySearchTest, AMissingFileIsNamed) {
  const Result<WebGpuApi> api = LoadWebGpu("/nowhere/libwgpu.so");
  ASSERT_FALSE(api.ok());
  EXPECT_EQ(api.error().code, ErrorCode::kNotFound);
  EXPECT_TRUE(api.error().message.starts_with("the WebGPU library cannot be loaded: /nowhere/libwgpu.so: "))
      << api.error().message;
}

TEST_F(LibrarySearchTest, AFileThatIsNoLibraryIsNamed) {
  const std::string file = Put("libwgpu_native.so");
  const Result<WebGpuApi> api = LoadWebGpu(file);
  ASSERT_FALSE(api.ok());
  EXPECT_NE(api.error().message.find(file), std::string::npos) << api.error().message;
}

TEST_F(LibrarySearchTest, AnotherLibraryLacksFunctions) {
  const Result<WebGpuApi> api = LoadWebGpu("libm.so.6");
  ASSERT_FALSE(api.ok());
  EXPECT_EQ(api.error().message, "libm.so.6 is no WebGPU library: it has no function wgpuCreateInstance");
}

}  // namespace
}  // namespace anchorsplat
