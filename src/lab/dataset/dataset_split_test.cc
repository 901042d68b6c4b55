#include "dataset/dataset_split.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

void Add(Manifest& manifest, const std::string& name, const std::string& stem, const std::string& shape) {
  ObjectRecord record;
  record.name = name;
  record.source = "lib/" + name + ".obj";
  record.stem = stem;
  record.fingerprint = shape;
  manifest.emplace(name, record);
}

Manifest ManyModels() {
  Manifest manifest;
  for (int i = 0; i < 300; ++i) {
    const std::string n = std::to_string(i);
    for (const std::string variant : {"", "_red", "_blue"})
      Add(manifest, "m" + n + variant, "m" + n, "t" + n + variant);
  }
  return manifest;
}

TEST(DatasetSplit, VariantsStayTogether) {
  Manifest manifest;
  Add(manifest, "a", "a", "t1");
  Add(manifest, "a_red", "a", "t2");
  Add(manifest, "copy", "copy", "t2");  // by shape
  Add(manifest, "z", "z", "t9");
  EXPECT_EQ(VariantGroups(manifest, true), (std::vector<std::vector<std::string>>{{"a", "a_red", "copy"}, {"z"}}));
  EXPECT_EQ(VariantGroups(manifest, false), (std::vector<std::vector<std::string>>{{"a"}, {"a_red", "copy"}, {"z"}}));
  EXPECT_TRUE(VariantGroups({}, true).empty());
}

TEST(DatasetSplit, FractionsAreMetAndNoModelIsParted) {
  const Manifest manifest = ManyModels();
  const auto splits = SplitByModel(manifest, {.validation = 0.2, .test = 0.3}, 1);
  ASSERT_TRUE(splits.ok());
  ASSERT_EQ(splits->size(), manifest.size());
  std::map<std::string, int> counts;
  for (const auto& [name, split] : *splits) ++counts[split];
  EXPECT_NEAR(counts["validation"] / 900.0, 0.2, 0.06);
  EXPECT_NEAR(counts["test"] / 900.0, 0.3, 0.07);
  for (int i = 0; i < 300; ++i) {
    const std::string name = "m" + std::to_string(i);
    EXPECT_EQ(splits->at(name), splits->at(name + "_red"));
    EXPECT_EQ(splits->at(name), splits->at(name + "_blue"));
  }
  EXPECT_NE(*splits, *SplitByModel(manifest, {.validation = 0.2, .test = 0.3}, 2));
}

TEST(DatasetSplit, AddedObjectsMoveNoOthers) {
  Manifest manifest = ManyModels();
  const auto before = SplitByModel(manifest, {}, 1);
  for (int i = 0; i < 50; ++i)
    Add(manifest, "new" + std::to_string(i), "new" + std::to_string(i), "n" + std::to_string(i));
  const auto after = SplitByModel(manifest, {}, 1);
  for (const auto& [name, split] : *before) EXPECT_EQ(after->at(name), split);
}

TEST(DatasetSplit, VariantsThatSortBeforeTheOthersMoveNothing) {
  for (int i = 0; i < 100; ++i) {
    const std::string n = std::to_string(i);
    Manifest manifest;
    Add(manifest, "chair" + n + "_red", "chair" + n, "t1");
    const auto before = SplitByModel(manifest, {.validation = 0.3, .test = 0.3}, 1);
    Add(manifest, "chair" + n + "_blue", "chair" + n, "t2");
    Add(manifest, "stool" + n, "stool" + n, "t2");  // a copy of the blue one by shape
    const auto after = SplitByModel(manifest, {.validation = 0.3, .test = 0.3}, 1);
    EXPECT_EQ(after->at("chair" + n + "_red"), before->at("chair" + n + "_red"));
    EXPECT_EQ(after->at("stool" + n), before->at("chair" + n + "_red"));
  }
}

TEST(DatasetSplit, ImpossibleFractionsAreRefused) {
  EXPECT_FALSE(SplitByModel({}, {.validation = 0.6, .test = 0.6}, 0).ok());
  EXPECT_FALSE(SplitByModel({}, {.validation = -0.1, .test = 0}, 0).ok());
}

TEST(DatasetSplit, ListsDecideByTheEndOfAddresses) {
  Manifest manifest;
  Add(manifest, "a", "a", "t1");
  Add(manifest, "b", "b", "t2");
  Add(manifest, "c", "c", "t3");
  Add(manifest, "bb", "bb", "t4");
  const auto splits = SplitByLists(manifest, {{"train", {"lib/a.obj"}}, {"test", {"b.obj"}}});
  ASSERT_TRUE(splits.ok()) << splits.error().message;
  EXPECT_EQ(*splits, (Splits{{"a", "train"}, {"b", "test"}}));
  EXPECT_FALSE(SplitByLists(manifest, {{"train", {"a.obj"}}, {"test", {"lib/a.obj"}}}).ok());
  manifest.at("b").fingerprint = "t1";
  const auto parted = SplitByLists(manifest, {{"train", {"lib/a.obj"}}, {"test", {"b.obj"}}});
  ASSERT_FALSE(parted.ok());
  EXPECT_NE(parted.error().message.find("variants of one model"), std::string::npos);
}

TEST(DatasetSplit, FileComesBack) {
  const TestFolder folder;
  const Splits splits = {{"a", "train"}, {"b", "validation"}, {"c", "test"}, {"d", "test"}};
  ASSERT_TRUE(WriteSplits(folder.path(), splits).ok());
  EXPECT_EQ(*ReadSplits(folder.path()), splits);
  EXPECT_FALSE(WriteSplits(folder.path(), {{"a", "practice"}}).ok());
  std::ofstream(folder / kSplitsName) << R"({"train":["a"],"validation":["a"],"test":[]})";
  EXPECT_FALSE(ReadSplits(folder.path()).ok());
}

TEST(DatasetSplit, AddressesAreFoundBelowTheFolder) {
  const TestFolder folder;
  std::filesystem::create_directories(folder / "usr/share");
  std::filesystem::create_directories(folder / "usr/other");
  std::ofstream(folder / "usr/share/lib.sh3f") << "x";
  std::ofstream(folder / "usr/share/plane.ac") << "x";
  std::ofstream(folder / "list.txt") << "# planes\nusr/share/plane.ac\r\n\nlib.sh3f#chair \n";
  const auto list = ReadAddressList(folder / "list.txt");
  ASSERT_TRUE(list.ok());
  EXPECT_EQ(*list, (std::vector<std::string>{"usr/share/plane.ac", "lib.sh3f#chair"}));
  const auto found = ResolveAddresses(*list, folder.path());
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_EQ((*found)[0], (folder / "usr/share/plane.ac").string());
  EXPECT_EQ((*found)[1], (folder / "usr/share/lib.sh3f").string() + "#chair");
  EXPECT_EQ(ResolveAddresses({"none.sh3f#a"}, folder.path()).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(ResolveAddresses({"plane.ac"}, folder.path()).error().code, ErrorCode::kNotFound);
  std::ofstream(folder / "usr/other/lib.sh3f") << "x";
  EXPECT_EQ(ResolveAddresses({"lib.sh3f#a"}, folder.path()).error().code, ErrorCode::kBadArgument);
}

}  // namespace
}  // namespace anchorsplat
