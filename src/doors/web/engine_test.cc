#include "web/engine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/source_dir_for_test.h"
#include "formats/cloud_bytes.h"
#include "formats/cloud_io.h"

namespace anchorsplat::web {
namespace {

using Json = nlohmann::json;

std::string ExampleBytes() {
  std::ifstream in(SourceDirForTest() / "examples/biplane/input.ply", std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class EngineTest : public testing::Test {
 protected:
  Json Ask(const Json& request, const std::string& data = {}) {
    reply_ = engine_.Call(request.dump(), std::as_bytes(std::span(data)));
    return Json::parse(reply_.json);
  }
  int64_t OpenExample() {
    return Ask({{"verb", "open"}, {"name", "input.ply"}}, ExampleBytes()).at("cloud").get<int64_t>();
  }
  std::string Block(size_t k) const {
    return {reinterpret_cast<const char*>(reply_.blocks.at(k).data()), reply_.blocks.at(k).size()};
  }

  int64_t last_done_ = 0;
  Engine engine_{[this](std::string_view, int64_t done, int64_t, std::string_view) { last_done_ = done; }};
  Reply reply_;
};

TEST_F(EngineTest, WhatItReadsIsWhatTheReaderReads) {
  const auto cloud = ReadCloud(SourceDirForTest() / "examples/biplane/input.ply");
  ASSERT_TRUE(cloud.ok());
  const Json opened = Ask({{"verb", "open"}, {"name", "input.ply"}}, ExampleBytes());
  EXPECT_EQ(opened.at("gaussians"), cloud->size());
  EXPECT_EQ(opened.at("sh_degree"), cloud->sh_degree);
  EXPECT_EQ(opened.at("format"), "PLY");
  Ask({{"verb", "columns"}, {"cloud", opened.at("cloud")}});
  ASSERT_EQ(reply_.blocks.size(), 5u);
  ASSERT_EQ(reply_.blocks[0].size(), cloud->means.size() * sizeof(float));
  EXPECT_EQ(std::memcmp(reply_.blocks[0].data(), cloud->means.data(), reply_.blocks[0].size()), 0);
}

TEST_F(EngineTest, ColumnsCanBePutBack) {
  const int64_t cloud = OpenExample();
  const Json described = Ask({{"verb", "columns"}, {"cloud", cloud}});
  std::string all;
  for (size_t k = 0; k < 5; ++k) all += Block(k);
  Json request = described;
  request["verb"] = "put";
  const Json again = Ask(request, all);
  ASSERT_FALSE(again.contains("error")) << again;
  const auto written = [&](const Json& number) {
    Ask({{"verb", "write"}, {"cloud", number}, {"format", "ply"}});
    return Block(0);
  };
  EXPECT_EQ(written(cloud), written(again.at("cloud")));
  request["gaussians"] = described.at("gaussians").get<int64_t>() + 1;
  EXPECT_EQ(Ask(request, all).at("error").at("code"), "bad_argument");
  request["gaussians"] = 1e300;
  EXPECT_EQ(Ask(request, all).at("error").at("code"), "bad_argument");
}

TEST_F(EngineTest, EnhancesWithTheWordsOfTheCommandLine) {
  const int64_t cloud = OpenExample();
  const Json filtered = Ask({{"verb", "enhance"},
                             {"cloud", cloud},
                             {"words", {"--method=filter", "--upscale=2", "--pixel-size=0.01", "--mode=classic"}}});
  ASSERT_FALSE(filtered.contains("error")) << filtered;
  EXPECT_EQ(filtered.at("report").at("upscale"), 2);
  EXPECT_EQ(filtered.at("report").at("pixel_size").at("value"), 0.01);
  EXPECT_NE(filtered.at("cloud"), cloud);
  const Json refused = Ask({{"verb", "enhance"}, {"cloud", cloud}, {"words", {"--upscale=much"}}});
  EXPECT_EQ(refused.at("error").at("code"), "bad_argument");
  EXPECT_NE(refused.at("error").at("message").get<std::string>().find("upscale"), std::string::npos);
}

TEST_F(EngineTest, EnhancesARegionWithinABudget) {
  const int64_t cloud = OpenExample();
  const int64_t count = Ask({{"verb", "columns"}, {"cloud", cloud}}).at("gaussians").get<int64_t>();
  const auto means = [&](const Json& number) {
    Ask({{"verb", "columns"}, {"cloud", number}});
    std::vector<float> values(Block(0).size() / sizeof(float));
    std::memcpy(values.data(), Block(0).data(), Block(0).size());
    return values;
  };
  const std::vector<float> before = means(cloud);
  std::vector<float> outside;
  for (size_t i = 0; i < before.size(); i += 3) {
    if (std::hypot(before[i], before[i + 1], before[i + 2]) > 0.3f) {
      outside.insert(outside.end(), before.begin() + static_cast<ptrdiff_t>(i),
                     before.begin() + static_cast<ptrdiff_t>(i + 3));
    }
  }
  const auto kept = static_cast<int64_t>(outside.size() / 3);
  ASSERT_GT(kept, 0);
  ASSERT_LT(kept, count);
  const Json made =
      Ask({{"verb", "enhance"},
           {"cloud", cloud},
           {"words", {"--region=0,0,0,0.3", "--mode=classic", "--max-gaussians=" + std::to_string(count + 5)}}});
  ASSERT_FALSE(made.contains("error")) << made;
  EXPECT_EQ(made.at("report").at("region").at("kept_outside"), kept);
  EXPECT_LE(made.at("gaussians"), count + 5);
  const std::vector<float> after = means(made.at("cloud"));
  ASSERT_GE(after.size(), outside.size());
  EXPECT_EQ(std::vector<float>(after.end() - static_cast<ptrdiff_t>(outside.size()), after.end()), outside);
  const Json refused = Ask({{"verb", "enhance"}, {"cloud", cloud}, {"words", {"--region=0,0,0,-1"}}});
  EXPECT_NE(refused.at("error").at("message").get<std::string>().find("--region"), std::string::npos);
}

TEST_F(EngineTest, EditsAreThoseOfTheCommandLineInTheirOrder) {
  const int64_t cloud = OpenExample();
  const auto written = [&](const Json& number) {
    Ask({{"verb", "write"}, {"cloud", number}, {"format", "ply"}});
    return Block(0);
  };
  const std::string as_it_was = written(cloud);
  const Json words = {"--action-axes=RDF", "--filter-box=-0.2,-,-,-,-,-", "--up=z", "--filter-floaters"};
  const Json edited = Ask({{"verb", "edit"}, {"cloud", cloud}, {"words", words}});
  ASSERT_FALSE(edited.contains("error")) << edited;
  ASSERT_EQ(edited.at("actions").size(), 3u);
  EXPECT_EQ(edited.at("actions")[0].at("action"), "--filter-box -0.2,-,-,-,-,-");
  EXPECT_GT(edited.at("actions")[0].at("taken"), 0);
  EXPECT_EQ(edited.at("gaussians"), edited.at("actions")[2].at("left"));
  EXPECT_EQ(edited.at("world").at("rotation"), Json({1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0}));
  // The same again: what was edited before has not changed.
  const Json again = Ask({{"verb", "edit"}, {"cloud", cloud}, {"words", words}});
  EXPECT_EQ(written(edited.at("cloud")), written(again.at("cloud")));
  EXPECT_EQ(written(cloud), as_it_was);
  const Json counted = Ask({{"verb", "edit"},
                            {"cloud", cloud},
                            {"words", {"--action-axes=RDF", "--filter-box=-0.2,-,-,-,-,-", "--dry-run"}}});
  EXPECT_EQ(counted.at("actions")[0], edited.at("actions")[0]);
  EXPECT_FALSE(counted.contains("cloud"));
  const Json refused = Ask({{"verb", "edit"}, {"cloud", cloud}, {"words", {"--filter-box=9,9,9,10,10,10"}}});
  EXPECT_EQ(refused.at("error").at("code"), "bad_argument");
}

// The page previews the filter by this number.
TEST_F(EngineTest, TheGainIsWhatTheFilterAdds) {
  const int64_t cloud = OpenExample();
  const double gain = Ask({{"verb", "filter"}, {"cloud", cloud}, {"upscale", 3}}).at("gain").get<double>();
  ASSERT_GT(gain, 0);
  constexpr double kPixel = 0.02;
  const auto first_scale = [&](const Json& number) {
    Ask({{"verb", "columns"}, {"cloud", number}});
    float value = 0;
    std::memcpy(&value, reply_.blocks.at(1).data(), sizeof value);
    return std::exp(double{value});
  };
  const double before = first_scale(cloud);
  const Json made = Ask({{"verb", "enhance"},
                         {"cloud", cloud},
                         {"words", {"--method=filter", "--upscale=3", "--pixel-size=0.02", "--mode=classic"}}});
  const double after = first_scale(made.at("cloud"));
  EXPECT_NEAR(after * after, before * before + gain * kPixel * kPixel, 1e-6 * after * after);
}

TEST_F(EngineTest, CamerasAreReadFromTheirFiles) {
  std::ifstream in(SourceDirForTest() / "examples/biplane/transforms_lr.json", std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const Json file = {{"name", "transforms.json"}, {"bytes", bytes.size()}};
  const Json cameras = Ask({{"verb", "cameras"}, {"files", {file}}}, bytes);
  ASSERT_FALSE(cameras.contains("error")) << cameras;
  EXPECT_GT(cameras.at("views").get<int>(), 1);
  const Json made = Ask({{"verb", "enhance"},
                         {"cloud", OpenExample()},
                         {"words", {"--method=filter", "--camera-rule=median", "--mode=classic"}},
                         {"cameras", cameras.at("cameras")}});
  ASSERT_FALSE(made.contains("error")) << made;
  EXPECT_EQ(made.at("report").at("pixel_size").at("source"), "cameras");
  // Names with folders, more bytes than there are, and what is no camera file.
  EXPECT_TRUE(Ask({{"verb", "cameras"}, {"files", {{{"name", "../x.json"}, {"bytes", 1}}}}}, "x").contains("error"));
  EXPECT_TRUE(Ask({{"verb", "cameras"}, {"files", {{{"name", "x.json"}, {"bytes", 2}}}}}, "x").contains("error"));
  const Json wrong = Ask({{"verb", "cameras"}, {"files", {{{"name", "x.json"}, {"bytes", 1}}}}}, "x");
  EXPECT_TRUE(wrong.at("error").at("message").get<std::string>().starts_with("x.json")) << wrong;
}

TEST_F(EngineTest, RendersAndWritesPages) {
  const int64_t cloud = OpenExample();
  const Json picture = Ask({{"verb", "render"}, {"cloud", cloud}, {"words", {"--size=40x30"}}, {"transparent", true}});
  ASSERT_FALSE(picture.contains("error")) << picture;
  EXPECT_EQ(picture.at("channels"), 4);
  EXPECT_EQ(reply_.blocks.at(0).size(), 40u * 30u * 4u * sizeof(float));
  EXPECT_EQ(last_done_, 1);
  const Json page = Ask({{"verb", "page"}, {"after", cloud}, {"before", cloud}, {"name", "biplane"}});
  ASSERT_FALSE(page.contains("error")) << page;
  EXPECT_TRUE(Block(0).starts_with("<!DOCTYPE html>"));
}

TEST_F(EngineTest, InfoIsThatOfTheCommandLineAndChangesNothing) {
  const int64_t cloud = OpenExample();
  const Json info = Ask({{"verb", "info"}, {"cloud", cloud}});
  EXPECT_EQ(info.at("file"), "input.ply");
  EXPECT_EQ(info.at("format"), "PLY");
  EXPECT_EQ(info.at("bytes"), ExampleBytes().size());
  EXPECT_FALSE(info.at("looks_in_words").get<std::string>().empty());
  EXPECT_EQ(Ask({{"verb", "columns"}, {"cloud", cloud}}).at("gaussians"), info.at("gaussians"));
}

TEST_F(EngineTest, WhateverIsAskedIsAnswered) {
  const int64_t cloud = OpenExample();
  for (const char* request : {"",
                              "[]",
                              "{",
                              "{}",
                              R"({"verb": 1})",
                              R"({"verb": "none"})",
                              R"({"verb": "info"})",
                              R"({"verb": "info", "cloud": "x"})",
                              R"({"verb": "info", "cloud": 99})",
                              R"({"verb": "info", "cloud": -1})",
                              R"({"verb": "write", "cloud": 1, "format": "x"})",
                              R"({"verb": "write", "cloud": 1, "format": "ply", "words": 3})",
                              R"({"verb": "enhance", "cloud": 1, "words": [3]})",
                              R"({"verb": "edit"})",
                              R"({"verb": "edit", "cloud": 1, "words": ["--filter-box=1"]})",
                              R"({"verb": "render", "cloud": 1, "words": ["--size=100000x100000", "--orbit=100"]})",
                              R"({"verb": "open"})",
                              R"({"verb": "put"})",
                              R"({"verb": "cameras"})",
                              R"({"verb": "filter", "cloud": 1, "upscale": 0})"}) {
    const Json answer = Json::parse(engine_.Call(request, {}).json);
    if (std::string(request) == R"({"verb": "put"})") continue;  // an empty splat is one
    EXPECT_TRUE(answer.contains("error")) << request << ": " << answer;
  }
  EXPECT_FALSE(Ask({{"verb", "release"}, {"cloud", cloud}}).contains("error"));
  EXPECT_TRUE(Ask({{"verb", "info"}, {"cloud", cloud}}).contains("error"));
}

}  // namespace
}  // namespace anchorsplat::web
