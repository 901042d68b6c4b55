#include "cli/output_plan.h"
#include "cli/run_for_test.h"
#include "cli/small_scan_for_test.h"
#include "core/text.h"
#include "io/folder_for_test.h"
#include "request/parse.h"

namespace anchorsplat {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class ConvertVerb : public testing::Test {
 protected:
  TestFolder folder_;
  std::string scan_ = WriteScan(folder_ / "scan.ply", 200, 2);
};

TEST_F(ConvertVerb, WritesEveryFormatThatItReadsBack) {
  for (const std::string to : {"compressed.ply", "spz", "sog", "splat", "glb", "gltf", "csv", "npz"}) {
    const std::string out = folder_ / ("out." + to);
    const int degree = to == "splat" ? 0 : 1;
    const nlohmann::json rows = ExpectJson({"convert", scan_, out, "--max-gaussians", "150", "--sh-degree", "1"});
    ASSERT_EQ(rows.size(), 1u);
    EXPECT_EQ(rows[0]["gaussians"], nlohmann::json({{"in", 200}, {"out", 150}}));
    EXPECT_EQ(rows[0]["sh_degree"], nlohmann::json({{"in", 2}, {"out", degree}}));
    const uint64_t buffer = to == "gltf" ? std::filesystem::file_size(folder_ / "out.bin") : 0;
    EXPECT_EQ(rows[0]["bytes"]["out"], std::filesystem::file_size(out) + buffer);
    if (to == "csv" || to == "npz") continue;  // only written
    const nlohmann::json info = ExpectJson({"info", out});
    EXPECT_EQ(info["gaussians"], 150);
    EXPECT_EQ(info["sh_degree"], degree);
  }
}

TEST_F(ConvertVerb, SaysWhatItDid) {
  const ProgramRun run = ExpectDone({"convert", scan_, folder_ / "out.spz"});
  EXPECT_THAT(run.out, AllOf(HasSubstr("scan.ply (PLY, "), HasSubstr("out.spz (SPZ, "),
                             HasSubstr("200 Gaussians of SH degree 2 in, 200 of degree 2 out")));
  EXPECT_THAT(run.err, IsEmpty());
}

TEST_F(ConvertVerb, LevelsOfDetail) {
  const std::string scene = folder_ / "scene";
  const ProgramRun run = ExpectDone({"convert", scan_, "--lod", scene, "--lod-levels", "3", "--lod-ratio", "0.5"});
  EXPECT_THAT(run.out, HasSubstr("scene/lod-meta.json (streamed SOG, "));
  EXPECT_THAT(run.err, HasSubstr("3 levels of 200, 100, 50 Gaussians, 1 leaf, 3 chunks"));
  EXPECT_EQ(ExpectJson({"info", scene})["gaussians"], 200);
  ExpectDone({"convert", scene, folder_ / "coarse.ply", "--lod-level", "2"});
  EXPECT_EQ(ExpectJson({"info", folder_ / "coarse.ply"})["gaussians"], 50);
  ExpectRefused({"convert", scene, folder_ / "coarser.ply", "--lod-level", "3"}, ErrorCode::kBadFile,
                {"lod-meta.json: has no level 3; its levels are 0 to 2"});
  ExpectRefused({"convert", scan_, "--lod", scene}, ErrorCode::kExists, {"scene/lod-meta.json"});
  ExpectRefused({"convert", scene, "--lod", scene, "-w"}, ErrorCode::kBadArgument, {"lod-meta.json"});
  // The name alone says it, and many at once.
  ExpectDone({"convert", scan_, folder_ / "named/lod-meta.json"});
  ExpectDone({"convert", scan_, "--lod", "--out-dir", folder_ / "many"});
  EXPECT_TRUE(std::filesystem::exists(folder_ / "many/scan/lod-meta.json"));
  const nlohmann::json row =
      ExpectJson({"convert", scene, folder_ / "again.sog", "--report", "--report-views", "1"})[0];
  EXPECT_GT(row["psnr"]["mean"], 30);
  ExpectRefused({"convert", scan_, "--lod", folder_ / "scan.sog"}, ErrorCode::kBadArgument, {"--lod needs a folder"});
  ExpectDone({"convert", scan_, "--lod", folder_ / "scene.v2"});
  EXPECT_TRUE(std::filesystem::exists(folder_ / "scene.v2/lod-meta.json"));
}

TEST_F(ConvertVerb, AsksBeforeLargeFiles) {
  const std::string huge = WriteHugeScan(folder_ / "huge.ply", 20'000'000);
  const ProgramRun run = ExpectRefused({"convert", huge, folder_ / "out.ply"}, ErrorCode::kBadArgument,
                                       {"20,000,000 Gaussians", "out.ply takes 5.0 GB", "more than 4.0 GB", "--yes"});
  EXPECT_EQ(folder_.Entries(), 2);
  // One of several is enough: nothing is begun that will not be ended.
  ExpectRefused({"convert", scan_, huge, "--out-dir", folder_ / "out"}, ErrorCode::kBadArgument, {"--yes"});
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/scan.ply"));
  // What a header promises and the file has not is an error of the file, --yes or not.
  std::filesystem::resize_file(huge, 100'000);
  ExpectRefused({"convert", huge, folder_ / "out.ply"}, ErrorCode::kBadFile, {"ends too early"});
}

TEST_F(ConvertVerb, AsksBeforeManyFilesThatAreLargeTogether) {
  const std::string one = WriteHugeScan(folder_ / "one.ply", 10'000'000);
  const std::string two = WriteHugeScan(folder_ / "two.ply", 10'000'000);
  ExpectRefused({"convert", one, two, "--out-dir", folder_ / "out"}, ErrorCode::kBadArgument,
                {"all 2 together take 5.0 GB, more than 4.0 GB", "--yes"});
}

TEST_F(ConvertVerb, AsksBeforeLargeTables) {
  const std::string huge = WriteHugeScan(folder_ / "huge.ply", 10'000'000);
  ExpectRefused({"convert", huge, folder_ / "out.csv"}, ErrorCode::kBadArgument,
                {"out.csv takes about 7.7 GB", "more than 4.0 GB"});
}

TEST(OutputPlan, KnowsTheRoomOfFoldersToBe) {
  const TestFolder folder;
  EXPECT_TRUE(RoomFor(folder / "scan.ply").has_value());
  EXPECT_TRUE(RoomFor(folder / "new/and newer/lod-meta.json").has_value());
  EXPECT_TRUE(RoomFor("nowhere-yet/lod-meta.json").has_value());
  EXPECT_FALSE(RoomFor("/proc/new/scan.ply").has_value());
}

TEST(OutputPlan, MemoryIsAPositiveSize) {
  const std::pair<const char*, uint64_t> good[] = {
      {"2G", 2'000'000'000},   {"0.5G", 500'000'000},       {"500M", 500'000'000}, {"64000000", 64'000'000},
      {"1 GB", 1'000'000'000}, {"1GiB", uint64_t{1} << 30}, {"70000k", 70'000'000}};
  for (const auto& [text, bytes] : good) {
    const auto parsed = ParseMemory(text);
    ASSERT_TRUE(parsed.ok()) << text << ": " << parsed.error().message;
    EXPECT_EQ(*parsed, bytes) << text;
  }
  for (const char* bad :
       {"", "G", "much", "-1", "-2G", "0", "1", "63M", "1e40", "nan", "inf", "2X", "2GG", "2 G B", "1bb", "5ib"}) {
    EXPECT_FALSE(ParseMemory(bad).ok()) << bad;
  }
  EXPECT_THAT(ParseMemory("10M").error().message, HasSubstr("10M is less than the minimum of 64.0 MB"));
}

TEST_F(ConvertVerb, MaxMemoryIsASize) {
  ExpectRefused({"convert", scan_, folder_ / "two.spz", "--max-memory", "-1"}, ErrorCode::kBadArgument, {"-1 is less"});
  ExpectDone({"convert", scan_, folder_ / "half.spz", "--max-memory", "0.5G"});
  ExpectDone({"convert", scan_, folder_ / "out.spz", "--max-memory", "500M"});
  ExpectRefused({"convert", scan_, folder_ / "two.spz", "--max-memory", "much"}, ErrorCode::kBadArgument, {"much"});
}

TEST_F(ConvertVerb, SaysWhatIsLost) {
  const ProgramRun dull = ExpectDone({"convert", scan_, folder_ / "dull.splat"});
  EXPECT_THAT(dull.err, HasSubstr("harmonics above degree 0"));
  EXPECT_THAT(dull.out, HasSubstr("of degree 0 out"));
  WriteNanScan(folder_ / "nan.ply");
  EXPECT_THAT(ExpectDone({"convert", folder_ / "nan.ply", folder_ / "nan.csv"}).err,
              HasSubstr("2 of 2 Gaussians cannot be drawn"));
}

TEST_F(ConvertVerb, ReportsTheLoss) {
  const nlohmann::json row =
      ExpectJson({"convert", scan_, folder_ / "out.spz", "--report", "--report-views", "2", "--spz-version", "3"})[0];
  EXPECT_EQ(row["error"]["compared"], 200);
  EXPECT_GT(row["error"]["means"]["max"], 0);
  EXPECT_GT(row["psnr"]["mean"], 30);
  EXPECT_EQ(row["psnr"]["views"], 2);
  EXPECT_THAT(
      ExpectDone({"convert", folder_ / "out.spz", folder_ / "again.ply", "--report", "--report-views", "1"}).out,
      HasSubstr("PSNR"));
  EXPECT_THAT(ExpectDone({"convert", scan_, folder_ / "out.csv", "--report"}).err, HasSubstr("nothing to compare"));
}

TEST_F(ConvertVerb, Batches) {
  const std::string other = WriteScan(folder_ / "other.spz", 100);
  const nlohmann::json rows = ExpectJson({"convert", scan_, other, "--out-dir", folder_ / "batch", "--to", ".x.ply"});
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0]["gaussians"]["out"], 200);
  EXPECT_EQ(rows[1]["output"], (folder_ / "batch/other.x.ply").string());
  EXPECT_TRUE(std::filesystem::exists(folder_ / "batch/scan.x.ply"));
  // Nothing may become what another became, nor what is there; known before the first is written.
  ExpectRefused({"convert", scan_, other, "--out-dir", folder_ / "batch", "--to", "x.ply"}, ErrorCode::kExists,
                {"scan.x.ply"});
  ExpectRefused({"convert", scan_, scan_, "--out-dir", folder_ / "twice"}, ErrorCode::kBadArgument,
                {"would both become"});
  ExpectRefused({"convert", scan_, "--out-dir", folder_ / "twice", "--to", "obj"}, ErrorCode::kBadArgument, {"--to"});
  ExpectRefused({"convert", scan_, "--out-dir", folder_ / "away/in", "--to", "../x.ply"}, ErrorCode::kBadArgument,
                {"--to: '../x.ply' cannot be written"});
  EXPECT_FALSE(std::filesystem::exists(folder_ / "twice"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "away"));
}

TEST_F(ConvertVerb, FoldersOfPictures) {
  ExpectDone({"convert", scan_, "--out-dir", folder_ / "folders", "--to", "meta.json"});
  const std::filesystem::path folder = folder_ / "folders/scan";
  EXPECT_EQ(ExpectJson({"info", folder / "meta.json"})["gaussians"], 200);
  EXPECT_THAT(ExpectDone({"info", folder}).out, HasSubstr("SOG"));
  // It is called like the folder, whichever way it is named.
  ExpectDone({"convert", folder / "meta.json", "--out-dir", folder_ / "folders", "--to", "spz"});
  EXPECT_TRUE(std::filesystem::exists(folder_ / "folders/scan.spz"));
  ExpectDone({"convert", folder.string() + "/", "--out-dir", folder_ / "folders", "--to", "glb"});
  EXPECT_TRUE(std::filesystem::exists(folder_ / "folders/scan.glb"));
  ExpectRefused({"convert", folder / "meta.json", folder_ / "folders/scan.spz"}, ErrorCode::kExists);
  ExpectRefused({"convert", scan_, folder_ / "half-meta.json"}, ErrorCode::kBadArgument);
  ExpectRefused({"info", folder_.path()}, ErrorCode::kBadFile, {"without a meta.json"});
}

TEST_F(ConvertVerb, KindsThatAreSaid) {
  ExpectDone({"convert", scan_, folder_ / "scan.splat"});
  std::filesystem::rename(folder_ / "scan.splat", folder_ / "scan.bytes");
  ExpectRefused({"convert", folder_ / "scan.bytes", folder_ / "out.ply"}, ErrorCode::kBadFile);
  EXPECT_THAT(ExpectDone({"convert", folder_ / "scan.bytes", folder_ / "out.ply", "--from", ".splat"}).out,
              HasSubstr("(splat, 6.4 kB)"));
  ExpectRefused({"convert", folder_ / "scan.bytes", folder_ / "csv.ply", "--from", "csv"}, ErrorCode::kBadArgument,
                {"--from: 'csv' is not a readable format"});
}

TEST_F(ConvertVerb, OverwritesOnlyWhenTold) {
  const std::string out = folder_ / "out.ply";
  ExpectDone({"convert", scan_, out, "--max-gaussians", "10"});
  ExpectRefused({"convert", scan_, out}, ErrorCode::kExists, {"out.ply"});
  EXPECT_EQ(ExpectJson({"info", out})["gaussians"], 10);
  ExpectDone({"convert", scan_, out, "-w"});
  EXPECT_EQ(ExpectJson({"info", out})["gaussians"], 200);
}

TEST_F(ConvertVerb, RefusesWhatMakesNoSense) {
  const std::string out = folder_ / "out.ply";
  ExpectRefused({"convert", scan_}, ErrorCode::kBadArgument, {"pass IN OUT"});
  ExpectRefused({"convert", scan_, "-"}, ErrorCode::kBadArgument, {"as --to .ply"});
  ExpectRefused({"convert", scan_, folder_ / "out.obj"}, ErrorCode::kBadArgument, {"out.obj"});
  ExpectRefused({"convert", scan_, out, "--coords", "XYZ"}, ErrorCode::kBadArgument, {"--coords"});
  ExpectRefused({"convert", scan_, out, "--coords", ""}, ErrorCode::kBadArgument, {"--coords"});
  ExpectRefused({"convert", scan_, out, "--max-gaussians", "0"}, ErrorCode::kBadArgument, {"1 or more"});
  ExpectRefused({"convert", scan_, out, "--min-opacity", "1.5"}, ErrorCode::kBadArgument, {"from 0 to 1"});
  ExpectRefused({"convert", scan_, out, "--sh-degree", "4"}, ErrorCode::kBadArgument, {"--sh-degree"});
  ExpectRefused({"convert", scan_, out, "--sort", "size"}, ErrorCode::kBadArgument, {"--sort"});
  ExpectRefused({"convert", scan_, out, "--to", "spz"}, ErrorCode::kBadArgument, {"--out-dir"});
  ExpectRefused({"convert", folder_ / "none.ply", out}, ErrorCode::kNotFound, {"none.ply"});
  ExpectRefused({"convert", scan_, folder_ / "weights.safetensors"}, ErrorCode::kBadFile);
  EXPECT_EQ(folder_.Entries(), 1);
}

TEST_F(ConvertVerb, CutsAndTurns) {
  const nlohmann::json row = ExpectJson({"convert", scan_, folder_ / "faint.ply", "--min-opacity", "0.7"})[0];
  EXPECT_LT(row["gaussians"]["out"], 200);
  EXPECT_GT(row["gaussians"]["out"], 0);
  ExpectDone({"convert", scan_, folder_ / "up.ply", "--coords", "RUB:", "--sort", "keep"});
  const GaussianCloud before = *ReadCloud(scan_), after = *ReadCloud(folder_ / "up.ply");
  EXPECT_FLOAT_EQ(after.means[0], before.means[0]);
  EXPECT_FLOAT_EQ(after.means[1], -before.means[1]);
  EXPECT_FLOAT_EQ(after.means[2], -before.means[2]);
}

// A PLY with a label and normals beside its Gaussians.
std::string WriteLabelledScan(const std::filesystem::path& path) {
  std::ofstream out(path);
  out << "ply\nformat ascii 1.0\nelement vertex 300\nproperty uchar label\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0",
                           "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"}) {
    out << "property float " << name << '\n';
  }
  out << "end_header\n";
  for (int i = 1; i <= 300; ++i) {
    out << i % 200 << ' ' << i << ".5 " << i * 7 % 30 << ' ' << i * 11 % 20 << " 0 0 " << i << " 0 0 0 " << i % 9
        << " -1 -1 -1 1 0 0 0\n";
  }
  return path;
}

TEST_F(ConvertVerb, KeepsWhatAPlySaysBesideItsGaussians) {
  const std::string extras = WriteLabelledScan(folder_ / "extras.ply");
  const auto has_labels = [&](const char* name) {
    return FileBytes(folder_ / name).find("property uchar label") != std::string::npos;
  };
  EXPECT_THAT(ExpectDone({"convert", extras, folder_ / "kept.ply", "--min-opacity", "0.6", "--sort", "morton"}).err,
              IsEmpty());
  EXPECT_TRUE(has_labels("kept.ply"));
  EXPECT_THAT(ExpectDone({"info", folder_ / "kept.ply"}).out, HasSubstr("other properties  nx ny nz label"));
  EXPECT_THAT(ExpectDone({"convert", extras, folder_ / "lost.spz"}).err,
              HasSubstr("extra properties of the input dropped: label, normals"));
  // So does the filter, which leaves the Gaussians; those of a network are others.
  EXPECT_THAT(ExpectDone({"enhance", extras, "-o", folder_ / "filtered.ply", "--method", "filter", "--pixel-size",
                          "0.1", "--mode", "classic"})
                  .err,
              IsEmpty());
  EXPECT_TRUE(has_labels("filtered.ply"));
  EXPECT_THAT(ExpectDone({"enhance", extras, "-o", folder_ / "others.ply", "--method", "model", "--pixel-size", "0.4",
                          "--mode", "classic"})
                  .err,
              HasSubstr("extra properties dropped, as the Gaussians changed: label, normals"));
  EXPECT_FALSE(has_labels("others.ply"));
}

TEST_F(ConvertVerb, WeightsOfANetwork) {
  const std::string weights = SourceDirForTest() / "testdata/compact/small.safetensors";
  ExpectRefused({"convert", weights, folder_ / "out.safetensors"}, ErrorCode::kBadFile);
}

}  // namespace
}  // namespace anchorsplat
