#include <algorithm>
#include <cmath>

#include "cli/run_for_test.h"
#include "cli/small_scan_for_test.h"
#include "core/text.h"
#include "dataset/small_dataset_for_test.h"
#include "formats/cloud_io.h"
#include "formats/opened_splat.h"
#include "io/folder_for_test.h"
#include "request/findings.h"

namespace anchorsplat {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class InfoVerb : public testing::Test {
 protected:
  TestFolder folder_;
};

TEST_F(InfoVerb, OfASplat) {
  const std::string input = Biplane() / "input.ply";
  const ProgramRun table = ExpectDone({"info", input});
  EXPECT_THAT(table.out, AllOf(HasSubstr("20,000, SH degree 3"), HasSubstr("training pixel  0.00"),
                               HasSubstr("size as:"), HasSubstr("largest axis")));
  EXPECT_THAT(table.err, IsEmpty());
  const nlohmann::json json = ExpectJson({"info", input});
  EXPECT_EQ(json["file"], input);
  EXPECT_EQ(json["format"], "PLY");
  EXPECT_EQ(json["gaussians"], 20000);
  EXPECT_EQ(json["sh_degree"], 3);
  EXPECT_EQ(json["bytes"], std::filesystem::file_size(input));
  EXPECT_NEAR(json["predicted_bytes"]["PLY"].get<double>(), json["bytes"].get<double>(), 1000);  // comments
  EXPECT_EQ(json["counts"]["not_finite"], 0);
  EXPECT_THAT(table.out, Not(HasSubstr("looks like"))) << "as the file says its render mode";
  EXPECT_THAT(table.out, ContainsRegex("can sharpen  yes: network, pixel size 0.00[0-9]+, about .[0-9.]+ dB at 4x"));
  EXPECT_EQ(json["reading"]["looks"], "classic");
  EXPECT_EQ(json["reading"]["probabilities"].size(), kProvenanceCount);
  EXPECT_NEAR(json["reading"]["pixel"].get<double>(), 0.0055, 0.002);
  EXPECT_LT(json["reading"]["low"], json["reading"]["pixel"]);
  EXPECT_GT(json["reading"]["high"], json["reading"]["pixel"]);
  EXPECT_EQ(json["treatment"]["method"], "network");
  EXPECT_EQ(json["treatment"]["mode"], "classic");
  EXPECT_GT(json["treatment"]["gain"], 0);
}

// Two splats of different pixels that somebody merged.
TEST_F(InfoVerb, OfThingsThatLieApart) {
  auto small = ReadCloud(Biplane() / "input.ply");
  ASSERT_TRUE(small.ok());
  GaussianCloud merged = *small;
  for (float& x : merged.means) x = 3 * x + 4;
  for (float& x : merged.log_scales) x += std::log(3.0f);
  ASSERT_TRUE(Append(merged, *small).ok());
  const std::string input = folder_ / "merged.ply";
  ASSERT_TRUE(WriteCloud(input, merged).ok());
  const ProgramRun run =
      ExpectDone({"enhance", input, "-o", folder_ / "out.ply", "--method", "filter", "--mode", "classic", "--json"});
  EXPECT_THAT(run.err, HasSubstr("2 separate parts"));
  const nlohmann::json enhanced = run.json()[0];
  EXPECT_EQ(enhanced["pixel_size"]["source"], "read");
  EXPECT_GE(enhanced["seconds_in_all"].get<double>(), enhanced["seconds"].get<double>());
  ASSERT_EQ(enhanced["parts"].size(), 2u);
  double sizes[2];
  for (size_t k = 0; k < 2; ++k) {
    sizes[k] = enhanced["parts"][k]["pixel_size"];
    EXPECT_NEAR(enhanced["parts"][k]["gaussians"].get<double>(), 20000, 500);
    EXPECT_EQ(enhanced["parts"][k]["by_network"], false);
  }
  std::sort(sizes, sizes + 2);
  EXPECT_NEAR(sizes[0], 0.0055, 0.0025);
  EXPECT_NEAR(sizes[1] / sizes[0], 3, 0.2);
}

TEST_F(InfoVerb, OfWhatFormatsSayAboutThemselves) {
  const std::string scan = WriteScan(folder_ / "scan.ply");
  for (const char* name : {"scan.spz", "scan.glb", "scan.sog"}) ExpectDone({"convert", scan, folder_ / name});
  const nlohmann::json spz = ExpectJson({"info", folder_ / "scan.spz"});
  EXPECT_EQ(spz["facts"]["version"], "4, a zstd stream per attribute");
  EXPECT_THAT(spz["facts"]["positions"].get<std::string>(), testing::StartsWith("1"));
  EXPECT_THAT(ExpectDone({"info", folder_ / "scan.glb"}).out, HasSubstr("kernel  ellipse"));
  EXPECT_THAT(ExpectDone({"info", folder_ / "scan.sog"}).out, HasSubstr("a ZIP archive"));
}

// Who has the right to be named, through the formats that can say it and with a word where one cannot.
TEST_F(InfoVerb, OfCredits) {
  GaussianCloud cloud = SmallScan(50, 0);
  cloud.comments = {"world up: 0 1 0", "credit: Mug by Ann, CC BY 4.0"};
  const std::string scan = folder_ / "scan.ply";
  ASSERT_TRUE(WriteCloud(scan, cloud).ok());
  EXPECT_THAT(ExpectDone({"info", scan}).out, HasSubstr("credit       Mug by Ann, CC BY 4.0\n"));
  const nlohmann::json credits = {"Mug by Ann, CC BY 4.0"};
  for (const char* name : {"scan.compressed.ply", "scan.sog", "scan.glb", "scan.gltf"}) {
    EXPECT_THAT(ExpectDone({"convert", scan, folder_ / name}).err, Not(HasSubstr("credits"))) << name;
    EXPECT_EQ(ExpectJson({"info", folder_ / name})["credits"], credits) << name;
  }
  for (const char* name : {"scan.spz", "scan.splat", "scan.csv", "scan.npz"}) {
    EXPECT_THAT(ExpectDone({"convert", scan, folder_ / name}).err,
                HasSubstr("cannot store credits: publish \"Mug by Ann, CC BY 4.0\" with it"))
        << name;
  }
  EXPECT_THAT(ExpectRefused({"info", folder_ / "scan.npz"}, ErrorCode::kBadFile).err,
              HasSubstr("is an NPZ file, which can be written but not read"));
}

// Files that are gone through block by block give the numbers that reading them gives, with any number of threads.
TEST_F(InfoVerb, OfEveryFormatAsIfItWereReadWhole) {
  GaussianCloud cloud = *ReadCloud(Biplane() / "input.ply");
  for (size_t i = 0; i < static_cast<size_t>(cloud.size()); i += 97) {
    cloud.sh[i * static_cast<size_t>(cloud.sh_stride()) + 30] = std::nanf("");
    cloud.opacity_logits[i + 1] = -40;
    cloud.means[3 * (i + 2)] *= 3000;
    cloud.log_scales[3 * (i + 3)] = -INFINITY;
    std::fill_n(&cloud.quats[4 * (i + 4)], 4, 0.0f);
  }
  cloud.comments.push_back("credit: Mug by Ann, CC BY 4.0");
  for (const char* name : {"a.ply", "a.spz", "old.spz", "a.glb", "a.gltf", "a.splat", "a.compressed.ply", "a.sog"}) {
    const std::string path = folder_ / name;
    CloudWriteOptions options;
    if (std::string_view(name).starts_with("old")) options.spz_version = 3;
    ASSERT_TRUE(WriteCloud(path, cloud, options).ok());
    const auto read = ReadCloud(path);
    ASSERT_TRUE(read.ok()) << read.error().message;
    nlohmann::json expected = ToJson(InspectSplat(CloudView(*read)));
    nlohmann::json shown = ExpectJson({"info", path});
    EXPECT_EQ(ExpectJson({"info", path, "--threads", "1"}), shown) << name;
    EXPECT_EQ(shown["bytes"], OpenedSplat::Open(path)->bytes());
    for (const char* of_files : {"file", "format", "facts", "bytes"}) expected.erase(of_files), shown.erase(of_files);
    EXPECT_EQ(shown.dump(1), expected.dump(1)) << name;
  }
}

TEST_F(InfoVerb, OfASplatOfNaN) {
  const std::string scan = WriteNanScan(folder_ / "nan.ply");
  const std::string out = ExpectDone({"info", scan}).out;
  EXPECT_THAT(out, HasSubstr("2 of 2 Gaussians with NaN"));
  // It is named as a problem and shown nowhere as a number.
  EXPECT_THAT(out.substr(out.find('\n'), out.find("found:") - out.find('\n')), Not(ContainsRegex("[nN][aA][nN]")));
  const nlohmann::json json = ExpectJson({"info", scan});
  EXPECT_EQ(json["counts"]["not_finite"], 2);
  EXPECT_EQ(json["bounds"], nullptr);
  EXPECT_EQ(json["reading"], nullptr);
  EXPECT_EQ(json["treatment"]["method"], "none");
}

// Of an example that has its width and does not say so: nothing, or less than half of its pixel is taken. What info
// says is what enhance does.
void ExpectLittleIsDone(const std::string& splat, const std::string& output) {
  const nlohmann::json info = ExpectJson({"info", splat})["treatment"];
  const ProgramRun run = ExpectDone({"enhance", splat, "-o", output, "--json"});
  const nlohmann::json enhanced = run.json()[0];
  if (info["method"] == "none") {
    EXPECT_EQ(enhanced["filter_strength"], 0);
    EXPECT_THAT(run.err, AllOf(HasSubstr("left unchanged: "), HasSubstr("--mode classic")));
    return;
  }
  EXPECT_LT(info["pixel"], 0.5 * 0.0055);
  EXPECT_EQ(enhanced["method"], info["method"] == "network" ? "model" : "filter");
  EXPECT_FLOAT_EQ(enhanced["pixel_size"]["value"].get<float>(), info["pixel"].get<float>());
}

// How a splat was trained that does not say so.
TEST_F(InfoVerb, OfUntaggedSplats) {
  const std::string fit = folder_ / "fit.splat", filtered = folder_ / "filtered.splat";
  ExpectDone({"convert", Biplane() / "input.ply", fit});  // has no place for tags
  EXPECT_THAT(ExpectDone({"info", fit}).out, HasSubstr("looks like   a classic 3DGS fit ("));
  ExpectDone({"enhance", fit, "-o", filtered, "--method", "filter", "--pixel-size", "0.0055"});
  EXPECT_EQ(ExpectJson({"info", filtered})["reading"]["looks"], "filtered");
  ExpectLittleIsDone(filtered, folder_ / "again.ply");
  // Files that say it need not be looked at.
  EXPECT_THAT(
      ExpectDone({"enhance", fit, "-o", folder_ / "filtered.ply", "--method", "filter", "--pixel-size", "0.0055"}).out,
      HasSubstr("filter strength 0.74"));
  EXPECT_THAT(ExpectDone({"info", folder_ / "filtered.ply"}).out,
              AllOf(HasSubstr("can sharpen  no: its comments say"), Not(HasSubstr("looks like"))));
  const ProgramRun twice =
      ExpectDone({"enhance", folder_ / "filtered.ply", "-o", folder_ / "twice.ply", "--copies", "2"});
  EXPECT_THAT(twice.err, AllOf(HasSubstr("already enhanced"), HasSubstr("--copies has no effect")));
  EXPECT_THAT(twice.out, HasSubstr("left unchanged"));
}

// Formats that keep no comments keep what networks leave: Gaussians in twins.
TEST_F(InfoVerb, OfEnhancedSplatsThatDoNotSaySo) {
  const std::string enhanced = folder_ / "enhanced.ply", lost = folder_ / "lost.splat", again = folder_ / "again.ply";
  ExpectDone({"enhance", SourceDirForTest() / "examples/tankard/input.ply", "-o", enhanced, "--method", "model"});
  ExpectDone({"convert", enhanced, lost});
  ExpectLittleIsDone(lost, again);
  // Whoever knows better is believed.
  EXPECT_THAT(ExpectDone({"enhance", lost, "-o", again, "-w", "--method", "filter", "--mode", "classic", "--pixel-size",
                          "0.0055"})
                  .out,
              HasSubstr("filter strength 0.74"));
}

// What is understood of the tags, and what --mode says instead.
TEST_F(InfoVerb, OfTheRenderMode) {
  const std::string scan = WriteScan(folder_ / "modes.ply");
  const auto mode_of = [](const std::string& file) { return ExpectJson({"info", file})["render_mode"]; };
  EXPECT_EQ(mode_of(scan), nullptr);
  for (const char* mode : {"classic", "antialiased", "mip"}) {
    const std::string ply = folder_ / (std::string(mode) + ".ply");
    EXPECT_THAT(ExpectDone({"convert", scan, ply, "--mode", mode}).err, Not(HasSubstr("warning")));
    EXPECT_EQ(mode_of(ply), mode);
    const std::string packed = folder_ / (std::string(mode) + ".compressed.ply");
    ExpectDone({"convert", ply, packed});
    EXPECT_EQ(mode_of(packed), mode);
  }
  const std::string mip = folder_ / "mip.ply", spz = folder_ / "mip.spz";
  EXPECT_THAT(ExpectDone({"convert", mip, spz}).err, AllOf(HasSubstr("0.3 px²"), HasSubstr("--mode mip")));
  EXPECT_EQ(mode_of(spz), "antialiased");
  EXPECT_THAT(ExpectDone({"convert", mip, folder_ / "mip.splat"}).err, HasSubstr("cannot store the render mode mip"));
  EXPECT_EQ(
      ExpectRefused({"convert", scan, folder_ / "x.ply", "--mode", "blurred"}, ErrorCode::kBadArgument, {"--mode"}).out,
      "");

  // Drawn in its own mode, and enhanced in the one that is said.
  const auto psnr = [&](const std::string& a, const std::string& b) {
    return ExpectJson({"compare", a, b, "--orbit", "1", "--size", "48x48"})["mean"]["psnr"];
  };
  EXPECT_EQ(psnr(scan, folder_ / "classic.ply"), nullptr);
  EXPECT_LT(psnr(scan, mip), 60);
  EXPECT_LT(psnr(folder_ / "antialiased.ply", mip), 60);
  EXPECT_EQ(ExpectJson({"compare", scan, mip, "--orbit", "1", "--size", "48x48", "--mode", "mip"})["mean"]["psnr"],
            nullptr);
  const std::string out = folder_ / "enhanced.ply";
  ExpectDone({"enhance", scan, "-o", out, "--method", "filter", "--pixel-size", "0.02", "--mode", "mip"});
  EXPECT_EQ(mode_of(out), "mip");
  ExpectDone({"view", scan, "-o", folder_ / "page.html", "--mode", "mip"});
  EXPECT_THAT(FileBytes(folder_ / "page.html"), HasSubstr("\"mode\":\"mip\""));
}

TEST_F(InfoVerb, OfANetwork) {
  const std::string weights = SourceDirForTest() / "testdata/compact/small.safetensors";
  EXPECT_THAT(ExpectDone({"info", weights}).out, AllOf(HasSubstr("anchorsplat-compact"), HasSubstr("4,675 in 40")));
  const nlohmann::json json = ExpectJson({"info", weights});
  EXPECT_EQ(json["kind"], "model");
  EXPECT_EQ(json["parameters"], 4675);
  EXPECT_EQ(json["metadata"]["option.copies"], "2");
  const nlohmann::json shipped = ExpectJson({"info", SourceDirForTest() / "models/anchorsplat-compact.safetensors"});
  EXPECT_TRUE(shipped["metadata"].contains("object_names"));
  WriteText(folder_ / "cut.safetensors", FileBytes(weights).substr(0, 9000));
  ExpectRefused({"info", folder_ / "cut.safetensors"}, ErrorCode::kBadFile, {"cut.safetensors"});
}

TEST_F(InfoVerb, OfAMesh) {
  const std::string mesh = WriteTetrahedron(folder_.path(), "tetra");
  EXPECT_THAT(ExpectDone({"info", mesh}).out, AllOf(HasSubstr("triangles   4"), HasSubstr("materials   4")));
  const nlohmann::json json = ExpectJson({"info", mesh});
  EXPECT_EQ(json["kind"], "mesh");
  EXPECT_EQ(json["triangles"], 4);
  EXPECT_EQ(json["warnings"], nlohmann::json::array());
}

TEST_F(InfoVerb, RefusesWhatIsNoSplat) {
  WriteText(folder_ / "points.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n");
  const ProgramRun run = ExpectRefused({"info", folder_ / "points.ply", "--json"}, ErrorCode::kBadFile, {"points.ply"});
  EXPECT_EQ(run.json()["error"]["code"], "bad_file");
  WriteText(folder_ / "text.splat", FileBytes(SourceDirForTest() / "docs/architecture.md").substr(0, 3200));
  ExpectRefused({"info", folder_ / "text.splat"}, ErrorCode::kBadFile, {"is text, not a .splat file"});
  WriteText(folder_ / "empty.splat", "");
  ExpectRefused({"info", folder_ / "empty.splat"}, ErrorCode::kBadFile, {"empty.splat: is empty"});
  ExpectRefused({"info", folder_ / "\x1b[2J\xff.ply"}, ErrorCode::kNotFound, {"\\x1b[2J\\xff.ply: no such file"});
  ExpectRefused({"info"}, ErrorCode::kBadArgument, {"file"});
  ExpectRefused({"info", folder_ / "points.ply", "--from", "magic"}, ErrorCode::kBadArgument, {"--from: 'magic'"});
}

}  // namespace
}  // namespace anchorsplat
