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
using ::testing::Not;

class CompareVerb : public testing::Test {
 protected:
  void SetUp() override {
    ExpectDone(
        {"enhance", scan_, "-o", other_, "--method", "filter", "--pixel-size", "0.02", "--mode", "classic", "-q"});
    ExpectDone({"render", scan_, "-o", views_, "--orbit", "2", "--size", "48x48", "-q"});
  }

  TestFolder folder_;
  std::string scan_ = WriteScan(folder_ / "scan.ply");
  std::string other_ = folder_ / "other.ply";
  std::string views_ = folder_ / "views";  // of the scan
};

TEST_F(CompareVerb, TwoSplats) {
  const nlohmann::json json = ExpectJson({"compare", scan_, other_, "--orbit", "2", "--size", "48x48"});
  ASSERT_EQ(json["views"].size(), 2u);
  EXPECT_EQ(json["views"][1]["name"], "001");
  EXPECT_GT(json["mean"]["psnr"], 10);
  EXPECT_LT(json["mean"]["ssim"], 1);
  const ProgramRun same = ExpectDone({"compare", scan_, scan_, "--orbit", "2", "--size", "48x48"});
  EXPECT_THAT(same.out, AllOf(HasSubstr("PSNR"), HasSubstr("inf  1.0000")));
  EXPECT_THAT(same.err, HasSubstr("how alike A and B are"));
  EXPECT_THAT(same.out, HasSubstr("001"));
  EXPECT_THAT(ExpectDone({"compare", views_, views_, "--summary"}).out,
              AllOf(HasSubstr("mean"), Not(HasSubstr("001"))));
  EXPECT_THAT(ExpectDone({"compare", views_, views_}).err, IsEmpty()) << "B may be ground truth";
  EXPECT_EQ(ExpectJson({"compare", scan_, scan_, "--orbit", "1", "--size", "48x48"})["mean"]["psnr"], nullptr);
}

TEST_F(CompareVerb, SplatsAndPictures) {
  // Rendered again they differ only by what eight bits do not hold.
  EXPECT_GT(ExpectJson({"compare", scan_, views_, "--orbit", "2", "--size", "48x48"})["mean"]["psnr"], 50);
  EXPECT_EQ(ExpectJson({"compare", views_, views_})["mean"]["psnr"], nullptr);
  const std::string one = folder_ / "views/000.png", two = folder_ / "views/001.png", sides = folder_ / "sides.png";
  ExpectDone({"compare", one, two, "--side-by-side", sides});
  EXPECT_GT(ReadImage(sides)->width, 2 * 48);
  ExpectRefused({"compare", one, two, "--side-by-side", sides}, ErrorCode::kExists, {"sides.png"});
  ExpectRefused({"compare", one, two, "--side-by-side", folder_ / "sides.jpg"}, ErrorCode::kBadArgument,
                {"written as .png"});
}

TEST_F(CompareVerb, BothAgainstTheTruth) {
  const std::vector<std::string> words = {"compare", scan_, other_,   "--truth", views_,
                                          "--orbit", "2",   "--size", "48x48"};
  EXPECT_THAT(ExpectDone(words).out, AllOf(HasSubstr("both against"), HasSubstr("gain dB")));
  const nlohmann::json json = ExpectJson(words);
  EXPECT_GT(json["a"]["mean"]["psnr"], json["b"]["mean"]["psnr"]);
}

TEST_F(CompareVerb, RefusesWhatCannotBeCompared) {
  ExpectRefused({"compare", scan_, other_}, ErrorCode::kBadArgument, {"--orbit"});
  ExpectRefused({"compare", "", scan_, "--orbit", "1"}, ErrorCode::kBadArgument, {"must not be empty"});
  ExpectRefused({"compare", scan_, views_, "--orbit", "2", "--size", "32x32"}, ErrorCode::kBadArgument, {"48x48"});
  // Both sides differ from the truth in size: a view is named once.
  EXPECT_THAT(ExpectRefused({"compare", scan_, other_, "--truth", views_, "--orbit", "2", "--size", "32x32"},
                            ErrorCode::kBadArgument)
                  .err,
              HasSubstr("different sizes: 000 (32x32 and 48x48), 001 (32x32 and 48x48);"));
  fs::create_directory(folder_ / "others");
  fs::copy_file(folder_ / "views/000.png", folder_ / "others/x.png");
  fs::copy_file(folder_ / "views/000.png", folder_ / "others/y.png");
  ExpectRefused({"compare", views_, folder_ / "others"}, ErrorCode::kBadArgument, {"no view is on both sides", "x, y"});
  fs::create_directory(folder_ / "empty");
  ExpectRefused({"compare", scan_, folder_ / "empty", "--orbit", "1"}, ErrorCode::kNotFound,
                {"no PNG, JPEG, WebP or TIFF"});
  ExpectRefused({"compare", scan_, folder_ / "none.ply", "--orbit", "1"}, ErrorCode::kNotFound, {"none.ply"});
}

// Photographs that were exposed otherwise: the plain values say so, the corrected ones do not.
TEST_F(CompareVerb, ColorCorrection) {
  fs::create_directory(folder_ / "photos");
  for (const char* name : {"000.png", "001.png"}) {
    Image picture = ReadImage(fs::path(views_) / name).value();
    const float gain = name[2] == '0' ? 0.8f : 0.9f;
    for (float& x : picture.pixels) x = gain * x + 0.02f;
    ASSERT_TRUE(WritePng(folder_ / "photos" / name, picture).ok());
  }
  const std::string photos = folder_ / "photos";
  const std::vector<std::string> views = {"--orbit", "2", "--size", "48x48", "--color-correct"};
  const auto with = [&](std::vector<std::string> words) {
    words.insert(words.end(), views.begin(), views.end());
    return words;
  };
  const nlohmann::json one = ExpectJson(with({"compare", scan_, photos}));
  EXPECT_LT(one["mean"]["psnr"], 40);
  EXPECT_GT(one["mean"]["cc_psnr"], 45);
  EXPECT_GT(one["mean"]["cc_ssim"], one["mean"]["ssim"]);
  EXPECT_FALSE(one["mean"].contains("cc_lpips"));
  EXPECT_EQ(one["views"][1]["name"], "001");
  EXPECT_GT(one["views"][1]["cc_psnr"], one["views"][1]["psnr"]);
  const std::vector<std::string> both = with({"compare", other_, scan_, "--truth", photos});
  const nlohmann::json two = ExpectJson(both);
  EXPECT_LT(two["a"]["mean"]["cc_psnr"], two["b"]["mean"]["cc_psnr"]);
  EXPECT_THAT(ExpectDone(both).out,
              AllOf(HasSubstr("A cc PSNR"), HasSubstr("B cc SSIM"), HasSubstr("cc gain dB"), HasSubstr("mean")));
  EXPECT_TRUE(ExpectJson({"compare", views_, photos, "--color-correct"})["mean"].contains("cc_psnr"));
  EXPECT_FALSE(ExpectJson({"compare", views_, photos})["mean"].contains("cc_psnr"));
}

TEST_F(CompareVerb, GoesOnWithoutThePicturesThatAreMissing) {
  const ProgramRun run = ExpectDone({"compare", scan_, views_, "--orbit", "3", "--size", "48x48"});
  EXPECT_THAT(run.err, HasSubstr("1 view has no counterpart and is skipped: not in the reference 002"));
  EXPECT_EQ(ExpectJson({"compare", scan_, views_, "--orbit", "3", "--size", "48x48"})["views"].size(), 2u);
  const ProgramRun other = ExpectDone({"compare", views_, scan_, "--orbit", "3", "--size", "48x48"});
  EXPECT_THAT(other.err, HasSubstr("only in the reference 002"));
}

// Without its weights LPIPS is an error, unless it was asked for only if they are there.
TEST_F(CompareVerb, LpipsWithoutItsWeights) {
  const std::string one = folder_ / "views/000.png", two = folder_ / "views/001.png";
  std::vector<std::string> words = {"compare", one, two, "--lpips", "alex", "--lpips-weights", folder_ / "weights"};
  fs::create_directory(folder_ / "weights");
  EXPECT_THAT(ExpectRefused(words, ErrorCode::kNotFound, {"LPIPS missing", "--lpips if-there"}).out, IsEmpty());
  words[4] = "if-there";
  EXPECT_THAT(ExpectDone(words).err, HasSubstr("LPIPS missing"));
  const nlohmann::json json = ExpectJson(words);
  EXPECT_TRUE(json["mean"].contains("ssim"));
  EXPECT_FALSE(json["mean"].contains("lpips"));
  WriteText(folder_ / "weights/alex.safetensors", "no tensors");
  ExpectRefused(words, ErrorCode::kBadFile, {"alex.safetensors"});
  ExpectRefused({"compare", one, two, "--lpips", "resnet"}, ErrorCode::kBadArgument, {"--lpips"});
  ExpectRefused({"compare", one, two, "--lpips-weights", folder_ / "weights"}, ErrorCode::kBadArgument, {"--lpips"});
}

}  // namespace
}  // namespace anchorsplat
