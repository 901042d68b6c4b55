#include <algorithm>
#include <map>

#include "cli/run_for_test.h"
#include "cli/small_scan_for_test.h"
#include "core/text.h"
#include "dataset/small_dataset_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

// No file is lost: inputs stay, nothing is replaced that was not to be, names that cannot be are errors. What comes
// into being while a verb works is in behaviour/interruptions_test.sh.
class KeptFiles : public testing::Test {
 protected:
  // The command is refused, and the files are what they were.
  void ExpectKept(const std::vector<fs::path>& files, const std::vector<std::string>& words,
                  const std::source_location& at = std::source_location::current()) {
    std::map<fs::path, std::string> before;
    for (const fs::path& file : files) before[file] = FileBytes(file);
    ExpectRefused(words, ErrorCode::kBadArgument, {"write to another name"}, at);
    for (const fs::path& file : files) EXPECT_EQ(FileBytes(file), before[file]) << file;
  }
  static std::vector<fs::path> FilesIn(const fs::path& folder) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
    std::ranges::sort(files);
    return files;
  }

  TestFolder folder_;
  std::string scan_ = WriteScan(folder_ / "scan.ply");
};

TEST_F(KeptFiles, InputUnderItsOwnNameAndThroughLinks) {
  const fs::path own = WriteScan(folder_ / "own.spz");
  fs::create_symlink("own.spz", folder_ / "link.spz");
  for (const char* output : {"own.spz", "link.spz"}) {
    ExpectKept({own}, {"convert", own, folder_ / output, "-w"});
    ExpectKept({own}, {"enhance", own, "-o", folder_ / output, "-w", "--pixel-size", "0.02"});
  }
  ExpectKept({own}, {"enhance", own, "--out-dir", folder_.path(), "-w", "--pixel-size", "0.02"});
  ExpectKept({own, scan_}, {"convert", scan_, own, "--out-dir", folder_.path(), "--to", "spz", "-w"});
}

// One of several files that are written.
TEST_F(KeptFiles, BufferOfAGltf) {
  const fs::path input = folder_ / "z.bin";
  fs::copy_file(scan_, input);
  ExpectKept({input}, {"convert", input, folder_ / "z.gltf", "-w"});
  ExpectKept({input}, {"enhance", input, "-o", folder_ / "z.gltf", "--pixel-size", "0.02", "-w"});

  const fs::path gltf = folder_ / "a.gltf", buffer = folder_ / "b.bin";
  ExpectDone({"convert", scan_, gltf});
  fs::rename(folder_ / "a.bin", buffer);
  std::string text = FileBytes(gltf);
  text.replace(text.find("a.bin"), 5, "b.bin");
  WriteText(gltf, text);
  ExpectKept({gltf, buffer}, {"convert", gltf, folder_ / "b.gltf", "-w"});
  // Nor that of an input that is read later.
  fs::create_directory(folder_ / "batch");
  fs::create_hard_link(buffer, folder_ / "batch/b.bin");
  fs::copy_file(scan_, folder_ / "b.ply");
  ExpectKept({buffer}, {"convert", folder_ / "b.ply", gltf, "--out-dir", folder_ / "batch", "--to", "gltf", "-w"});
}

TEST_F(KeptFiles, PicturesOfASog) {
  for (const char* name : {"own", "links", "hard"}) fs::create_directory(folder_ / name);
  ExpectDone({"convert", scan_, folder_ / "own/meta.json"});
  const fs::path input = folder_ / "own/old.json";
  fs::rename(folder_ / "own/meta.json", input);
  const std::vector<fs::path> files = FilesIn(folder_ / "own");
  for (const fs::path& file : files) {
    fs::create_symlink(file, folder_ / "links" / file.filename());
    fs::create_hard_link(file, folder_ / "hard" / file.filename());
  }
  for (const std::string to : {"own", "links", "hard"}) {
    ExpectKept(files, {"convert", input, folder_ / to / "meta.json", "-w"});
  }
}

TEST_F(KeptFiles, PicturesThatAreReadOrThatCamerasName) {
  const fs::path project = WriteProject(folder_ / "project"), views = project / "views";
  const std::vector<fs::path> pictures = FilesIn(views);
  const fs::path &one = pictures.front(), &two = pictures.back();
  const std::string cameras = project / "transforms.json";
  ExpectKept({one}, {"compare", one, two, "--side-by-side", one, "-w"});
  fs::create_symlink(one, folder_ / "linked.png");
  ExpectKept({one}, {"compare", one, two, "--side-by-side", folder_ / "linked.png", "-w"});
  ExpectKept(pictures, {"render", scan_, "--cameras", cameras, "-o", views, "-w"});
  fs::create_symlink(one, folder_ / "page.html");
  ExpectKept({one}, {"view", scan_, "-o", folder_ / "page.html", "--truth", views, "--cameras", cameras, "-w"});
  const auto fit = [&](const std::vector<std::string>& words) {
    std::vector<std::string> all = {"fit", project, "--init-points", "50", "--steps", "2", "-w"};
    all.insert(all.end(), words.begin(), words.end());
    return all;
  };
  ExpectKept(pictures, fit({"-o", folder_ / "x.ply", "--gsplat-checkpoint", one}));
  ExpectKept(pictures, fit({"-o", folder_ / "x.ply", "--checkpoint", one}));
  ExpectKept({scan_}, {"fit", project, "-o", scan_, "--init-splat", scan_, "-w", "--steps", "2"});
}

TEST_F(KeptFiles, WhatAVerbLeftItselfIsReplaced) {
  const fs::path project = WriteProject(folder_ / "project");
  const std::string one = project / "views/000.png", two = project / "views/001.png";
  for (const std::string time : {"1", "2"}) {
    SCOPED_TRACE(time);
    ExpectDone({"convert", scan_, folder_ / "again.gltf", "-w"});
    ExpectDone(
        {"enhance", scan_, "-o", folder_ / "again.ply", "--pixel-size", "0.02", "--method", "filter", "--view", "-w"});
    ExpectDone({"render", scan_, "-o", folder_ / "renders", "--cameras", project, "-w"});
    ExpectDone({"compare", one, two, "--side-by-side", folder_ / "sides.png", "-w"});
    ExpectDone({"fit", project, "-o", folder_ / "fit.ply", "--gsplat-checkpoint", folder_ / "fit.pt", "--init-points",
                "50", "--steps", "3", "-w"});
    ExpectDone({"eval", SourceDirForTest() / "examples", "-o", folder_ / "eval", "--objects", "biplane", "--max-views",
                "1", "--methods", "raw", "--seed", time});
  }
}

// Names that are too long and links that lead nowhere are errors like others, for every path of every verb.
class ImpossibleNames : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    fs::create_symlink("loop2", folder_ / "loop1");
    fs::create_symlink("loop1", folder_ / "loop2");
    WriteText(folder_ / "recipe.toml", "[optimizer]\n");
  }
  // The name with this ending, which is a link to itself where that can be made.
  std::string Bad(const std::string& ending) const {
    const fs::path path = (folder_ / GetParam()).string() + ending;
    std::error_code ignored;
    fs::create_symlink(path.filename(), path, ignored);
    return path;
  }
  static void Answered(const std::vector<std::string>& words) {
    const ProgramRun run = RunWords(words);
    EXPECT_THAT(run.code, testing::Le(6)) << run.command << '\n' << run.err;
    EXPECT_THAT(run.err, Not(HasSubstr("please report"))) << run.command;
  }
  static void Refused(const std::vector<std::string>& words) {
    const ProgramRun run = RunWords(words);
    EXPECT_THAT(run.code, testing::AllOf(testing::Ge(2), testing::Le(6))) << run.command << '\n' << run.err;
    EXPECT_THAT(run.err, Not(HasSubstr("please report"))) << run.command;
  }
  std::string New(const std::string& name) const { return folder_ / ("new-" + name); }

  TestFolder folder_;
  std::string scan_ = WriteScan(folder_ / "scan.ply", 50);
  std::string project_ = WriteProject(folder_ / "project");
  std::string mesh_ = WriteTetrahedron(folder_.path(), "tetra");
};

TEST_P(ImpossibleNames, AreRefused) {
  const std::string examples = SourceDirForTest() / "examples";
  for (const char* ending : {"", ".ply", ".json", ".obj"}) {
    const std::string path = Bad(ending);
    Refused({"info", path});
    Refused({"convert", path, New("x.ply")});
    Refused({"convert", scan_, "--out-dir", path, "--to", "ply"});
    Refused({"enhance", path, "-o", New("x.ply")});
    Refused({"enhance", scan_, "--out-dir", path});
    Refused({"enhance", scan_, "-o", New("x.ply"), "--cameras", path});
    Refused({"enhance", scan_, "-o", New("x.ply"), "--model", path});
    Refused({"enhance", scan_, "-o", New("x.ply"), "--pixel-size", "0.02", "--images", path});
    Refused({"render", path, "-o", New("x.png"), "--orbit", "1"});
    Refused({"render", scan_, "-o", New("x.png"), "--cameras", path});
    Refused({"render", scan_, "-o", path, "--orbit", "2", "--size", "8x8"});
    Refused({"compare", path, scan_, "--orbit", "1"});
    Refused({"compare", scan_, scan_, "--truth", path, "--orbit", "1"});
    Refused({"eval", path, "-o", New("eval")});
    Refused({"eval", examples, "-o", path});
    Refused({"view", path, "-o", New("x.html")});
    Refused({"view", scan_, "-o", New("x.html"), "--before", path});
    Refused({"view", scan_, "-o", New("x.html"), "--cameras", path});
    Refused({"view", scan_, "-o", New("x.html"), "--cameras", project_, "--truth", path});
    Refused({"fit", path, "-o", New("x.ply")});
    Refused({"fit", project_, "-o", New("x.ply"), "--init-splat", path});
    Refused({"views", path, "-o", New("views")});
    Refused({"views", mesh_, "-o", path, "--views", "2", "--size", "8", "--low-size", "4"});
    Refused({"dataset", "build", mesh_, "-o", path});
    Refused({"dataset", "build", "--list", path, "--objects", folder_.path(), "-o", New("set")});
    Refused({"dataset", "build", mesh_, "--recipe", path, "-o", New("set")});
    Refused({"dataset", "split", path});
    Refused({"dataset", "check", path});
    Refused({"dataset", "info", path});
    Refused({"train", project_, "--config", path, "-o", New("run")});
    Refused({"bench", "pixel-size", path});
  }
  Refused({"convert", scan_, Bad(".ply")});
  Refused({"convert", scan_, Bad(".gltf")});
  Refused({"convert", scan_, Bad("/meta.json")});
  Refused({"enhance", scan_, "-o", Bad(".ply")});
  Refused({"render", scan_, "-o", Bad(".png"), "--orbit", "1", "--size", "8x8"});
  Refused({"compare", scan_, scan_, "--orbit", "1", "--size", "8x8", "--side-by-side", Bad(".png")});
  Refused({"view", scan_, "-o", Bad(".html")});
  const std::vector<std::string> fit = {"fit", project_, "--steps", "2", "--init-points", "50"};
  const auto fitted = [&](const std::vector<std::string>& words) {
    std::vector<std::string> all = fit;
    all.insert(all.end(), words.begin(), words.end());
    return all;
  };
  Refused(fitted({"-o", Bad(".ply")}));
  Refused(fitted({"-o", New("x.ply"), "--gsplat-checkpoint", Bad(".pt")}));
  Answered(fitted({"-o", folder_ / "checked.ply", "--checkpoint", Bad(""), "-w"}));
  Answered(fitted({"-o", folder_ / "checked.ply", "--checkpoint", Bad(""), "--resume", "-w"}));
  Answered({"enhance", scan_, "-o", folder_ / "checked.ply", "--method", "refine", "--pixel-size", "0.02", "--mode",
            "classic", "--steps", "1", "--poses", "8", "--checkpoint", Bad(""), "--resume", "-w"});
  for (const auto& entry : fs::directory_iterator(folder_.path())) {
    EXPECT_THAT(entry.path().filename().string(), Not(testing::StartsWith("new-")));
  }
}

INSTANTIATE_TEST_SUITE_P(Names, ImpossibleNames, testing::Values(std::string(300, 'x'), "loop1", "loop1/deeper"),
                         [](const auto& name) {
                           return name.param == "loop1" ? "Loop" : name.param.size() > 100 ? "Long" : "BehindALoop";
                         });

}  // namespace
}  // namespace anchorsplat
