#include "bench/io_bench.h"

#include <gtest/gtest.h>

#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

TEST(IoBench, MeasuresEverythingAndLeavesNothing) {
  const TestFolder folder;
  const auto report = RunIoBench({.gaussians = 5000, .sh_degree = 1, .repeats = 1, .folder = folder.path()});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->cloud_bytes, 5000u * 4 * 23);
  EXPECT_GT(report->file_bytes, 5000u * 4 * 26);
  for (const double seconds : {report->cat_seconds, report->fresh_copy_seconds, report->bare_write_seconds,
                               report->read_seconds, report->write_seconds}) {
    EXPECT_GT(seconds, 0);
  }
  EXPECT_EQ(report->Rows().size(), 6u);
  EXPECT_EQ(folder.Entries(), 0);
}

TEST(IoBench, SaysHowMuchRoomItNeeds) {
  IoBenchOptions options;
  options.gaussians = int64_t{1} << 44;
  const auto report = RunIoBench(options);
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.error().code, ErrorCode::kIo);
  EXPECT_NE(report.error().message.find("of free space"), std::string::npos) << report.error().message;
  options.gaussians = 0;
  EXPECT_FALSE(RunIoBench(options).ok());
}

}  // namespace
}  // namespace anchorsplat
