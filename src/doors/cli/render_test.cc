#include "cli/run_for_test.h"
#include "cli/small_scan_for_test.h"
#include "images/image_io.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class RenderVerb : public testing::Test {
 protected:
  // `render scan -o out WORDS`
  std::vector<std::string> Render(const std::string& out, const std::vector<std::string>& words) {
    std::vector<std::string> all = {"render", scan_, "-o", folder_ / out};
    all.insert(all.end(), words.begin(), words.end());
    return all;
  }
  std::string Cameras() { return (fs::path(WriteProject(folder_ / "project")) / "transforms.json").string(); }

  TestFolder folder_;
  std::string scan_ = WriteScan(folder_ / "scan.ply");
};

TEST_F(RenderVerb, OnePicture) {
  const ProgramRun run = ExpectDone(Render("one.png", {"--orbit", "1", "--size", "96x64"}));
  EXPECT_THAT(run.out, HasSubstr("rendered 1 view of 200 Gaussians"));
  EXPECT_THAT(run.err, IsEmpty());
  const auto image = ReadImage(folder_ / "one.png");
  ASSERT_TRUE(image.ok());
  EXPECT_EQ(image->width, 96);
  EXPECT_EQ(image->height, 64);
  EXPECT_EQ(image->channels, 3);
  ExpectRefused(Render("one.png", {"--orbit", "1"}), ErrorCode::kExists, {"one.png"});
}

TEST_F(RenderVerb, OnePictureOfEveryCamera) {
  const std::string cameras = Cameras();
  const nlohmann::json json = ExpectJson(Render("views", {"--cameras", cameras, "--size", "32x32"}));
  EXPECT_EQ(json["gaussians"], 200);
  ASSERT_EQ(json["views"].size(), 10u);
  for (const nlohmann::json& view : json["views"]) EXPECT_TRUE(fs::exists(view["file"].get<std::string>()));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "views"), {}), 10);
  ExpectDone(Render("003.png", {"--cameras", cameras, "--view", "003", "--size", "32x32"}));
  EXPECT_EQ(FileBytes(folder_ / "003.png"), FileBytes(folder_ / "views/003.png"));
  ExpectDone(Render("clear.png", {"--cameras", cameras, "--view", "003", "--transparent"}));
  EXPECT_EQ(ReadImage(folder_ / "clear.png")->channels, 4);
  ExpectRefused(Render("x.png", {"--cameras", cameras, "--view", "999"}), ErrorCode::kBadArgument, {"999"});
  ExpectRefused(Render("x", {"--cameras", cameras, "--size", "100x50"}), ErrorCode::kBadArgument,
                {"another aspect ratio"});
  ExpectRefused(Render("x", {"--cameras", cameras, "--radius", "3"}), ErrorCode::kBadArgument, {"--radius"});
}

// A rig: what tells its views apart is the folder.
TEST_F(RenderVerb, ViewsOfARig) {
  std::string frames;
  for (const char* name : {"images/cam0/0000.png", "images/cam1/0000.png", "images/cam1/0001.png"}) {
    frames += std::string(frames.empty() ? "" : ",") + R"({"file_path": ")" + name +
              R"(", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,4],[0,0,0,1]]})";
  }
  const std::string cameras = folder_ / "transforms.json", out = folder_ / "rig", one = folder_ / "one.png";
  WriteText(cameras, R"({"w": 16, "h": 12, "fl_x": 20, "frames": [)" + frames + "]}");
  ExpectDone({"render", scan_, "--cameras", cameras, "-o", out});
  for (const char* name : {"cam0/0000.png", "cam1/0000.png", "cam1/0001.png"}) {
    EXPECT_TRUE(fs::exists(fs::path(out) / name)) << name;
  }
  ExpectDone({"render", scan_, "--cameras", cameras, "-o", one, "--view", "cam1/0000"});
  ExpectRefused({"render", scan_, "--cameras", cameras, "-o", one, "--view", "0000", "-w"}, ErrorCode::kBadArgument,
                {"several views are called '0000'", "cam0/0000"});
  ExpectRefused({"render", scan_, "--cameras", cameras, "-o", one, "--view", "cam2/0000", "-w"},
                ErrorCode::kBadArgument, {"no view is called 'cam2/0000'"});
  EXPECT_EQ(ExpectJson({"compare", scan_, out, "--cameras", cameras})["views"][1]["name"], "cam1/0000");
}

// −y unless somebody knows better.
TEST_F(RenderVerb, UpOfAnOrbit) {
  const auto picture = [&](const std::string& name, const std::string& scan, std::vector<std::string> words) {
    words.insert(words.begin(), {"render", scan, "-o", folder_ / name, "--orbit", "2", "--size", "64x64"});
    ExpectDone(words);
    return FileBytes(folder_ / name / "001.png");
  };
  const std::string cameras = Biplane() / "transforms_lr.json";
  const std::string usual = picture("usual", scan_, {});
  EXPECT_EQ(picture("said", scan_, {"--up=-y"}), usual);
  const std::string of_cameras = picture("cameras", scan_, {"--cameras", cameras});
  EXPECT_NE(of_cameras, usual);
  // As the comment says that `enhance --cameras` leaves.
  ExpectDone(
      {"enhance", scan_, "-o", folder_ / "comment.ply", "--method", "filter", "--upscale", "1", "--cameras", cameras});
  EXPECT_EQ(picture("comment", folder_ / "comment.ply", {}), of_cameras);
  // `compare` takes the cameras' up, too.
  const nlohmann::json json =
      ExpectJson({"compare", scan_, folder_ / "cameras", "--orbit", "2", "--size", "64x64", "--cameras", cameras});
  EXPECT_GT(json["mean"]["psnr"], 45);
  ExpectRefused(Render("x", {"--orbit", "2", "--up", "0,0,0"}), ErrorCode::kBadArgument,
                {"--up: '0,0,0' is not a direction"});
}

TEST_F(RenderVerb, SaysWhatIsNotToBeSeen) {
  EXPECT_THAT(ExpectDone(Render("far", {"--orbit", "10", "--size", "32x32", "--near", "100"})).err,
              AllOf(HasSubstr("shows nothing of the 200 Gaussians: 200 before the near plane (100)"),
                    HasSubstr("Check --near and --far (9 more of 10 views are as empty)")));
  EXPECT_THAT(ExpectDone({"compare", scan_, scan_, "--orbit", "2", "--size", "32x32", "--far", "0.1"}).err,
              HasSubstr("200 beyond the far plane (0.1)"));
  WriteNanScan(folder_ / "nan.ply");
  EXPECT_THAT(
      ExpectDone({"render", folder_ / "nan.ply", "-o", folder_ / "none.png", "--orbit", "1", "--size", "32x32"}).err,
      HasSubstr("2 of 2 Gaussians are not drawn"));
}

TEST_F(RenderVerb, RefusesWhatMakesNoSense) {
  const auto refused = [&](const std::string& out, const std::vector<std::string>& words, const std::string& why) {
    ExpectRefused(Render(out, words), ErrorCode::kBadArgument, {why});
  };
  refused("two.png", {"--orbit", "2"}, "is one picture, but there are 2 views");
  refused("x.jpg", {"--orbit", "1"}, "written as .png");
  refused("x.png", {"--orbit", "1", "--size", "0x5"}, "--size");
  refused("x.png", {"--orbit", "1", "--size", "32768x32768"}, "pixels");
  refused("x.png", {"--orbit", "0"}, "--orbit");
  refused("x", {"--orbit", "2", "--near", "3", "--far", "2"}, "must be less than");
  refused("x", {"--orbit", "2", "--near", "0"}, "must be above 0");
  refused("x", {"--orbit", "2", "--background", "1,1"}, "--background");
  refused("x", {"--orbit", "2", "--target", "here"}, "--target");
  ExpectRefused(Render("x", {"--cameras", folder_ / "none.json"}), ErrorCode::kNotFound, {"none.json"});
  ExpectRefused({"render", folder_ / "none.ply", "-o", folder_ / "x"}, ErrorCode::kNotFound, {"none.ply"});
  EXPECT_EQ(folder_.Entries(), 1);
}

}  // namespace
}  // namespace anchorsplat
