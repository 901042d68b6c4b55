#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include "core/simd_targets_for_test.h"

namespace anchorsplat {
namespace {

// What a test reports that has looked at these targets.
std::vector<testing::TestPartResult> Reported(const std::vector<int64_t>& targets) {
  testing::TestPartResultArray results;
  {
    testing::ScopedFakeTestPartResultReporter reporter(&results);
    SkipWhenOnlyOneSimdTarget(targets);
  }
  std::vector<testing::TestPartResult> out;
  for (int i = 0; i < results.size(); ++i) out.push_back(results.GetTestPartResult(i));
  return out;
}

TEST(SimdTargets, OneAloneIsSaidAndNotPassed) {
  const auto one = Reported({HWY_STATIC_TARGET});
  ASSERT_EQ(one.size(), 1u);
  EXPECT_TRUE(one[0].skipped());
  EXPECT_NE(std::string(one[0].message()).find(hwy::TargetName(HWY_STATIC_TARGET)), std::string::npos);
  EXPECT_TRUE(Reported({HWY_STATIC_TARGET, HWY_EMU128}).empty());
}

TEST(SimdTargets, EachIsChosenInTurn) {
  std::vector<int64_t> chosen;
  ForEachSimdTarget([&] { chosen.push_back(hwy::SupportedTargets()); });
  ASSERT_EQ(chosen.size(), SimdTargetsHere().size());
  EXPECT_EQ(chosen.back(), SimdTargetsHere().front());
}

}  // namespace
}  // namespace anchorsplat
