#include "dataset/object_record.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

ObjectRecord Example(const std::string& name) {
  ObjectRecord r;
  r.name = name;
  r.source = "models/\xff.obj";  // names of files are bytes
  r.recipe = "15k";
  r.origin = {"Chair", "Living room", "somebody", "CC0-1.0", "LICENSE.TXT"};
  r.stem = "chair";
  r.fingerprint = "t12";
  r.views = 146;
  r.low_size = 256;
  r.high_size = 1024;
  r.background = {1, 0.1f, 0};
  r.triangles = 12;
  r.gaussians = 20000;
  r.train_psnr = 33.5;
  r.rejected = true;
  r.reason = "too low";
  r.fit_seconds = 60.5;
  return r;
}

TEST(ObjectRecord, ManifestComesBack) {
  const TestFolder folder;
  Manifest manifest;
  for (const char* name : {"b", "a"}) manifest.emplace(name, Example(name));
  ASSERT_TRUE(WriteManifest(folder.path(), manifest).ok());
  const auto back = ReadManifest(folder.path());
  ASSERT_TRUE(back.ok()) << back.error().message;
  ASSERT_EQ(back->size(), 2u);
  const ObjectRecord& a = back->at("a");
  EXPECT_EQ(a.origin.creator, "somebody");
  EXPECT_EQ(a.origin.licence_source, "LICENSE.TXT");
  EXPECT_EQ(a.gaussians, 20000);
  EXPECT_EQ(a.high_size, 1024);
  EXPECT_EQ(a.background, (std::array<float, 3>{1, 0.1f, 0}));
  EXPECT_EQ(a.train_psnr, 33.5);
  EXPECT_TRUE(a.rejected);
  EXPECT_EQ(a.fit_seconds, 60.5);
}

TEST(ObjectRecord, MistakesNameTheirLine) {
  const TestFolder folder;
  const auto message = [&](const std::string& text) {
    std::ofstream(folder / kManifestName) << text;
    const auto manifest = ReadManifest(folder.path());
    return manifest.ok() ? std::string() : manifest.error().message;
  };
  EXPECT_NE(message("{}\n").find("line 1"), std::string::npos);
  nlohmann::json escape = ToJson(Example("../../etc"));
  escape["source"] = "x";
  EXPECT_NE(message(escape.dump() + "\n").find("not a folder name"), std::string::npos);
  nlohmann::json good = ToJson(Example("a"));
  good["source"] = "x";
  EXPECT_EQ(message(good.dump() + "\n\n"), "");
  EXPECT_NE(message(good.dump() + "\n" + good.dump() + "\n").find("twice"), std::string::npos);
  EXPECT_NE(message(good.dump().substr(0, 50)).find("line 1"), std::string::npos);
}

TEST(ObjectRecord, CollectsWhatIsFinished) {
  const TestFolder folder;
  for (const char* name : {"a", "b", ".building"}) std::filesystem::create_directories(folder / name);
  nlohmann::json record = ToJson(Example("a"));
  record["source"] = "x";
  std::ofstream(folder / "a/record.json") << record.dump();
  std::ofstream(folder / ".building/record.json") << "garbage";
  const auto records = CollectRecords(folder.path());
  ASSERT_TRUE(records.ok()) << records.error().message;
  EXPECT_EQ(records->size(), 1u);
  std::ofstream(folder / "b/record.json") << record.dump();  // about a
  EXPECT_FALSE(CollectRecords(folder.path()).ok());
}

TEST(ObjectRecord, FailuresComeBack) {
  const TestFolder folder;
  EXPECT_TRUE(ReadFailures(folder.path())->empty());
  ASSERT_TRUE(WriteFailures(folder.path(), {{"chair", "chair.obj", "mesh", "no \"triangles\""}}).ok());
  const auto back = ReadFailures(folder.path());
  ASSERT_TRUE(back.ok());
  ASSERT_EQ(back->size(), 1u);
  EXPECT_EQ((*back)[0].message, "no \"triangles\"");
}

}  // namespace
}  // namespace anchorsplat
