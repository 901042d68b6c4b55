#include "train/perceptual_objective.h"

#include <gtest/gtest.h>

#include "core/random.h"
#include "perceptual/lpips_synthetic_for_test.h"

namespace anchorsplat {
namespace {

TrueView NoiseView(uint64_t seed, const PixelBox& perceptual) {
  TrueView view;
  view.picture = Image(64, 56, 3);
  view.perceptual = perceptual;
  Random random(seed);
  for (float& v : view.picture.pixels) v = static_cast<float>(random.Uniform());
  return view;
}

torch::Tensor Picture(const TrueView& view) {
  return torch::from_blob(const_cast<float*>(view.picture.pixels.data()), {3, 56, 64}).clone();
}

TEST(PerceptualObjective, LooksAtTheNamedPartOnly) {
  const auto objective = PerceptualObjective::Make(SyntheticLpipsWeights(LpipsNet::kSqueeze));
  ASSERT_TRUE(objective.ok()) << objective.error().message;
  const std::vector<TrueView> truth = {NoiseView(1, {10, 8, 50, 44}), NoiseView(2, {})};
  std::vector<torch::Tensor> rendered = {Picture(NoiseView(3, {})).requires_grad_(true),
                                         Picture(NoiseView(4, {})).requires_grad_(true)};
  const torch::Tensor loss = (*objective)(rendered, truth);
  loss.backward();
  EXPECT_GT(loss.item<float>(), 0.01);
  const torch::Tensor gradient = rendered[0].grad().abs();
  EXPECT_GT(gradient.slice(1, 8, 44).slice(2, 10, 50).max().item<float>(), 0);
  EXPECT_EQ(gradient.slice(1, 0, 8).max().item<float>(), 0);
  EXPECT_EQ(gradient.slice(2, 50, 64).max().item<float>(), 0);
  EXPECT_FALSE(rendered[1].grad().defined()) << "a view without a part counts for nothing";

  // The mean over the views that have one, and nothing when none has.
  const auto alone = (*objective)(std::span(rendered).first(1), std::span(truth).first(1));
  EXPECT_EQ(alone.item<float>(), loss.item<float>());
  EXPECT_EQ((*objective)(std::span(rendered).subspan(1), std::span(truth).subspan(1)).item<float>(), 0);
}

TEST(PerceptualObjective, EqualPicturesAreAtNoDistance) {
  const auto objective = PerceptualObjective::Make(SyntheticLpipsWeights(LpipsNet::kAlex));
  ASSERT_TRUE(objective.ok());
  const TrueView a = NoiseView(1, {0, 0, 64, 56}), b = NoiseView(2, {});
  EXPECT_EQ((*objective)(std::vector{Picture(a)}, std::vector{a}).item<float>(), 0);
  EXPECT_EQ(objective->Distance(a.picture, a.picture), 0);
  EXPECT_GT(objective->Distance(a.picture, b.picture), 0.01);
}

}  // namespace
}  // namespace anchorsplat
