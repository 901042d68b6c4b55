#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "core/messages_for_test.h"
#include "core/parallel.h"
#include "core/rotation.h"
#include "formats/attribute_error.h"
#include "formats/cloud_io.h"
#include "formats/convert.h"
#include "formats/opened_splat.h"
#include "formats/sog/clustered_cloud_for_test.h"
#include "formats/streamed_sog/lod_tree.h"
#include "formats/streamed_sog/streamed_sog_reader.h"
#include "formats/streamed_sog/streamed_sog_writer.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"
#include "io/output_memory.h"

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Many leaves and chunks of few Gaussians.
constexpr CloudWriteOptions kSmall = {.lod = {.levels = 3, .ratio = 0.3, .chunk_count = 2, .chunk_extent = 1}};

GaussianCloud Scene(int64_t n, int degree = 1) {
  GaussianCloud cloud = Clustered(n, degree, 7);
  for (float& s : cloud.log_scales) s = 0.5f * s - 3;
  return cloud;
}

nlohmann::json IndexOf(const fs::path& path) { return nlohmann::json::parse(FileBytes(path)); }

Result<GaussianCloud> ReadLevel(const fs::path& path, int level) { return ReadCloud(path, {.lod_level = level}); }

std::map<std::string, std::string> AllFiles(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files[fs::relative(entry.path(), folder)] = FileBytes(entry.path());
  }
  return files;
}

TEST(StreamedSog, TheFinestLevelIsTheSplat) {
  const TestFolder folder;
  for (const int degree : {0, 3}) {
    GaussianCloud cloud = Scene(9000, degree);
    cloud.render_mode = RenderMode::kAntialiased;
    cloud.comments = {"credit: Street by Ann, CC BY 4.0"};
    const fs::path path = folder / ("d" + std::to_string(degree)) / "lod-meta.json";
    const Status written = WriteCloud(path, cloud, kSmall);
    ASSERT_TRUE(written.ok()) << written.error().message;
    for (const fs::path& name : {path, path.parent_path()}) {  // its folder will do
      const auto read = ReadCloud(name);
      ASSERT_TRUE(read.ok()) << read.error().message;
      EXPECT_EQ(read->sh_degree, degree);
      EXPECT_EQ(read->render_mode, RenderMode::kAntialiased);
      EXPECT_EQ(read->comments, cloud.comments);
      const auto error = CompareAttributes(*read, cloud, StreamedSogRows(cloud, kSmall));
      ASSERT_TRUE(error.ok()) << error.error().message;
      EXPECT_EQ(error->compared, 9000);
      EXPECT_LT(error->means.max, 5e-4);
      EXPECT_LT(error->rotations.max, 0.02);
      EXPECT_LT(error->log_scales.rms, 0.02);
      EXPECT_LT(error->opacities.max, 0.5 / 255 + 1e-6);
      EXPECT_LT(error->colors.rms, 0.01);
    }
    EXPECT_FALSE(fs::exists(path.parent_path() / ".anchorsplat-lod-meta.json.partial"));
    EXPECT_FALSE(fs::exists(path.parent_path() / ".anchorsplat-lod-meta.json.lock"));
  }
}

// The rules of the specification, for every node, leaf and chunk.
TEST(StreamedSog, TheIndexKeepsTheRules) {
  const TestFolder folder;
  const fs::path path = folder / "lod-meta.json";
  ASSERT_TRUE(WriteCloud(path, Scene(9000), kSmall).ok());
  const nlohmann::json index = IndexOf(path);
  EXPECT_EQ(index["version"], 1);
  EXPECT_EQ(index["lodLevels"], 3);
  ASSERT_EQ(index["counts"].size(), 3u);
  EXPECT_EQ(index["counts"][0], 9000);
  EXPECT_EQ(index["count"],
            index["counts"][0].get<int>() + index["counts"][1].get<int>() + index["counts"][2].get<int>());
  const auto files = index["filenames"].get<std::vector<std::string>>();
  EXPECT_EQ(std::set<std::string>(files.begin(), files.end()).size(), files.size());
  std::vector<GaussianCloud> chunks;
  for (const std::string& name : files) {
    const auto chunk = ReadCloud(folder.path() / name);
    ASSERT_TRUE(chunk.ok()) << chunk.error().message;
    EXPECT_LE(chunk->size(), 2048);
    chunks.push_back(*chunk);
  }
  std::vector<std::vector<char>> used;
  for (const GaussianCloud& chunk : chunks) used.emplace_back(static_cast<size_t>(chunk.size()), 0);
  std::vector<int> level_of(files.size(), -1);
  std::vector<int64_t> counts(3, 0);
  int leaves = 0;

  using Box = std::pair<std::vector<double>, std::vector<double>>;
  const std::function<Box(const nlohmann::json&)> walk = [&](const nlohmann::json& node) {
    const Box bound = {node["bound"]["min"].get<std::vector<double>>(),
                       node["bound"]["max"].get<std::vector<double>>()};
    EXPECT_NE(node.contains("children"), node.contains("lods"));
    if (node.contains("children")) {
      EXPECT_EQ(node["children"].size(), 2u);
      const Box left = walk(node["children"][0]), right = walk(node["children"][1]);
      for (size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(bound.first[k], std::min(left.first[k], right.first[k]));
        EXPECT_EQ(bound.second[k], std::max(left.second[k], right.second[k]));
      }
      return bound;
    }
    ++leaves;
    for (const auto& [level, range] : node["lods"].items()) {
      const auto file = range["file"].get<size_t>();
      const int number = std::stoi(level);
      EXPECT_TRUE(level_of[file] == -1 || level_of[file] == number) << "a chunk of two levels";
      level_of[file] = number;
      counts[static_cast<size_t>(number)] += range["count"].get<int64_t>();
      for (auto i = range["offset"].get<size_t>(), end = i + range["count"].get<size_t>(); i < end; ++i) {
        EXPECT_EQ(used[file].at(i), 0);
        used[file].at(i) = 1;
        const float* q = chunks[file].quats.data() + 4 * i;
        const auto axes = RotationFromQuaternion<double>(q[0], q[1], q[2], q[3]);
        for (size_t k = 0; k < 3; ++k) {
          double variance = 0;
          for (size_t a = 0; a < 3; ++a)
            variance += std::pow(axes[3 * k + a] * std::exp(chunks[file].log_scales[3 * i + a]), 2);
          const double slack = 0.02 * std::sqrt(variance) + 1e-3;  // the steps of SOG
          EXPECT_LE(bound.first[k] - slack, chunks[file].means[3 * i + k] - std::sqrt(variance));
          EXPECT_GE(bound.second[k] + slack, chunks[file].means[3 * i + k] + std::sqrt(variance));
        }
      }
    }
    return bound;
  };
  walk(index["tree"]);
  EXPECT_GE(leaves, 4);
  EXPECT_EQ(counts, index["counts"].get<std::vector<int64_t>>());
  for (const auto& chunk : used) EXPECT_EQ(std::ranges::count(chunk, 0), 0) << "Gaussians of no leaf";
  for (int level = 0; level < 3; ++level) {
    const auto read = ReadLevel(path, level);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->size(), counts[static_cast<size_t>(level)]);
    EXPECT_NEAR(static_cast<double>(read->size()), 9000 * std::pow(0.3, level), leaves * 2.0);
  }
}

TEST(StreamedSog, SameBytesForAnyNumberOfThreads) {
  const TestFolder folder;
  const GaussianCloud cloud = Scene(6000);
  for (const int threads : {1, 3}) {
    SetThreadCount(threads);
    ASSERT_TRUE(WriteCloud(folder / std::to_string(threads) / "lod-meta.json", cloud, kSmall).ok());
  }
  SetThreadCount(0);
  EXPECT_EQ(AllFiles(folder / "1"), AllFiles(folder / "3"));
}

TEST(StreamedSog, OneGaussianAndNone) {
  const TestFolder folder;
  const fs::path path = folder / "a" / "lod-meta.json";
  ASSERT_TRUE(WriteCloud(path, Scene(1)).ok());
  EXPECT_EQ(IndexOf(path)["counts"], (nlohmann::json{1, 1, 1, 1}));
  EXPECT_EQ(ReadLevel(path, 3)->size(), 1);

  const fs::path none = folder / "b" / "lod-meta.json";
  EXPECT_FALSE(WriteCloud(none, GaussianCloud{}).ok());
  GaussianCloud broken = Scene(5);
  for (size_t i = 0; i < 5; ++i) broken.means[3 * i] = std::numeric_limits<float>::quiet_NaN();
  const Status written = WriteCloud(none, broken);
  ASSERT_FALSE(written.ok());
  EXPECT_THAT(written.error().message, HasSubstr("all of the 5 Gaussians"));
  EXPECT_FALSE(fs::exists(folder / "b")) << "a folder for nothing";
}

TEST(StreamedSog, WhatNobodyDrawsIsLeftOutAndSaid) {
  const TestFolder folder;
  GaussianCloud cloud = Scene(500);
  cloud.means[3] = std::numeric_limits<float>::quiet_NaN();
  cloud.means[3 * 7 + 1] = std::numeric_limits<float>::infinity();
  cloud.means[3 * 9] = 1e6f;  // far out, and drawn
  Messages messages;
  ASSERT_TRUE(WriteCloud(folder / "lod-meta.json", cloud, kSmall).ok());
  ASSERT_EQ(messages.warnings().size(), 1u);
  EXPECT_THAT(messages.warnings()[0], HasSubstr("2 of 500 Gaussians have NaN"));
  EXPECT_EQ(ReadCloud(folder / "lod-meta.json")->size(), 498);
}

TEST(StreamedSog, AnOlderSceneIsReplacedWholeAndOnlyWhenAsked) {
  const TestFolder folder;
  const fs::path path = folder / "lod-meta.json";
  ASSERT_TRUE(WriteCloud(path, Scene(6000), kSmall).ok());
  std::ofstream(folder / "notes.txt") << "mine";
  const auto before = AllFiles(folder.path());
  const Status refused = WriteCloud(path, Scene(100), kSmall);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kExists);
  EXPECT_EQ(AllFiles(folder.path()), before);

  CloudWriteOptions again = kSmall;
  again.overwrite = true;
  fs::create_directory(folder / ".anchorsplat-lod-meta.json.partial");  // a run that was killed
  std::ofstream(folder / ".anchorsplat-lod-meta.json.partial/half") << "half";
  ASSERT_TRUE(WriteCloud(path, Scene(100), again).ok());
  EXPECT_EQ(ReadCloud(path)->size(), 100);
  const auto after = AllFiles(folder.path());
  EXPECT_EQ(after.size(), 2u + 3 * 8u) << "one chunk of eight files a level, and nothing of the older scene";
  EXPECT_TRUE(after.contains("notes.txt"));
  EXPECT_EQ(IndexOf(path)["filenames"][0], "0_0-2/meta.json") << "the older chunks kept their names to the end";
}

TEST(StreamedSog, OptionsAndNamesThatMakeNoSense) {
  const TestFolder folder;
  const auto refused = [&](const char* name, LodOptions lod) {
    const Status status = WriteStreamedSog(folder / name, Scene(5), {.lod = lod});
    EXPECT_FALSE(status.ok());
    return status.ok() ? "" : status.error().message;
  };
  EXPECT_THAT(refused("scene.json", {}), HasSubstr("must be named lod-meta.json"));
  EXPECT_THAT(refused("lod-meta.json", {.levels = 0}), HasSubstr("1 to 16 levels"));
  EXPECT_THAT(refused("lod-meta.json", {.ratio = 1}), HasSubstr("a ratio between"));
  EXPECT_THAT(refused("lod-meta.json", {.chunk_count = 0}), HasSubstr("chunks of 1"));
  EXPECT_THAT(refused("lod-meta.json", {.chunk_extent = -1}), HasSubstr("positive extent"));
  EXPECT_EQ(folder.Entries(), 0);
}

TEST(StreamedSog, IntoMemory) {
  OutputMemory memory;
  CloudWriteOptions options = kSmall;
  options.memory = &memory;
  ASSERT_TRUE(WriteCloud("scene/lod-meta.json", Scene(100), options).ok());
  EXPECT_TRUE(memory.files.contains("scene/lod-meta.json"));
  EXPECT_TRUE(memory.files.contains("scene/2_0/means_u.webp"));
  EXPECT_EQ(memory.files.size(), 1u + 3 * 8u);
}

TEST(StreamedSog, TheTreeBoundsItsLeaves) {
  GaussianCloud cloud = Scene(20'000, 0);
  for (size_t i = 0; i < 3 * 10; ++i) cloud.means[i] *= 1e4f;  // strays
  const LodOptions options = {.chunk_count = 8, .chunk_extent = 2};
  const LodTree tree = BuildLodTree(cloud, options);
  int64_t next = 0;
  for (const int64_t leaf : LeavesOf(tree)) {
    const LodTree::Node& node = tree.nodes[static_cast<size_t>(leaf)];
    EXPECT_EQ(node.begin, next);
    EXPECT_LE(node.end - node.begin, 8 * 1024);
    EXPECT_GT(node.end - node.begin, 1024) << "a stray has no leaf of its own";
    next = node.end;
  }
  EXPECT_EQ(next, cloud.size());
  EXPECT_EQ(std::set<uint32_t>(tree.rows.begin(), tree.rows.end()).size(), tree.rows.size());
}

// A scene by hand: level 1 is missing in the first leaf, level 0 in the second; an environment.
class ScenesByHand : public testing::Test {
 protected:
  void SetUp() override {
    for (const auto& [name, n] : {std::pair("fine", 30), std::pair("coarse", 10), std::pair("sky", 4)}) {
      fs::create_directory(folder_ / name);
      ASSERT_TRUE(WriteCloud(folder_ / name / "meta.json", Scene(n, 0)).ok());
    }
  }
  // What reading says, or "" and the number of Gaussians.
  std::pair<std::string, int64_t> Read(const nlohmann::json& index, int level = 0) {
    std::ofstream(folder_ / "lod-meta.json") << index.dump();
    const auto read = ReadLevel(folder_ / "lod-meta.json", level);
    if (!read.ok()) return {read.error().message, -1};
    return {"", read->size()};
  }

  TestFolder folder_;
  nlohmann::json index_ = nlohmann::json::parse(R"({
    "lodLevels": 2, "environment": null, "filenames": ["fine/meta.json", "coarse/meta.json"],
    "tree": {"bound": {"min": [0, 0, 0], "max": [1, 1, 1]}, "children": [
      {"bound": {"min": [0, 0, 0], "max": [1, 1, 1]}, "lods": {"0": {"file": 0, "offset": 10, "count": 20}}},
      {"bound": {"min": [0, 0, 0], "max": [1, 1, 1]}, "lods": {"1": {"file": 1, "offset": 0, "count": 7}}}]}})");
};

TEST_F(ScenesByHand, TheNearestLevelStandsForAMissingOne) {
  EXPECT_EQ(Read(index_).second, 27);
  EXPECT_EQ(Read(index_, 1).second, 27);
  index_["environment"] = "sky/meta.json";
  index_["version"] = 1;
  EXPECT_EQ(Read(index_).second, 31);
  const auto opened = OpenedSplat::Open(folder_.path());
  ASSERT_TRUE(opened.ok());
  EXPECT_EQ(opened->format()->name, "streamed SOG");
  uint64_t bytes = 0;
  for (const auto& [name, content] : AllFiles(folder_.path())) bytes += content.size();
  EXPECT_EQ(opened->bytes(), bytes);
}

TEST_F(ScenesByHand, WhatIsWrongIsSaid) {
  const auto says = [&](const std::function<void(nlohmann::json&)>& change, const char* what, int level = 0) {
    nlohmann::json index = index_;
    change(index);
    const auto [message, count] = Read(index, level);
    EXPECT_THAT(message, HasSubstr(what));
    EXPECT_THAT(message, HasSubstr("lod-meta.json"));
  };
  says([](auto& j) { j["version"] = 2; }, "only streamed SOG 1 is supported");
  says([](auto& j) { j["lodLevels"] = 0; }, "lodLevels");
  says([](auto&) {}, "has no level 2", 2);
  says([](auto& j) { j.erase("tree"); }, "tree");
  says([](auto& j) { j["filenames"][0] = "../x/meta.json"; }, "expected the name of a file in folders below");
  says([](auto& j) { j["filenames"][0] = "/etc/passwd"; }, "expected the name of a file in folders below");
  says([](auto& j) { j["filenames"][0] = "https://x.org/meta.json"; }, "expected the name of a file in folders below");
  says([](auto& j) { j["environment"] = ".."; }, "expected the name of a file in folders below");
  says([](auto& j) { j["filenames"] = nlohmann::json::array(); }, "filenames");
  says([](auto& j) { j["tree"]["children"][0]["lods"]["0"]["file"] = 2; }, "file");
  says([](auto& j) { j["tree"]["children"][0]["lods"]["0"]["offset"] = -1; }, "offset");
  says([](auto& j) { j["tree"]["children"][0]["lods"]["0"]["count"] = 21; }, "Gaussians 10 to 31");
  says([](auto& j) { j["tree"]["children"][0]["lods"]["0"].erase("count"); }, "count");
  says([](auto& j) { j["tree"]["children"].push_back(j["tree"]["children"][0]); }, "two leaves share Gaussian 10");
  says([](auto& j) { j["tree"]["children"] = nlohmann::json::array(); }, "has no Gaussians");
  says([](auto& j) { j["tree"]["children"][0]["lods"]["0"]["count"] = 1 << 27; }, "times");
  // A chunk that is not there is named itself.
  nlohmann::json index = index_;
  index["filenames"][0] = "gone/meta.json";
  EXPECT_THAT(Read(index).first, HasSubstr("gone/meta.json"));
  const InputFile bytes = InputFile::FromBytes("lod-meta.json", index_.dump());
  EXPECT_THAT(ReadStreamedSog(bytes).error().message, HasSubstr("cannot be read from memory"));
}

TEST(StreamedSog, ConvertMeasuresTheFinestLevel) {
  const TestFolder folder;
  GaussianCloud cloud = Scene(3000);
  cloud.means[0] = std::numeric_limits<float>::quiet_NaN();
  ASSERT_TRUE(WriteCloud(folder / "in.ply", cloud).ok());
  Messages quiet;
  ConvertOptions options;
  options.measure = true;
  const auto report = ConvertFile(folder / "in.ply", folder / "scene/lod-meta.json", options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  ASSERT_TRUE(report->error.has_value());
  EXPECT_EQ(report->error->compared, 2999);
  EXPECT_LT(report->error->means.max, 1e-3);
  options = {};
  options.lod_level = 3;
  const auto coarse = ConvertFile(folder / "scene", folder / "coarse.ply", options);
  ASSERT_TRUE(coarse.ok()) << coarse.error().message;
  EXPECT_EQ(coarse->gaussians_written, 47);  // 2,999, 750, 188, 47
  const auto pointless = ConvertFile(folder / "in.ply", folder / "x.ply", options);
  ASSERT_FALSE(pointless.ok());
  EXPECT_THAT(pointless.error().message, HasSubstr("--lod-level has no effect"));
}

}  // namespace
}  // namespace anchorsplat
