#include "core/training_background.h"

#include <gtest/gtest.h>

namespace anchorsplat {
namespace {

using Color = std::array<float, 3>;

TEST(TrainingBackground, IsReadAsItWasWritten) {
  for (const Color& color : {Color{1, 1, 1}, Color{0, 0.5f, 0.1f}, Color{0.2f, 0.3f, 0.7f}}) {
    EXPECT_EQ(BackgroundOf({"something", BackgroundComment(color)}), color);
  }
}

TEST(TrainingBackground, OtherCommentsAndNonsenseAreNone) {
  EXPECT_EQ(BackgroundOf({}), std::nullopt);
  for (const char* text : {"trained over:", "trained over: ", "trained over: 1 1", "trained over: 1 1 2",
                           "trained over: 1 1 -0.1", "trained over: 1 1 nan", "trained over: 1 1 1 1",
                           "trained over: white", "world up: 0 1 0", "TRAINED over: 1 1 1"}) {
    EXPECT_EQ(BackgroundOf({text}), std::nullopt) << text;
  }
  EXPECT_EQ(BackgroundOf({"trained over: x", "trained over: 1 0 1"}), (Color{1, 0, 1}));
}

}  // namespace
}  // namespace anchorsplat
