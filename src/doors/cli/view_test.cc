#include <fstream>
#include <iterator>

#include "cli/run_for_test.h"
#include "cli/small_scan_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class ViewVerb : public testing::Test {
 protected:
  TestFolder folder_;
  std::string scan_ = WriteScan(folder_ / "scan.ply");
  std::string page_ = folder_ / "page.html";
};

TEST_F(ViewVerb, BeforeAndAfterWithTruePictures) {
  const std::string project = WriteProject(folder_ / "project");
  ExpectDone(
      {"enhance", scan_, "-o", folder_ / "out.ply", "--method", "filter", "--pixel-size", "0.02", "--mode", "classic"});
  const std::vector<std::string> words = {
      "view",  folder_ / "out.ply", "--before", scan_, "--truth", project + "/views", "--cameras",
      project, "--views",           "3",        "-o",  page_,     "--pixel-size",     "0.02"};
  const nlohmann::json json = ExpectJson(words);
  EXPECT_EQ(json["output"], page_);
  EXPECT_EQ(json["views"], 3);
  EXPECT_EQ(json["bytes"], fs::file_size(page_));
  EXPECT_NEAR(json["pixel_size"].get<double>(), 0.02, 1e-6);
  EXPECT_THAT(FileBytes(page_), AllOf(HasSubstr(R"("title":"out.ply")"), HasSubstr(R"(id="picture-2")")));
  ExpectRefused(words, ErrorCode::kExists, {"page.html"});
}

TEST_F(ViewVerb, OneSplat) {
  const ProgramRun run = ExpectDone({"view", scan_, "-o", page_, "--sh-degree", "0", "--title", "a</script>b"});
  EXPECT_THAT(run.out, HasSubstr("open it in any browser"));
  EXPECT_THAT(run.err, IsEmpty());
  EXPECT_THAT(FileBytes(page_), AllOf(HasSubstr(R"("degree":0)"), HasSubstr(R"(a\u003c/script\u003eb)")));
  fs::create_directory(folder_ / "scan");
  ExpectDone({"convert", scan_, folder_ / "scan/meta.json"});
  ExpectDone({"view", folder_ / "scan/", "-o", page_, "-w"});
  EXPECT_THAT(FileBytes(page_), HasSubstr(R"("title":"scan")"));
}

TEST_F(ViewVerb, HasAButtonForReadersWithASplat) {
  ExpectDone({"view", scan_, "-o", page_, "--open-your-own", "https://splats.example/"});
  EXPECT_THAT(FileBytes(page_), HasSubstr(R"("ownPage":"https://splats.example/")"));
}

TEST_F(ViewVerb, ShowsEditsBesideTheSplatAsItIs) {
  const std::string as_it_was = FileBytes(scan_);
  const nlohmann::json json =
      ExpectJson({"view", scan_, "--filter-box", "0,-,-,-,-,-", "--up", "z", "-o", page_, "--sh-degree", "0"});
  ASSERT_EQ(json["actions"].size(), 2u);
  const auto taken = json["actions"][0]["taken"].get<int64_t>(), left = json["actions"][0]["left"].get<int64_t>();
  EXPECT_GT(taken, 0);
  EXPECT_GT(left, 0);
  const std::string page = FileBytes(page_);
  EXPECT_THAT(page, AllOf(HasSubstr(R"("name":"scan.ply")"), HasSubstr(R"("name":"scan.ply, edited")"),
                          HasSubstr("\"fileCount\":" + std::to_string(left)),
                          HasSubstr("\"fileCount\":" + std::to_string(left + taken))));
  EXPECT_THAT(page, HasSubstr(R"("up":[0.0,-1.0,0.0])"));
  EXPECT_EQ(FileBytes(scan_), as_it_was);
  const ProgramRun run = ExpectDone({"view", scan_, "--filter-box", "0,-,-,-,-,-", "-o", page_, "-w"});
  EXPECT_THAT(run.out, HasSubstr("--filter-box 0,-,-,-,-,-: "));
  // Beside another splat, where one is named.
  ExpectDone({"convert", scan_, folder_ / "other.ply"});
  ExpectDone({"view", scan_, "--before", folder_ / "other.ply", "--filter-harmonics", "0", "-o", page_, "-w"});
  EXPECT_THAT(FileBytes(page_), AllOf(HasSubstr(R"("name":"other.ply")"), Not(HasSubstr(R"("name":"scan.ply")"))));
}

TEST_F(ViewVerb, AFolderBesideThePage) {
  const ProgramRun run = ExpectDone({"view", scan_, "--before", scan_, "--folder", "-o", page_});
  EXPECT_THAT(run.out, HasSubstr("keep them together"));
  EXPECT_TRUE(fs::is_regular_file(folder_ / "page.data/after-0.js"));
  EXPECT_TRUE(fs::is_regular_file(folder_ / "page.data/before-0.js"));
  EXPECT_THAT(FileBytes(page_), HasSubstr(R"("file":"page.data/after-0.js")"));
  ExpectRefused({"view", scan_, "--folder", "-o", page_}, ErrorCode::kExists, {"page.html"});
}

TEST_F(ViewVerb, ManyGaussiansInOneFileAreAWarning) {
  const std::string large = folder_ / "large.splat";
  const std::string small = folder_ / "small.splat";
  ExpectDone({"convert", scan_, small, "-q"});
  const std::string rows = FileBytes(small);
  {
    std::ofstream file(large, std::ios::binary);
    for (int k = 0; k < 5001; ++k) file << rows;
  }
  EXPECT_THAT(ExpectDone({"view", large, "-o", page_, "-w"}).err,
              AllOf(HasSubstr("1,000,200 Gaussians in one file of"), HasSubstr("--folder")));
  EXPECT_THAT(ExpectDone({"view", large, "--folder", "-o", page_, "-w"}).err, Not(HasSubstr("in one file")));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "page.data"), fs::directory_iterator()), 4);
}

TEST_F(ViewVerb, RefusesWhatMakesNoSense) {
  const auto refused = [&](std::vector<std::string> words, ErrorCode code, const std::string& why) {
    words.insert(words.begin(), {"view", scan_, "-o", page_});
    ExpectRefused(words, code, {why});
  };
  const std::string cameras = Biplane() / "transforms_hr.json";
  refused({"--truth", folder_.path()}, ErrorCode::kBadArgument, "--cameras");
  refused({"--truth", folder_.path(), "--cameras", cameras}, ErrorCode::kNotFound, "no picture is named as a camera");
  refused({"--truth", folder_ / "nowhere", "--cameras", cameras}, ErrorCode::kNotFound, "no such folder");
  refused({"--sh-degree", "4"}, ErrorCode::kBadArgument, "--sh-degree");
  refused({"--open-your-own", "javascript:alert(1)"}, ErrorCode::kBadArgument, "is no address");
  refused({"--views", "0"}, ErrorCode::kBadArgument, "1 or more");
  refused({"--pixel-size", "0"}, ErrorCode::kBadArgument, "--pixel-size");
  refused({"--background", "white"}, ErrorCode::kBadArgument, "--background");
  refused({"--filter-box", "1"}, ErrorCode::kBadArgument, "--filter-box: expected a box");
  refused({"--filter-box", "1000,-,-,-,-,-"}, ErrorCode::kBadArgument, "the edits leave nothing to show");
  refused({"--up", "z", "--cameras", cameras}, ErrorCode::kBadArgument, "moves the splat away from its cameras");
  refused({"--dry-run"}, ErrorCode::kBadArgument, "--dry-run");
  refused({"--before", folder_ / "none.ply"}, ErrorCode::kNotFound, "none.ply");
  const std::string before = FileBytes(scan_);
  ExpectRefused({"view", scan_, "-o", folder_ / "other.spz", "-w"}, ErrorCode::kBadArgument, {".html"});
  const std::string nan = WriteNanScan(folder_ / "nan.ply");
  ExpectRefused({"view", nan, "-o", page_}, ErrorCode::kBadFile, {"nan.ply: nothing to show"});
  EXPECT_EQ(FileBytes(scan_), before);
  EXPECT_FALSE(fs::exists(page_));
}

}  // namespace
}  // namespace anchorsplat
