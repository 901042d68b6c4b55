#include <algorithm>
#include <filesystem>
#include <set>

#include "cli/exit_codes.h"
#include "cli/run_for_test.h"
#include "cli/small_scan_for_test.h"
#include "core/source_dir_for_test.h"
#include "eval/reading_table.h"
#include "io/atomic_file.h"
#include "io/folder_for_test.h"
#include "io/inflating_reader.h"
#include "io/input_file.h"
#include "reading/features.h"

namespace anchorsplat {
namespace {

using ::testing::HasSubstr;

// What is measured needs a quiet machine and is no test (docs/benchmarks.md#speed); that words are understood is.
TEST(BenchVerb, TakesAndRefusesWords) {
  const TestFolder folder;
  const std::string none = folder / "none.ply";
  ExpectRefused({"bench"}, ErrorCode::kBadArgument,
                {"needs a verb: render, fit, network, upscale, convert, io, gpu, reading"});
  ExpectRefused({"bench", "render", none}, ErrorCode::kNotFound, {"none.ply"});
  ExpectRefused({"bench", "network", none}, ErrorCode::kNotFound, {"none.ply"});
  ExpectRefused({"bench", "convert", none}, ErrorCode::kNotFound, {"none.ply"});
  ExpectRefused({"bench", "network", none, "--precision", "fp64"}, ErrorCode::kBadArgument, {"--precision"});
  ExpectRefused({"bench", "render", none, "--repeats", "0"}, ErrorCode::kBadArgument, {"--repeats"});
  ExpectRefused({"bench", "fit", "--width", "10"}, ErrorCode::kBadArgument, {"--width"});
  ExpectRefused({"bench", "convert", "--gaussians", "999"}, ErrorCode::kBadArgument, {"--gaussians"});
  ExpectRefused({"bench", "io", "--sh-degree", "4"}, ErrorCode::kBadArgument, {"--sh-degree"});
}

// The table itself needs a GPU and a quiet machine; that it is made, and what other programs are given, does not.
TEST(BenchVerb, GpuMeasuresAndWritesItsScenes) {
  const TestFolder folder;
  const std::string scenes = folder / "scenes";
  const std::vector<std::string> load = {"--gaussians", "200", "--size", "32x24"};
  std::vector<std::string> words = {"bench", "gpu", "--small", "--repeats", "1"};
  words.insert(words.end(), load.begin(), load.end());
  const nlohmann::json json = ExpectJson(words);
  EXPECT_FALSE(json["adapter"]["name"].get<std::string>().empty());
  ASSERT_EQ(json["rows"].size(), 1u);
  EXPECT_EQ(json["rows"][0]["gaussians"], 200);
  EXPECT_EQ(json["rows"][0]["width"], 32);
  EXPECT_GT(json["rows"][0]["backward_seconds"], 0);
  EXPECT_EQ(json["rows"][0]["cpu"]["out_of_order"], 0);
  EXPECT_FALSE(json["rows"][0].contains("problem"));
  EXPECT_THAT(ExpectDone(words).out, HasSubstr("32x24"));

  std::vector<std::string> write = {"bench", "gpu", "--write-scenes", scenes};
  write.insert(write.end(), load.begin(), load.end());
  ExpectDone(write);
  EXPECT_TRUE(std::filesystem::exists(scenes + "/200.ply"));
  EXPECT_TRUE(std::filesystem::exists(scenes + "/scenes.json"));
  ExpectRefused(write, ErrorCode::kExists, {"200.ply"});
  ExpectRefused({"bench", "gpu", "--device", "cpu"}, ErrorCode::kBadArgument, {"--device gpu"});
  ExpectRefused({"bench", "gpu", "--size", "32"}, ErrorCode::kBadArgument, {"WIDTHxHEIGHT"});
  ExpectRefused({"bench", "gpu", "--gaussians", "0"}, ErrorCode::kBadArgument, {"--gaussians"});
}

TEST(BenchVerb, ReadingTellsWhatASplatShows) {
  const TestFolder folder;
  const std::string scan = Biplane() / "input.ply";
  const nlohmann::json json = ExpectJson({"bench", "reading", scan, "--features"});
  ASSERT_EQ(json["splats"].size(), 1u);
  EXPECT_GT(json["splats"][0]["unit"], 0);
  EXPECT_EQ(json["splats"][0]["features"].size(), FeatureNames().size());
  EXPECT_EQ(json["splats"][0]["features"].size(), json["names"].size());
  EXPECT_EQ(json["names"][0], "file.classic");  // in the order of the values
  EXPECT_THAT(ExpectDone({"bench", "reading", scan, "--features"}).out, HasSubstr("near.side.0.5"));
  ExpectRefused({"bench", "reading"}, ErrorCode::kBadArgument, {"--features", "--tasks", "--score"});
  ExpectRefused({"bench", "reading", "--features"}, ErrorCode::kBadArgument, {"needs a splat"});
  ExpectRefused({"bench", "reading", scan, "--score", "x"}, ErrorCode::kBadArgument, {"--features"});
  ExpectRefused({"bench", "reading", "--views", "2", "--features"}, ErrorCode::kBadArgument, {"--tasks"});
  ExpectRefused({"bench", "reading", folder / "none.ply", "--features"}, ErrorCode::kNotFound, {"none.ply"});
}

TEST(BenchVerb, ReadingMakesRowsAndGoesOn) {
  const TestFolder folder;
  const std::string tasks = folder / "tasks.jsonl", rows = folder / "rows";
  const std::string splat = Biplane() / "input.ply";
  ASSERT_TRUE(
      WriteWholeFile(tasks, R"({"id":"a","splat":")" + splat + "\"}\n" + R"({"id":"b","splat":"none.ply"})", false)
          .ok());
  const std::vector<std::string> words = {"bench", "reading", "--tasks", tasks, "-o", rows};
  const ProgramRun first = RunWords(words);
  EXPECT_EQ(first.code, kPartialExitCode);
  EXPECT_THAT(first.out, HasSubstr("1 rows made, 0 were there, 1 failed"));
  EXPECT_THAT(first.err, HasSubstr("b: none.ply"));
  EXPECT_THAT(RunWords(words).out, HasSubstr("0 rows made, 1 were there, 1 failed"));
  // A row of another file is made anew, and none stays where that fails.
  const std::string copy = folder / "copy.ply";
  std::filesystem::copy_file(splat, copy);
  ASSERT_TRUE(WriteWholeFile(tasks, R"({"id":"a","splat":")" + copy + "\"}\n", true).ok());
  EXPECT_THAT(ExpectDone(words).out, HasSubstr("1 rows made, 0 were there"));
  EXPECT_THAT(ExpectDone(words).out, HasSubstr("0 rows made, 1 were there"));
  std::filesystem::remove(copy);
  EXPECT_THAT(RunWords(words).out, HasSubstr("0 rows made, 0 were there, 1 failed"));
  EXPECT_FALSE(std::filesystem::exists(folder / "rows/a.json"));
  ExpectRefused({"bench", "reading", "--tasks", tasks}, ErrorCode::kBadArgument, {"--output"});
  const std::string task = R"({"id":"a","splat":"a.ply"})";
  ASSERT_TRUE(WriteWholeFile(tasks, task + "\n\n" + task, true).ok());
  ExpectRefused(words, ErrorCode::kBadFile, {"line 3: a is listed twice"});
  ASSERT_TRUE(WriteWholeFile(tasks, "{}\n", true).ok());
  ExpectRefused(words, ErrorCode::kBadFile, {"line 1"});
}

std::string FirstLineOf(const std::string& gzipped) {
  const auto file = InputFile::Open(gzipped);
  std::string text(size_t{1} << 20, '\0');
  const auto reader = OpenGzip(*file, 0);
  text.resize(*reader->ReadSome(text.data(), text.size()));
  return text.substr(0, text.find('\n'));
}

// The table that is part of the project: what its page says of it, and the board.
TEST(BenchVerb, ReadingScoresTheTable) {
  const std::string table = SourceDirForTest() / "data/reading.jsonl.gz";
  const auto rows = ReadReadingTable(table);
  ASSERT_TRUE(rows.ok()) << rows.error().message;
  std::set<std::string> kinds, meshes, ids;
  for (const ReadingRow& row : *rows) {
    kinds.insert(row.kind);
    meshes.insert(row.mesh);
    EXPECT_TRUE(ids.insert(row.id).second) << row.id;
  }
  EXPECT_GE(rows->size(), 1000u);
  EXPECT_GE(kinds.size(), 12u);
  EXPECT_GE(meshes.size(), 60u);
  // Its columns are those that the extractor gives today.
  const nlohmann::json features = ExpectJson({"bench", "reading", Biplane() / "input.ply", "--features"});
  EXPECT_EQ(nlohmann::json::parse(FirstLineOf(table))["features"], features["names"]);
  const std::string out = ExpectDone({"bench", "reading", "--score", table}).out;
  EXPECT_THAT(out, HasSubstr("the list"));
  EXPECT_THAT(out, HasSubstr("best of all"));
  const nlohmann::json json = ExpectJson({"bench", "reading", "--score", table});
  EXPECT_EQ(json["deciders"].size(), 4u);
  // Whoever decides nothing gains nothing.
  const TestFolder folder;
  ASSERT_TRUE(WriteWholeFile(folder / "none.jsonl", "", false).ok());
  const nlohmann::json beside =
      ExpectJson({"bench", "reading", "--score", table, "--decisions", folder / "none.jsonl"});
  ASSERT_EQ(beside["deciders"].size(), 5u);
  EXPECT_EQ(beside["deciders"][0]["groups"][0]["mean"], 0);
}

}  // namespace
}  // namespace anchorsplat
