#include "io/input_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "core/run_context.h"
#include "io/folder_for_test.h"
#include "io/size_limit.h"

namespace anchorsplat {
namespace {

TEST(InputFile, ReadsAPipeWhoseWriterComesLater) {
  const TestFolder folder;
  const std::filesystem::path pipe = folder / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const std::string text(300'000, 'x');  // more than a pipe holds
  std::thread writer([&] { std::ofstream(pipe, std::ios::binary) << text; });
  const auto file = InputFile::Open(pipe);
  writer.join();
  ASSERT_TRUE(file.ok()) << file.error().message;
  EXPECT_EQ(file->size(), text.size());
}

TEST(InputFile, AbandonsAPipeWithoutAWriter) {
  const TestFolder folder;
  const std::filesystem::path pipe = folder / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const std::atomic<bool> abandon{true};
  const RunScope scope({.abandon = &abandon});
  EXPECT_THROW({ const auto file = InputFile::Open(pipe); }, RunAbandoned);
}

TEST(InputFile, SizesThatDifferReadDifferently) {
  EXPECT_EQ(MoreThanLimit(300'000'000, 268'435'456), "300 MB, more than the limit of 268 MB");
  EXPECT_EQ(MoreThanLimit(268'435'457, 268'435'456), "268,435,457 bytes, more than the limit of 268,435,456 bytes");
  EXPECT_EQ(MoreThanLimit(1001, 1000, " of text"), "1,001 bytes of text, more than the limit of 1,000 bytes");
}

}  // namespace
}  // namespace anchorsplat
