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

class ViewsVerb : public testing::Test {
 protected:
  std::vector<std::string> Views(const std::string& out, const std::vector<std::string>& words) {
    std::vector<std::string> all = {"views", mesh_, "-o", folder_ / out};
    all.insert(all.end(), words.begin(), words.end());
    return all;
  }

  TestFolder folder_;
  std::string mesh_ = WriteTetrahedron(folder_.path(), "tetra");
};

TEST_F(ViewsVerb, WritesTheLayoutOfTheBenchmark) {
  const std::vector<std::string> words =
      Views("out", {"--views", "9", "--size", "32", "--low-size", "16", "--points", "100"});
  const nlohmann::json json = ExpectJson(words);
  EXPECT_EQ(json["triangles"], 4);
  EXPECT_EQ(json["views"], 9);
  EXPECT_EQ(json["sizes"], nlohmann::json({16, 32}));
  for (const char* file : {"16/images/008.png", "16/sparse/0/points3D.bin", "16/images.txt", "32/images/008.png",
                           "32/cameras.txt", "transforms_32.json"}) {
    EXPECT_TRUE(fs::exists(folder_ / "out" / file)) << file;
  }
  EXPECT_EQ(ReadImage(folder_ / "out/32/images/002.png")->width, 32);
  ExpectRefused(words, ErrorCode::kExists);
  // Other verbs read its cameras, and `fit` its points.
  const std::string scan = WriteScan(folder_ / "scan.ply");
  EXPECT_EQ(ExpectJson({"render", scan, "-o", folder_ / "seen", "--cameras", folder_ / "out/32"})["views"].size(), 9u);
  EXPECT_EQ(ExpectJson({"fit", folder_ / "out", "-o", folder_ / "fit.ply", "--steps", "5"})["initial_points"],
            "points");
}

TEST_F(ViewsVerb, SaysWhatItDid) {
  EXPECT_THAT(ExpectDone(Views("out", {"--views", "2", "--size", "16", "--low-size", "8", "--rig", "rings"})).out,
              AllOf(HasSubstr("2 views of 4 triangles at 8 and 16 pixels"), HasSubstr("processor time: rays")));
}

TEST_F(ViewsVerb, RefusesWhatMakesNoSense) {
  ExpectRefused(Views("out", {"--size", "32", "--low-size", "32"}), ErrorCode::kBadArgument);
  ExpectRefused(Views("out", {"--rig", "spiral"}), ErrorCode::kBadArgument, {"--rig"});
  ExpectRefused(Views("out", {"--radius", "0"}), ErrorCode::kBadArgument, {"--radius"});
  ExpectRefused({"views", folder_ / "none.obj", "-o", folder_ / "out"}, ErrorCode::kNotFound, {"none.obj"});
  WriteText(folder_ / "point.obj", "v 0 0 0\n");
  ExpectRefused({"views", folder_ / "point.obj", "-o", folder_ / "out"}, ErrorCode::kBadFile, {"point.obj"});
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

}  // namespace
}  // namespace anchorsplat
