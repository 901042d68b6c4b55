#include "train/sample_loader.h"

#include <gtest/gtest.h>

#include <set>

namespace anchorsplat {
namespace {

TEST(SamplePlan, EveryObjectComesBeforeAnyComesAgain) {
  std::vector<size_t> orders[2];
  for (int64_t epoch = 0; epoch < 2; ++epoch) {
    std::set<size_t> seen;
    for (int64_t i = 0; i < 7; ++i) {
      orders[epoch].push_back(PlannedObject(3, epoch * 7 + i, 7));
      seen.insert(orders[epoch].back());
    }
    EXPECT_EQ(seen.size(), 7u);
  }
  EXPECT_NE(orders[0], orders[1]);
  EXPECT_NE(PlannedObject(4, 0, 1000), PlannedObject(3, 0, 1000));
}

TEST(SamplePlan, ViewsAreDifferentAndOnlyThoseForTraining) {
  TrainingObject object;
  object.training = {1, 2, 5, 9, 11};
  TrainConfig config;
  config.data.views_per_step = 3;
  std::set<size_t> used;
  for (int64_t i = 0; i < 40; ++i) {
    const SamplePlan plan = PlanSample(config, i, 1, object);
    EXPECT_EQ(std::set<size_t>(plan.views.begin(), plan.views.end()).size(), 3u);
    used.insert(plan.views.begin(), plan.views.end());
    EXPECT_EQ(plan.views, PlanSample(config, i, 1, object).views);
  }
  EXPECT_EQ(used, (std::set<size_t>{1, 2, 5, 9, 11}));
  config.data.fixed_views = true;
  EXPECT_EQ(PlanSample(config, 8, 1, object).views, (std::vector<size_t>{1, 2, 5}));
  config.data.views_per_step = 50;
  EXPECT_EQ(PlanSample(config, 8, 1, object).views.size(), 5u);
}

TEST(EvenlySpread, KeepsOrderAndCount) {
  EXPECT_EQ(EvenlySpread({1, 2, 3, 4, 5, 6, 7, 8}, 2), (std::vector<size_t>{3, 7}));
  EXPECT_EQ(EvenlySpread({1, 2, 3}, 0).size(), 3u);
  EXPECT_EQ(EvenlySpread({1, 2, 3}, 7).size(), 3u);
}

}  // namespace
}  // namespace anchorsplat
