#include "cli/with_lab/dataset.h"

#include <fstream>

#include "cli/run_for_test.h"
#include "cli/small_scan_for_test.h"
#include "dataset/small_dataset_for_test.h"
#include "images/image_io.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

// What `dataset build` makes with its processes is in behaviour/datasets_test.sh; what can be asked of it is here.
class DatasetVerb : public testing::Test {
 protected:
  // A data set of these objects, all of one mesh.
  void Make(const std::vector<std::string>& names) {
    Manifest manifest;
    for (const std::string& name : names) {
      const auto record = BuildObject(SmallJob(mesh_, name), set_);
      ASSERT_TRUE(record.ok()) << record.error().message;
      manifest.emplace(name, *record);
    }
    ASSERT_TRUE(WriteManifest(set_, manifest).ok());
  }

  TestFolder folder_;
  std::string mesh_ = WriteTetrahedron(folder_.path(), "tetra");
  std::string set_ = folder_ / "set";
};

TEST_F(DatasetVerb, Info) {
  Make({"a"});
  const nlohmann::json json = ExpectJson({"dataset", "info", set_});
  EXPECT_EQ(json["objects"], 1);
  EXPECT_EQ(json["failed"], 0);
  EXPECT_EQ(json["unfinished"], 0);
  EXPECT_EQ(json["recipes"]["small"]["objects"], 1);
  EXPECT_THAT(ExpectDone({"dataset", "info", set_}).out,
              AllOf(HasSubstr("set: 1 object, "), HasSubstr("training PSNR"), HasSubstr("licences:")));
}

TEST_F(DatasetVerb, RoomGoesOnWhereItWasStopped) {
  std::ofstream(folder_ / "cube.obj") << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
                                         "f 1 2 3 4\nf 5 8 7 6\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 5 1 4 8\n";
  std::ofstream(folder_ / "room.txt") << "cube.obj 2.5 0 2 30 0.7\n";
  const std::string room = folder_ / "room";
  const auto words = [&](const std::string& views) -> std::vector<std::string> {
    return {"dataset",
            "room",
            folder_ / "room.txt",
            "--objects",
            folder_.path().string(),
            "-o",
            room,
            "--views",
            views,
            "--size",
            "32",
            "--low-size",
            "16",
            "--samples",
            "1",
            "--points",
            "50",
            "--light-every",
            "2"};
  };
  EXPECT_EQ(ExpectJson(words("3"))["views"], 3);
  const auto picture = ReadImage(fs::path(room) / "32/images/001.png");
  ASSERT_TRUE(picture.ok()) << picture.error().message;
  EXPECT_EQ(picture->height, 24);
  EXPECT_EQ(picture->channels, 3);
  EXPECT_TRUE(fs::exists(fs::path(room) / "16/sparse/0/points3D.bin"));
  EXPECT_TRUE(fs::exists(fs::path(room) / "transforms_32.json"));

  fs::remove(fs::path(room) / "32/images/001.png");
  std::ofstream(fs::path(room) / "32/images/002.png") << "kept";
  ExpectDone(words("3"));
  const auto again = ReadImage(fs::path(room) / "32/images/001.png");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->pixels, picture->pixels);
  EXPECT_EQ(fs::file_size(fs::path(room) / "32/images/002.png"), 4u);

  ExpectRefused(words("4"), ErrorCode::kExists, {"other settings", "-w"});
  std::vector<std::string> anew = words("4");
  anew.push_back("-w");
  ExpectDone(anew);
  EXPECT_TRUE(ReadImage(fs::path(room) / "32/images/002.png").ok());
}

TEST_F(DatasetVerb, Check) {
  Make({"a"});
  EXPECT_THAT(ExpectDone({"dataset", "check", set_, "--decode"}).out, HasSubstr("complete and consistent"));
  EXPECT_EQ(ExpectJson({"dataset", "check", set_})["problems"], nlohmann::json::array());
  fs::remove(fs::path(set_) / "a/24/images/000.png");
  EXPECT_THAT(ExpectRefused({"dataset", "check", set_}, ErrorCode::kBadFile, {"set: 1 problem"}).out,
              HasSubstr("picture 000 is missing"));
  // `eval` says so, too.
  ExpectRefused({"eval", set_, "-o", folder_ / "out", "--methods", "raw"}, ErrorCode::kBadFile,
                {"neither the high-resolution picture 000"});
}

TEST_F(DatasetVerb, Split) {
  Make({"a", "b"});
  const std::vector<std::string> words = {"dataset", "split", set_, "--test", "1", "--validation", "0"};
  EXPECT_EQ(ExpectJson(words)["splits"], nlohmann::json({{"test", 2}}));
  ExpectRefused(words, ErrorCode::kExists, {"splits.json"});
  EXPECT_THAT(ExpectDone({"dataset", "info", set_}).out, HasSubstr("test: 2 objects"));
  WriteText(folder_ / "list.txt", "# one mesh\ntetra.obj\n");
  EXPECT_THAT(ExpectDone({"dataset", "split", set_, "--train-list", folder_ / "list.txt", "-w"}).out,
              HasSubstr("2 objects, 2 for train"));
  ExpectRefused({"dataset", "split", set_, "-w", "--test", "0.7", "--validation", "0.7"}, ErrorCode::kBadArgument);
  ExpectRefused({"dataset", "split", set_, "-w", "--test", "2"}, ErrorCode::kBadArgument, {"from 0 to 1"});
  ExpectRefused({"eval", set_, "-o", folder_ / "out", "--split", "test", "--methods", "raw"}, ErrorCode::kNotFound);
}

TEST_F(DatasetVerb, EvaluationOfADataSet) {
  Make({"a"});
  const nlohmann::json json = ExpectJson({"eval", set_, "-o", folder_ / "out", "--protocol", "upstream", "--methods",
                                          "raw,filter,bicubic", "--fit-steps", "10"});
  EXPECT_EQ(json["objects"], nlohmann::json::array({"a"}));
  EXPECT_EQ(json["methods"].size(), 3u);
}

TEST_F(DatasetVerb, RefusesWhatIsNoDataSet) {
  for (const char* verb : {"info", "check", "split"}) {
    ExpectRefused({"dataset", verb, folder_ / "none"}, ErrorCode::kNotFound, {"none"});
  }
  ExpectRefused({"dataset"}, ErrorCode::kBadArgument, {"needs a verb"});
}

// What another scheduler needs: a job for every object that is wanted, which `dataset object` makes.
TEST_F(DatasetVerb, Plan) {
  const std::string other = WriteTetrahedron(folder_.path(), "other");
  const std::vector<std::string> small = {"--views",         "9",  "--size",  "24", "--low-size", "12",
                                          "--points",        "60", "--steps", "60", "--min-psnr", "1",
                                          "--max-gaussians", "300"};
  std::vector<std::string> words = {"dataset", "build", mesh_, other, "-o", set_, "--plan"};
  words.insert(words.end(), small.begin(), small.end());
  const nlohmann::json plan = ExpectJson(words);
  EXPECT_EQ(plan["objects"], 2);
  ASSERT_EQ(plan["wanted"].size(), 2u);
  EXPECT_EQ(plan["wanted"][0]["name"], "other");
  EXPECT_EQ(plan["wanted"][1]["name"], "tetra");
  EXPECT_FALSE(fs::exists(fs::path(set_) / "tetra")) << "a plan makes nothing";
  const auto record = ReadObjectJob(plan["wanted"][1]["job"].get<std::string>());
  ASSERT_TRUE(record.ok()) << record.error().message;
  EXPECT_EQ(record->name, "tetra");
  EXPECT_EQ(record->settings.fit_steps, 60);

  // What is there is not wanted any more.
  ExpectDone({"dataset", "object", plan["wanted"][1]["job"].get<std::string>(), "-o", set_});
  const nlohmann::json rest = ExpectJson(words);
  EXPECT_EQ(rest["there_already"], 1);
  ASSERT_EQ(rest["wanted"].size(), 1u);
  EXPECT_EQ(rest["wanted"][0]["name"], "other");
}

// Before a process is started.
TEST_F(DatasetVerb, BuildsThatMakeNoSense) {
  const auto refused = [&](std::vector<std::string> words, ErrorCode code, const std::string& why) {
    words.insert(words.begin(), {"dataset", "build"});
    words.insert(words.end(), {"-o", set_});
    ExpectRefused(words, code, {why});
  };
  refused({}, ErrorCode::kBadArgument, "");
  refused({mesh_, "--size", "12", "--low-size", "12"}, ErrorCode::kBadArgument, "");
  WriteText(folder_ / "list.txt", "tetra.obj\n");
  refused({"--list", folder_ / "list.txt"}, ErrorCode::kBadArgument, "--objects");
  refused({"--list", folder_ / "none.txt", "--objects", folder_.path()}, ErrorCode::kNotFound, "none.txt");
  WriteText(folder_ / "bad.toml", "steps = 60\n[[mix]]\nlow_size = 12\n[[mix]]\nlow_siize = 10\n");
  refused({mesh_, "--recipe", folder_ / "bad.toml"}, ErrorCode::kBadFile, "line 5: low_siize");
  EXPECT_FALSE(fs::exists(set_));
}

}  // namespace
}  // namespace anchorsplat
