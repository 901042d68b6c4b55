#include "bench/convert_bench.h"

#include <gtest/gtest.h>

#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

TEST(ConvertBench, MeasuresEveryTargetAndLeavesNothing) {
  const TestFolder folder;
  const ConvertBenchOptions options = {.gaussians = 3000, .sh_degree = 1, .repeats = 2, .folder = folder.path()};
  const auto report = RunConvertBench(options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->gaussians, 3000);
  EXPECT_EQ(report->cloud_bytes, 3000u * 4 * 23);
  ASSERT_EQ(report->rows.size(), options.targets.size());
  EXPECT_EQ(report->rows[0].bytes, report->input_bytes);
  for (const ConvertBenchRow& row : report->rows) {
    EXPECT_GT(row.seconds, 0) << row.target;
    EXPECT_GE(row.seconds, row.read_seconds) << row.target;
    EXPECT_GT(row.bytes, 3000u * 10) << row.target;
    EXPECT_GT(row.bare_ratio, 0) << row.target;
  }
  EXPECT_EQ(folder.Entries(), 0);
}

TEST(ConvertBench, Refuses) {
  EXPECT_EQ(RunConvertBench({.file = "/nowhere/a.ply"}).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(RunConvertBench({.gaussians = 0}).error().code, ErrorCode::kBadArgument);
  const TestFolder folder;
  EXPECT_EQ(RunConvertBench({.gaussians = 100, .targets = {".obj"}, .folder = folder.path()}).error().code,
            ErrorCode::kBadArgument);
  EXPECT_EQ(folder.Entries(), 0);
}

}  // namespace
}  // namespace anchorsplat
