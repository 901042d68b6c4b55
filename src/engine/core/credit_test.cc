#include "core/credit.h"

#include <gmock/gmock.h>

namespace anchorsplat {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using Comments = std::vector<std::string>;

TEST(Credit, IsWhatFollowsTheWord) {
  EXPECT_THAT(CreditsOf(Comments{"world up: 0 1 0", "credit: Mug by Ann, CC BY 4.0", "credit: scanned by Bob"}),
              ElementsAre("Mug by Ann, CC BY 4.0", "scanned by Bob"));
  EXPECT_THAT(CreditsOf({}), IsEmpty());
  EXPECT_THAT(CreditsOf(Comments{"credit: ", "credit:none", "Credit: x", "a credit: y"}), IsEmpty());
}

TEST(Credit, AsOneTextAndBack) {
  const Comments comments = {"world up: 0 1 0", "credit: Mug by Ann, CC BY 4.0", "credit: scanned by Bob"};
  EXPECT_EQ(CopyrightOf(comments), "Mug by Ann, CC BY 4.0\nscanned by Bob");
  EXPECT_EQ(CopyrightOf({}), "");
  EXPECT_THAT(CommentsOfCopyright(CopyrightOf(comments)), ElementsAre(comments[1], comments[2]));
  EXPECT_THAT(CommentsOfCopyright("\n  Ann\r\n \r\n\n"), ElementsAre("credit: Ann"));
  EXPECT_THAT(CommentsOfCopyright(""), IsEmpty());
}

}  // namespace
}  // namespace anchorsplat
