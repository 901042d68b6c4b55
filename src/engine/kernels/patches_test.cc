#include "kernels/patches.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace anchorsplat {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(Patches, LastPatchBorrowsFromTheOneBefore) {
  EXPECT_THAT(PatchPositions(10, 4), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 6, 7));
  EXPECT_THAT(PatchPositions(5, 4), ElementsAre(0, 1, 2, 3, 4, 1, 2, 3));
  EXPECT_THAT(PatchPositions(8, 4), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
  EXPECT_THAT(PatchPositions(3, 4), ElementsAre(0, 1, 2)) << "one short patch is not filled";
  EXPECT_THAT(PatchPositions(0, 4), IsEmpty());
}

TEST(Patches, OfThePaper) {
  const Buffer<int32_t> positions = PatchPositions(2500);
  ASSERT_EQ(positions.size(), 3072u);
  EXPECT_EQ(positions[2499], 2499);
  EXPECT_EQ(positions[2500], 1476);
  EXPECT_EQ(positions[3071], 2047);
}

TEST(Patches, RowsFollowTheOrder) {
  const std::vector<int32_t> order = {4, 2, 0, 1, 3};
  EXPECT_THAT(PatchRows(order, 4), ElementsAre(4, 2, 0, 1, 3, 2, 0, 1));
}

}  // namespace
}  // namespace anchorsplat
