// --device and --max-gpu-memory, and what reports say of them. What is drawn on a GPU is tested in render/; what
// happens without a library in behaviour/commandline_test.sh.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "cli/run_for_test.h"
#include "cli/small_scan_for_test.h"
#include "cli/verb_tree.h"
#include "images/image_io.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

const nlohmann::json kCpu = {{"name", "cpu"}};

class Device : public testing::Test {
 protected:
  std::vector<std::string> Render(const std::vector<std::string>& more) {
    std::vector<std::string> words = {"render", scan_,   "-o", folder_ / "picture.png", "--orbit", "1",
                                      "--size", "32x32", "-w"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  TestFolder folder_;
  std::string scan_ = WriteScan(folder_ / "scan.ply");
};

TEST_F(Device, IsAnOptionOfTheVerbsThatRasterize) {
  CLI::App app;
  Program program;
  AddVerbs(app, program);
  std::set<std::string> verbs;
  for (const DeclaredVerb& verb : DeclaredVerbs(app)) {
    for (const DeclaredOption& option : verb.options) {
      if (std::ranges::find(option.names, "--device") != option.names.end()) verbs.insert(verb.name());
    }
  }
  EXPECT_EQ(verbs, (std::set<std::string>{"compare", "enhance", "eval", "fit", "render", "view"}));
}

TEST_F(Device, IsAWordOrANumber) {
  for (const std::string word : {"tpu", "GPU", "1.5", "-1", "0x1", "12345678901"}) {
    ExpectRefused(Render({"--device", word}), ErrorCode::kBadArgument, {"is not cpu, gpu, auto or the number of an"});
  }
  ExpectRefused(Render({"--device", "1000"}), ErrorCode::kNotFound);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "picture.png"));
  ExpectDone(Render({"--device", "cpu"}));
  ExpectDone(Render({"--device", "auto"}));
}

TEST_F(Device, ItsMemoryIsASize) {
  for (const std::string word : {"much", "-1", "63M"}) {
    ExpectRefused(Render({"--max-gpu-memory", word}), ErrorCode::kBadArgument, {word});
  }
  ExpectDone(Render({"--max-gpu-memory", "500M"}));
}

TEST_F(Device, IsInEveryReport) {
  EXPECT_EQ(ExpectJson(Render({}))["device"], kCpu);
  EXPECT_EQ(ExpectJson({"compare", scan_, scan_, "--orbit", "1", "--size", "32x32"})["device"], kCpu);
  EXPECT_EQ(ExpectJson({"compare", scan_, scan_, "--truth", scan_, "--orbit", "1", "--size", "32x32"})["device"], kCpu);
  EXPECT_EQ(ExpectJson({"view", scan_, "-o", folder_ / "page.html", "--device", "1000"})["device"], kCpu)
      << "a page needs no GPU";
  EXPECT_EQ(ExpectJson({"enhance", scan_, "-o", folder_ / "out.ply", "--method", "filter"})[0]["device"], kCpu);
  EXPECT_EQ(ExpectJson({"fit", WriteProject(folder_ / "project"), "-o", folder_ / "fit.ply", "--steps", "2",
                        "--init-points", "50"})["device"],
            kCpu);
}

TEST_F(Device, AutoNeverTakesSoftware) {
  const nlohmann::json device = ExpectJson(Render({"--device", "auto"}))["device"];
  EXPECT_NE(device.value("type", ""), "cpu") << device;
}

TEST_F(Device, ReportsNameTheAdapter) {
  const nlohmann::json adapters = ExpectJson({"doctor"})["gpu"]["adapters"];
  ASSERT_FALSE(adapters.empty()) << "there is no adapter: install mesa-vulkan-drivers and scripts/fetch-webgpu.sh";
  const nlohmann::json device = ExpectJson(Render({"--device", "gpu"}))["device"];
  EXPECT_FALSE(device["name"].get<std::string>().empty());
  EXPECT_TRUE(std::ranges::any_of(adapters, [&](const nlohmann::json& adapter) {
    return adapter["name"] == device["name"] && adapter["backend"] == device["backend"] &&
           adapter["type"] == device["type"] && adapter["usable"] == true;
  })) << device;
  EXPECT_GE(device["seconds"], 0);
  EXPECT_GE(device["share"], 0);
  EXPECT_LE(device["share"], 1);
  EXPECT_FALSE(device.contains("gave_up")) << device;
}

// By how many levels of 8 bits pictures differ at most, and in how many values.
struct Difference {
  double most = 0;
  size_t values = 0;
};

Difference DifferenceOf(const std::filesystem::path& a, const std::filesystem::path& b) {
  const auto x = ReadImage(a), y = ReadImage(b);
  EXPECT_TRUE(x.ok() && y.ok() && x->pixels.size() == y->pixels.size());
  Difference difference;
  for (size_t i = 0; i < x->pixels.size(); ++i) {
    const double levels = std::abs(255.0 * x->pixels[i] - 255.0 * y->pixels[i]);
    difference.most = std::max(difference.most, levels);
    difference.values += levels > 0.5 ? 1 : 0;
  }
  return difference;
}

TEST_F(Device, DrawsWhatTheCpuDraws) {
  std::vector<std::string> words = {"render", scan_, "-o", folder_ / "cpu.png", "--orbit", "1", "--size", "96x64"};
  ExpectDone(words);
  words[3] = folder_ / "gpu.png";
  words.insert(words.end(), {"--device", "gpu"});
  const nlohmann::json device = ExpectJson(words)["device"];
  EXPECT_GT(device["seconds"], 0) << "it was not drawn there: " << device;
  const Difference difference = DifferenceOf(folder_ / "cpu.png", folder_ / "gpu.png");
  EXPECT_LE(difference.most, 1.5);
  EXPECT_LE(difference.values, 96u * 64 * 3 / 100);
}

}  // namespace
}  // namespace anchorsplat
