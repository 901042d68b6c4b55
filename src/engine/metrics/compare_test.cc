#include "metrics/compare.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "images/image_io.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

using Names = std::vector<std::string>;

TEST(MatchViews, IgnoresFolderAndExtension) {
  const auto matched = MatchViews(Names{"/x/c.png", "lr/a", "b.v2"}, Names{"hr/a.JPG", "hr/b.v2.png", "./c.jpeg"});
  ASSERT_TRUE(matched.ok()) << matched.error().message;
  const std::vector<ViewPair>& pairs = matched->pairs;
  ASSERT_EQ(pairs.size(), 3u);
  EXPECT_EQ(pairs[0].name, "c");
  EXPECT_EQ(pairs[0].b, 2u);
  EXPECT_EQ(pairs[1].name, "a");
  EXPECT_EQ(pairs[1].a, 1u);
  EXPECT_EQ(pairs[1].b, 0u);
  EXPECT_EQ(pairs[2].name, "b.v2");
  EXPECT_EQ(pairs[2].b, 1u);
}

TEST(MatchViews, FoldersCountWhereTheLastPartDoesNotTellViewsApart) {
  const auto matched = MatchViews(Names{"cam0/0", "cam1/0", "cam1/1"},
                                  Names{"/x/images/cam1/0.png", "/x/images/cam0/0.png", "/x/images/cam1/1.PNG"});
  ASSERT_TRUE(matched.ok()) << matched.error().message;
  ASSERT_EQ(matched->pairs.size(), 3u);
  EXPECT_EQ(matched->pairs[0].name, "cam0/0");
  EXPECT_EQ(matched->pairs[0].b, 1u);
  EXPECT_EQ(matched->pairs[1].b, 0u);
  EXPECT_EQ(matched->pairs[2].b, 2u);
}

TEST(MatchViews, SomeViewsLieInFoldersAndOthersBesideThem) {
  const Names cameras = {"a/0", "b/0", "2", "3"};
  for (const Names& pictures : {Names{"d/images/2.png", "d/images/3.png", "d/images/a/0.png", "d/images/b/0.png"},
                                Names{"R/2.png", "R/3.png", "R/a/0.png", "R/b/0.png"}}) {
    const auto matched = MatchViews(cameras, pictures);
    ASSERT_TRUE(matched.ok()) << matched.error().message;
    ASSERT_EQ(matched->pairs.size(), 4u);
    for (const auto& [i, j] : {std::pair(0u, 2u), std::pair(1u, 3u), std::pair(2u, 0u), std::pair(3u, 1u)}) {
      EXPECT_EQ(matched->pairs[i].name, cameras[i]);
      EXPECT_EQ(matched->pairs[i].b, j);
    }
    const auto folders = MatchViews(Names{"R/2.png", "R/3.png", "R/a/0.png", "R/b/0.png"}, pictures);
    ASSERT_TRUE(folders.ok());
    EXPECT_EQ(folders->pairs.size(), 4u);
    const auto beside = MatchViews(cameras, Names{pictures[0], pictures[1]});
    ASSERT_TRUE(beside.ok());
    EXPECT_EQ(beside->pairs.size(), 2u);
    EXPECT_EQ(beside->only_a, (Names{"a/0", "b/0"}));
  }
  // Another camera's picture of that number is another one.
  const auto rigs = MatchViews(Names{"cam0/0", "cam1/0", "cam1/5"}, Names{"R/cam0/0.png", "R/cam0/5.png"});
  ASSERT_TRUE(rigs.ok());
  EXPECT_EQ(rigs->pairs.size(), 1u);
  EXPECT_EQ(rigs->only_b, Names{"cam0/5"});
}

TEST(MatchViews, NamesFromMacsAreTheSame) {
  const auto matched = MatchViews(Names{"\u00FC", "b"}, Names{"x/u\u0308.png", "x/b.png"});
  ASSERT_TRUE(matched.ok());
  ASSERT_EQ(matched->pairs.size(), 2u);
  EXPECT_EQ(matched->pairs[0].name, "\u00FC");
}

TEST(MatchViews, ListsWhatHasNoPartner) {
  const auto matched = MatchViews(Names{"a", "b", "c"}, Names{"a", "d"});
  ASSERT_TRUE(matched.ok());
  EXPECT_EQ(matched->pairs.size(), 1u);
  EXPECT_EQ(matched->only_a, (Names{"b", "c"}));
  EXPECT_EQ(matched->only_b, Names{"d"});
  EXPECT_FALSE(MatchViews(Names{}, Names{"a"}).ok());
  EXPECT_FALSE(MatchViews(Names{}, Names{}).ok());
}

TEST(MatchViews, ListsWhatIsThereTwice) {
  const auto matched = MatchViews(Names{"x/a.png", "x/a.jpg", "b"}, Names{"a", "b", "c", "c.png"});
  ASSERT_FALSE(matched.ok());
  EXPECT_EQ(matched.error().code, ErrorCode::kBadArgument);
  EXPECT_NE(matched.error().message.find("more than once: x/a, c"), std::string::npos) << matched.error().message;
  Names many;
  for (int i = 0; i < 100; ++i) many.push_back("view" + std::to_string(i));
  EXPECT_TRUE(FirstFew(many).ends_with("view9 and 90 more")) << FirstFew(many);
}

TEST(ListPictures, SortsAndSkipsTheRest) {
  const TestFolder folder;
  EXPECT_EQ(ListPictures(folder / "none").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(ListPictures(folder.path()).error().code, ErrorCode::kNotFound);
  for (const char* name : {"b.PNG", "a.jpeg", "c.jpg", "notes.txt", "d"}) std::ofstream(folder / name) << "x";
  std::filesystem::create_directory(folder / "e.png");
  const auto pictures = ListPictures(folder.path());
  ASSERT_TRUE(pictures.ok());
  EXPECT_EQ(*pictures, (std::vector<std::filesystem::path>{folder / "a.jpeg", folder / "b.PNG", folder / "c.jpg"}));
  EXPECT_EQ(ListPictures(folder / "d").error().code, ErrorCode::kNotFound);
  // Of a rig, whose pictures lie in a folder for each of its cameras.
  std::filesystem::create_directories(folder / "rig/cam0");
  std::ofstream(folder / "rig/cam0/1.webp") << "x";
  EXPECT_EQ(*ListPictures(folder / "rig"), std::vector<std::filesystem::path>{folder / "rig/cam0/1.webp"});
}

}  // namespace
}  // namespace anchorsplat
