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
  const auto pairs = MatchViews(Names{"/x/c.png", "lr/a", "b.v2"}, Names{"hr/a.JPG", "hr/b.v2.png", "./c.jpeg"});
  ASSERT_TRUE(pairs.ok()) << pairs.error().message;
  ASSERT_EQ(pairs->size(), 3u);
  EXPECT_EQ((*pairs)[0].name, "c");
  EXPECT_EQ((*pairs)[0].b, 2u);
  EXPECT_EQ((*pairs)[1].name, "a");
  EXPECT_EQ((*pairs)[1].a, 1u);
  EXPECT_EQ((*pairs)[1].b, 0u);
  EXPECT_EQ((*pairs)[2].name, "b.v2");
  EXPECT_EQ((*pairs)[2].b, 1u);
}

TEST(MatchViews, ListsWhatHasNoPartner) {
  const auto pairs = MatchViews(Names{"a", "b", "c"}, Names{"a", "d"});
  ASSERT_FALSE(pairs.ok());
  EXPECT_EQ(pairs.error().code, ErrorCode::kBadArgument);
  EXPECT_EQ(pairs.error().message, "views without a partner: only in the first set b, c; only in the second set d");
  EXPECT_EQ(MatchViews(Names{"a"}, Names{"a", "d"}).error().message,
            "views without a partner: only in the second set d");
  EXPECT_FALSE(MatchViews(Names{}, Names{"a"}).ok());
  EXPECT_FALSE(MatchViews(Names{}, Names{}).ok());
}

TEST(MatchViews, ListsWhatIsThereTwice) {
  const auto pairs = MatchViews(Names{"x/a.png", "y/a.png", "b", "z/a"}, Names{"a", "b", "c", "c.png"});
  ASSERT_FALSE(pairs.ok());
  EXPECT_EQ(pairs.error().code, ErrorCode::kBadArgument);
  EXPECT_NE(pairs.error().message.find("more than once: a, c"), std::string::npos) << pairs.error().message;
  Names many, none = {"other"};
  for (int i = 0; i < 100; ++i) many.push_back("view" + std::to_string(i));
  EXPECT_NE(MatchViews(many, none).error().message.find("and 90 more"), std::string::npos);
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
}

}  // namespace
}  // namespace anchorsplat
