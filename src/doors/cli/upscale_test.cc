#include <filesystem>

#include "cli/run_for_test.h"
#include "cli/small_scan_for_test.h"
#include "images/image_io.h"
#include "images/rendering.h"
#include "io/folder_for_test.h"
#include "upscale/small_upscaler_for_test.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

// Each pixel of a picture as so many.
Image Repeated(const Image& image, int times) {
  Image out(image.width * times, image.height * times, image.channels);
  for (int c = 0; c < out.channels; ++c) {
    for (int y = 0; y < out.height; ++y) {
      for (int x = 0; x < out.width; ++x) out.at(c, y, x) = image.at(c, y / times, x / times);
    }
  }
  return out;
}

class UpscaleVerb : public testing::Test {
 protected:
  UpscaleVerb() {
    EXPECT_TRUE(RepeatingForTest().Write(network_).ok());
    for (const char* name : {"a.png", "b.png", "deep/c.png"}) {
      fs::create_directories((folder_ / "in" / name).parent_path());
      EXPECT_TRUE(WritePng(folder_ / "in" / name, Picture(name[0])).ok());
    }
  }
  static Image Picture(int seed, int channels = 3) {
    Random random(static_cast<uint64_t>(seed));
    Image out(6, 4, channels);
    for (float& value : out.pixels) value = static_cast<float>(random.Below(256)) / 255.0f;
    return out;
  }
  // `upscale WORDS --network …`
  std::vector<std::string> Upscale(std::vector<std::string> words) {
    words.insert(words.begin(), "upscale");
    words.insert(words.end(), {"--network", network_});
    return words;
  }

  TestFolder folder_;
  std::string network_ = folder_ / "network.safetensors";
};

TEST_F(UpscaleVerb, OnePictureAndAFolder) {
  const std::string one = folder_ / "one.png", in = folder_ / "in", a = folder_ / "in/a.png";
  EXPECT_THAT(ExpectDone(Upscale({a, "-o", one})).out,
              testing::AllOf(HasSubstr("enlarged 1 picture 2 times"), HasSubstr("invents")));
  EXPECT_EQ(ReadImage(one)->pixels, Repeated(*ReadImage(a), 2).pixels);
  EXPECT_THAT(FileBytes(one), HasSubstr("Enlarged 2 times by a network (srmd-1), which invented the detail."));
  EXPECT_FALSE(IsOwnRendering(one));

  const nlohmann::json rows = ExpectJson(Upscale({in, "-o", folder_ / "out", "--factor", "4"}));
  ASSERT_EQ(rows.size(), 2u);  // pictures of a folder, and none below it where it has some
  EXPECT_EQ(rows[0]["width"], 24);
  EXPECT_EQ(rows[0]["factor"], 4);
  EXPECT_EQ(rows[0]["detail"], "invented");
  EXPECT_EQ(rows[0]["network"]["architecture"], "srmd-1");
  EXPECT_EQ(rows[0]["network"]["licence"], "Apache-2.0");
  EXPECT_EQ(ReadImage(folder_ / "out/b.png")->pixels, Repeated(*ReadImage(folder_ / "in/b.png"), 4).pixels);

  // Folders of folders keep them.
  ExpectDone(Upscale({folder_ / "in/deep", "-o", folder_ / "deep"}));
  EXPECT_TRUE(fs::exists(folder_ / "deep/c.png"));
}

TEST_F(UpscaleVerb, NothingIsOverwritten) {
  const std::string out = folder_ / "out", in = folder_ / "in";
  ExpectDone(Upscale({in, "-o", out}));
  const std::string before = FileBytes(folder_ / "out/b.png");
  fs::remove(folder_ / "out/a.png");
  ExpectRefused(Upscale({in, "-o", out}), ErrorCode::kExists, {"b.png exists"});
  EXPECT_FALSE(fs::exists(folder_ / "out/a.png"));  // seen before the work
  ExpectDone(Upscale({in, "-o", out, "-w"}));
  EXPECT_EQ(FileBytes(folder_ / "out/b.png"), before);
  const std::string a = FileBytes(folder_ / "in/a.png");
  ExpectRefused(Upscale({folder_ / "in/a.png", "-o", in, "-w"}), ErrorCode::kBadArgument, {"a.png"});
  EXPECT_EQ(FileBytes(folder_ / "in/a.png"), a);
}

TEST_F(UpscaleVerb, OneBadPictureKeepsNoneFromBeingDone) {
  WriteText(folder_ / "in/aa.png", "no picture");
  const ProgramRun run = RunWords(Upscale({folder_ / "in", "-o", folder_ / "out", "--json"}));
  EXPECT_EQ(run.code, 1);
  EXPECT_THAT(run.err, HasSubstr("aa.png"));
  ASSERT_EQ(run.json().size(), 3u);
  EXPECT_EQ(run.json()[1]["failure"]["code"], "bad_file");
  EXPECT_TRUE(fs::exists(folder_ / "out/b.png"));
  ExpectRefused(Upscale({folder_ / "in/aa.png", "-o", folder_ / "x"}), ErrorCode::kBadFile, {"aa.png"});
}

TEST_F(UpscaleVerb, AlphaStays) {
  const std::string clear = folder_ / "clear.png", out = folder_ / "out.png";
  Image picture = Picture(1, 4);
  ASSERT_TRUE(WritePng(clear, picture).ok());
  for (const char* background : {"0,0,0", "1,0.5,0"}) {
    ExpectDone(Upscale({clear, "-o", out, "-w", "--background", background}));
    const Image enlarged = *ReadImage(out), expected = Repeated(picture, 2);
    ASSERT_EQ(enlarged.channels, 4);
    for (int64_t i = 0; i < enlarged.plane(); ++i) {
      ASSERT_EQ(enlarged.channel(3)[i], expected.channel(3)[i]);
      if (expected.channel(3)[i] > 0.1f) {
        ASSERT_NEAR(enlarged.channel(0)[i], expected.channel(0)[i], 2 / 255.0);
      }
    }
  }
  ExpectDone(Upscale({clear, "-o", out, "-w", "--alpha", "bicubic"}));
  EXPECT_NE(ReadImage(out)->at(3, 1, 1), Repeated(picture, 2).at(3, 1, 1));
}

TEST_F(UpscaleVerb, RefusesWhatMakesNoSense) {
  const std::string in = folder_ / "in", a = folder_ / "in/a.png", x = folder_ / "x";
  const auto refused = [&](const std::vector<std::string>& words, const std::string& why) {
    ExpectRefused(Upscale(words), ErrorCode::kBadArgument, {why});
  };
  refused({in, "-o", folder_ / "x.png"}, "is one picture, but there are 2");
  refused({a, "-o", folder_ / "x.jpg"}, "written as .png");
  refused({a, "-o", x, "--factor", "3"}, "--factor: a network that enlarges 2 times");
  refused({a, "-o", x, "--background", "red"}, "--background");
  refused({a, a, "-o", x}, "would both become");
  refused({a, "-o", "-", "--json"}, "--json");
  ExpectRefused(Upscale({folder_ / "none.png", "-o", x}), ErrorCode::kNotFound, {"none.png"});
  ExpectRefused({"upscale", a, "-o", x}, ErrorCode::kBadArgument, {"--network"});
  ExpectRefused({"upscale", a, "-o", x, "--network", folder_ / "none"}, ErrorCode::kNotFound, {"none"});
  ExpectRefused({"upscale", a, "-o", x, "--network", a}, ErrorCode::kBadFile, {"a.png"});
  EXPECT_FALSE(fs::exists(x));
}

TEST_F(UpscaleVerb, RendersAreEnlarged) {
  const std::string scan = WriteScan(folder_ / "scan.ply"), small = folder_ / "small.png",
                    large = folder_ / "large.png";
  for (const bool transparent : {false, true}) {
    std::vector<std::string> words = {"render", scan, "--orbit", "1", "--size", "32x24", "-w", "-o"};
    if (transparent) words.insert(words.begin() + 2, "--transparent");
    std::vector<std::string> enlarged = words;
    words.push_back(small);
    enlarged.insert(enlarged.end(), {large, "--enlarge-with", network_});
    ExpectDone(words);
    const nlohmann::json json = ExpectJson(enlarged);
    EXPECT_EQ(json["enlarged"]["network"]["scale"], 2);
    EXPECT_EQ(json["enlarged"]["detail"], "invented");
    const Image expected = Repeated(*ReadImage(small), 2), got = *ReadImage(large);
    ASSERT_EQ(got.pixels.size(), expected.pixels.size());
    const int64_t plane = got.plane();
    for (int64_t i = 0; i < std::ssize(got.pixels); ++i) {
      const float alpha = transparent ? expected.channel(3)[i % plane] : 1;
      if (alpha > 0.1f) {
        ASSERT_NEAR(got.channel(0)[i], expected.channel(0)[i], 2 / 255.0) << i;
      }
    }
    EXPECT_TRUE(IsOwnRendering(large));
    EXPECT_THAT(FileBytes(large), HasSubstr("invented the detail"));
    EXPECT_THAT(FileBytes(small), Not(HasSubstr("invented the detail")));
  }
  ExpectRefused({"render", scan, "-o", large, "-w", "--orbit", "1", "--enlarge-with", scan}, ErrorCode::kBadFile,
                {"scan.ply"});
}

}  // namespace
}  // namespace anchorsplat
