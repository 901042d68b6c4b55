#include "fit/view_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <span>
#include <vector>

namespace anchorsplat {
namespace {

TEST(ViewOrder, EveryEpochSeesEveryViewOnceInAnOrderOfItsOwn) {
  ViewOrder order(13, 5);
  std::vector<int64_t> before;
  for (int64_t epoch = 0; epoch < 20; ++epoch) {
    std::vector<int64_t> views;
    for (int64_t i = 0; i < 13; ++i) views.push_back(order.At(13 * epoch + i));
    EXPECT_EQ(std::set<int64_t>(views.begin(), views.end()).size(), 13u);
    EXPECT_EQ(*std::min_element(views.begin(), views.end()), 0);
    EXPECT_NE(views, before);
    before = views;
  }
}

TEST(ViewOrder, FollowsFromSeedAndStepAlone) {
  ViewOrder from_start(7, 5), later(7, 5), other_seed(7, 6);
  bool differs = false;
  for (int64_t step = 0; step < 100; ++step) {
    const int64_t view = from_start.At(step);
    if (step >= 59) {
      EXPECT_EQ(later.At(step), view);
    }
    differs |= other_seed.At(step) != view;
  }
  EXPECT_TRUE(differs);
  EXPECT_EQ(ViewOrder(1, 3).At(1000), 0);
}

TEST(ViewOrder, SaysWhatComesNextInTheEpoch) {
  ViewOrder order(7, 5), again(7, 5);
  for (int64_t step = 0; step < 21; ++step) {
    const std::span<const int64_t> next = order.From(step);
    ASSERT_EQ(static_cast<int64_t>(next.size()), 7 - step % 7);
    for (size_t k = 0; k < next.size(); ++k) EXPECT_EQ(next[k], again.At(step + static_cast<int64_t>(k)));
  }
}

TEST(ViewOrder, FirstPlacesAreEvenlyTaken) {
  int64_t counts[5] = {};
  ViewOrder order(5, 11);
  for (int64_t epoch = 0; epoch < 5000; ++epoch) ++counts[order.At(5 * epoch)];
  for (const int64_t count : counts) EXPECT_NEAR(static_cast<double>(count), 1000, 150);  // 5 σ
}

}  // namespace
}  // namespace anchorsplat
