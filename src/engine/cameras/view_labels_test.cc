#include "cameras/view_labels.h"

#include <gtest/gtest.h>

namespace anchorsplat {
namespace {

using Names = std::vector<std::string>;

TEST(ViewLabels, AreAsShortAsTellsViewsApart) {
  EXPECT_EQ(ViewLabels(Names{"train/r_0", "train/r_1"}), (Names{"r_0", "r_1"}));
  EXPECT_EQ(ViewLabels(Names{"images/cam0/0000.png", "images\\cam1\\0000.PNG"}), (Names{"cam0/0000", "cam1/0000"}));
  EXPECT_EQ(ViewLabels(Names{"/x/a/0", "/x/0", "/x/a/b"}), (Names{"a/0", "0", "a/b"}));
  EXPECT_EQ(ViewLabels(Names{"a/../0", "../b/0"}), (Names{"a/0", "b/0"})) << "no way out of a folder";
  EXPECT_EQ(ViewLabels(Names{"a/0", "a/0"}), (Names{"0", "0"}));
  EXPECT_EQ(ViewLabels(Names{"", "/"}), (Names{"", ""}));
  EXPECT_EQ(ViewLabels(Names{"r_0.5"}), (Names{"r_0.5"}));
  EXPECT_TRUE(ViewLabels(Names{}).empty());
}

}  // namespace
}  // namespace anchorsplat
