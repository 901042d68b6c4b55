#include "core/credit.h"

#include <gmock/gmock.h>

namespace anchorsplat {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(Credit, IsWhatFollowsTheWord) {
  EXPECT_THAT(CreditsOf({"world up: 0 1 0", "credit: Mug by Ann, CC BY 4.0", "credit: scanned by Bob"}),
              ElementsAre("Mug by Ann, CC BY 4.0", "scanned by Bob"));
  EXPECT_THAT(CreditsOf({}), IsEmpty());
  EXPECT_THAT(CreditsOf({"credit: ", "credit:none", "Credit: x", "a credit: y"}), IsEmpty());
}

}  // namespace
}  // namespace anchorsplat
